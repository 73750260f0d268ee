"""Share of a scattering that ends within a cone: what a photon's last scattering sends towards a narrow view.

A photon that flies at the angle Θ from a cone's axis is scattered by χ with the density 2π p(χ) sin χ, on a circle
about its direction of which the part

    arc = arccos[(cos α - cos Θ cos χ) / (sin Θ sin χ)] / π

lies within the cone's half angle α: all of it for χ < α - Θ, none for χ < Θ - α or χ > Θ + α. So the share is
P(Θ, α) = ∫ arc dF(χ), F the phase function's cumulative.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.photons.phase import PhaseFunction

__all__ = ["cone_table"]

_NODES = 256


def cone_table(phase: PhaseFunction, log_sine: Array, place: Array) -> Array:
    """(n, m) share that is scattered into a cone, to 0.2 %.

    Args:
        phase: what scatters.
        log_sine: (n,) logarithm of the sine of the cone's half angle α, up to 0, α = π / 2.
        place: (m,) z = ±√|log Θ / α|, the sign that of the logarithm: close about the cone's border, where the share
            has a cusp. No 0. Angles Θ beyond π count as π.
    """
    log_angle, log_share = np.log(phase.angle_rad), np.log(phase.cumulative)
    turn = (np.arange(_NODES) + 0.5) * math.pi / _NODES
    table = np.empty((len(log_sine), len(place)))
    for row, half in zip(table, np.arcsin(np.exp(log_sine)), strict=True):
        off = np.minimum(half * np.exp(np.sign(place) * place**2), math.pi)
        # From where and to where a circle lies in part within the cone.
        low, high = np.abs(half - off), np.minimum(half + off, 2.0 * math.pi - half - off)
        high = np.maximum(high, low * (1.0 + 1e-12))
        middle, reach = 0.5 * np.log(low * high)[:, None], 0.5 * np.log(high / low)[:, None]
        at = np.exp(middle + reach * np.cos(turn))
        away = np.maximum(np.sin(off)[:, None] * np.sin(at), 1e-300)
        arc = np.arccos(np.clip((math.cos(half) - np.cos(off)[:, None] * np.cos(at)) / away, -1.0, 1.0)) / math.pi
        density = 2.0 * math.pi * phase.density(at.ravel()).reshape(at.shape) * np.sin(at) * at
        row[:] = (arc * density * np.sin(turn)).sum(axis=1) * reach[:, 0] * math.pi / _NODES
        below, beyond = (np.exp(np.interp(np.log(edge), log_angle, log_share)) for edge in (low, high))
        row += np.where(off < half, below, 0.0) + np.where(off + half > math.pi, 1.0 - beyond, 0.0)
    return table
