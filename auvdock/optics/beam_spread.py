"""What scattering makes of a narrow beam: the beam's profile convolved with the water's small-angle spread.

A receiver at the angle θ from a beam's axis gets scattered light from rays that left the lamp at angles ψ from the line
of sight. In homogeneous water the distribution of ψ is, by reciprocity, the point spread function h that a camera sees
about a lamp (Mertens & Replogle 1977): the beam spread function. The light that left at ψ was sent out with f(θ - ψ),
hence the scattered irradiance is that of a lamp that shines with f(θ) = 1 all around, times

    g(θ) = ∫ f(θ - ψ) h(ψ) d²ψ,    ∫ h d²ψ = 1,

where h is Wells' (1973) function for the path's b r (`optics.halo`). With f a Gaussian and the transfer function known,
both sides are products in the frequency domain, and g is a Hankel transform that the Gaussian cuts off.

The light that is scattered once, far from the axis, comes along the beam: that is what one sees of the beam from the
side. `lead` is the mean of the component of ψ towards the beam, hence the angle that the light turned on its way.
Angles are treated as plane, as Wells does; beyond some 60° that is an extrapolation.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.special import j0, j1

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.optics.halo import HaloTable

__all__ = ["BeamSpread", "beam_spread"]

_ROWS = 64
_MIN_BR, _MAX_BR = 1e-3, 40.0
_ANGLES = 192
_FIRST_RAD = 1e-4
_CUT = 34.0
"""e^-34: where the Gaussian's transform counts as nothing."""


class BeamSpread:
    """g and lead over b r and angle, for one beam in one water.

    Beyond b r = 40 the table's last row is kept; between its angles and rows it is linear in the logarithms.
    """

    def __init__(self, halo: HaloTable, half_angle_rad: float) -> None:
        """Tabulate; some 50 ms.

        Args:
            halo: of the water, what a narrow beam spreads to.
            half_angle_rad: θ_h of the profile f = exp(-ln 2 (θ / θ_h)²).
        """
        self._log_br = np.linspace(math.log(_MIN_BR), math.log(_MAX_BR), _ROWS)
        angle = np.geomspace(_FIRST_RAD, math.pi, _ANGLES)
        self._log_angle = np.log(angle)
        width = math.log(2.0) / half_angle_rad**2
        highest = math.sqrt(_CUT * width) / math.pi
        nu, weights = _gauss(highest)
        beam = math.pi / width * np.exp(-(math.pi**2) * nu**2 / width) * nu * weights
        phase = 2.0 * math.pi * np.outer(nu, angle)
        br = np.exp(self._log_br)
        spread, slope = np.swapaxes([halo.transfer(float(x), nu) for x in br], 0, 1) / halo.scattered(br)[:, None]
        share = (spread * beam) @ (2.0 * math.pi * j0(phase))
        turned = (slope * beam) @ -j1(phase)
        self._log_share = np.log(np.maximum(share, 1e-300))
        self._lead = np.maximum(turned, 0.0) / np.maximum(share, 1e-300)

    def share(self, br: Array, angle_rad: Array) -> Array:
        """(n,) g at b r (n,) and angles (n,) from the beam's axis."""
        return np.exp(self._between(self._log_share, br, angle_rad))

    def lead_rad(self, br: Array, angle_rad: Array) -> Array:
        """(n,) mean angle from the line of sight, towards the beam, at which the light left the lamp."""
        return self._between(self._lead, br, angle_rad)

    def _between(self, table: Array, br: Array, angle_rad: Array) -> Array:
        return _between(table, self._log_br, self._log_angle, br.ravel(), angle_rad.ravel()).reshape(br.shape)


@lru_cache(maxsize=16)
def beam_spread(halo: HaloTable, half_angle_rad: float) -> BeamSpread:
    """The table for one beam in one water, made once."""
    return BeamSpread(halo, half_angle_rad)


def _gauss(highest: float) -> tuple[Array, Array]:
    """Nodes and weights for [0, highest]: panels of 32 nodes, ten or more per turn of J(2π ν θ) at θ = π."""
    panels = max(12, math.ceil(10.0 * highest * math.pi / 32.0))
    nodes, weights = np.polynomial.legendre.leggauss(32)
    width = highest / panels
    nu = (np.arange(panels)[:, None] + 0.5 * (nodes + 1.0)) * width
    return nu.ravel(), np.tile(0.5 * width * weights, panels)


@compiled
def _between(table: Array, log_br: Array, log_angle: Array, br: Array, angle_rad: Array) -> Array:
    """(n,) the table at b r (n,) and angles (n,), linear between its rows and columns."""
    value = np.empty(len(br))
    last_row, last_column = len(log_br) - 2, len(log_angle) - 2
    for i in range(len(br)):
        up = (np.log(min(max(br[i], _MIN_BR), _MAX_BR)) - log_br[0]) / (log_br[1] - log_br[0])
        right = (np.log(min(max(angle_rad[i], _FIRST_RAD), math.pi)) - log_angle[0]) / (log_angle[1] - log_angle[0])
        row, column = min(int(up), last_row), min(int(right), last_column)
        up -= row
        right -= column
        low = table[row, column] * (1.0 - right) + table[row, column + 1] * right
        high = table[row + 1, column] * (1.0 - right) + table[row + 1, column + 1] * right
        value[i] = low * (1.0 - up) + high * up
    return value
