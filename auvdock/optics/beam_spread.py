"""What scattering makes of a narrow beam: the beam's profile folded with the water's halo.

A receiver at the angle θ from a beam's axis gets scattered light from rays that left the lamp at angles ψ from the line
of sight. In homogeneous water the distribution of ψ is, by reciprocity, the halo h that a camera sees about a lamp
(Mertens & Replogle 1977): the beam spread function. Hence the scattered irradiance is that of a lamp that shines with
f(θ) = 1 all around, times

    g(θ) = ∫ f(angle between ray and axis) h(ψ) dω,    ∫ h dω = 1 within 90°,

over the sphere, with `optics.halo` for the path's b r. The mean of f over the rays at one ψ depends on the beam alone
and is tabulated once; a water's g is that times the light in rings of h.

The light that is scattered once, far from the axis, comes along the beam: that is what one sees of the beam from the
side. `lead` is the mean of the component of ψ towards the beam, hence the angle that the light turned on its way.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.optics.halo import HALO_ANGLE_RAD, HALO_ROWS, HaloTable

__all__ = ["BeamSpread", "beam_spread"]

_ANGLES = 192
_FIRST_RAD = 1e-4
_EDGE_RAD = np.concatenate([HALO_ANGLE_RAD, np.linspace(math.pi / 2.0, math.pi, 19)[1:]])
"""Outer edges of the rings of ψ."""
_FALLS = 6.0
"""So many σ from its axis a beam counts as nothing: e^-18."""
_NODES = 24


class BeamSpread:
    """g and lead over b r and angle, for one beam in one water; rows are those of the halo's table.

    Between its angles and rows it is linear, of g the logarithm.
    """

    def __init__(self, halo: HaloTable, first_row: int, half_angle_rad: float) -> None:
        """Tabulate.

        Args:
            halo: of the water, what a narrow beam spreads to.
            first_row: of the lamp's wavelength there.
            half_angle_rad: θ_h of the profile f = exp(-ln 2 (θ / θ_h)²).
        """
        self._halo = halo
        mean, along = _means(half_angle_rad)
        own = slice(first_row, first_row + HALO_ROWS)
        inner = np.diff(halo.encircled_rows(HALO_ANGLE_RAD)[own], axis=1, prepend=0.0)
        edge = _EDGE_RAD[len(HALO_ANGLE_RAD) - 1 :]
        outer = halo.density_rows(0.5 * (edge[1:] + edge[:-1]))[own] * (-2.0 * math.pi * np.diff(np.cos(edge)))
        rings = np.concatenate([inner, outer], axis=1)
        share = np.maximum(rings @ mean, 1e-300)
        self._log_angle = np.log(_angles())
        self._log_share = np.log(share)
        self._lead = np.maximum(rings @ along, 0.0) / share

    def share(self, br: Array, angle_rad: Array) -> Array:
        """(n,) g at b r (n,) and angles (n,) from the beam's axis."""
        return np.exp(self._between(self._log_share, br, angle_rad))

    def lead_rad(self, br: Array, angle_rad: Array) -> Array:
        """(n,) mean angle from the line of sight, towards the beam, at which the light left the lamp."""
        return self._between(self._lead, br, angle_rad)

    def _between(self, table: Array, br: Array, angle_rad: Array) -> Array:
        row, weight = self._halo.row_of(br.ravel(), 0)
        return _between(table, row, weight, self._log_angle, angle_rad.ravel()).reshape(br.shape)


@lru_cache(maxsize=16)
def beam_spread(halo: HaloTable, first_row: int, half_angle_rad: float) -> BeamSpread:
    """The table for one beam in one water, made once."""
    return BeamSpread(halo, first_row, half_angle_rad)


def _angles() -> Array:
    return np.geomspace(_FIRST_RAD, math.pi, _ANGLES)


@lru_cache(maxsize=8)
def _means(half_angle_rad: float) -> tuple[Array, Array]:
    """Means over the rings of ψ (rings, angles) of f and of f × ψ towards the beam, at angles from the axis.

    Over the way round by Gauss and Legendre within 6 σ of the axis, over a ring in steps of half a σ or less.
    """
    sigma = half_angle_rad / math.sqrt(2.0 * math.log(2.0))
    inner_edge = np.concatenate([[0.0], _EDGE_RAD[:-1]])
    parts = np.ceil((_EDGE_RAD - inner_edge) / (0.5 * sigma)).astype(np.int64)
    ring = np.repeat(np.arange(len(parts)), parts)
    place = (np.arange(len(ring)) - np.repeat(np.cumsum(parts) - parts, parts) + 0.5) / parts[ring]
    psi, theta = inner_edge[ring] + place * (_EDGE_RAD - inner_edge)[ring], _angles()
    weight = np.sin(psi) / np.bincount(ring, np.sin(psi))[ring]
    node, node_weight = np.polynomial.legendre.leggauss(_NODES)
    mean, along = np.empty((len(parts), len(theta))), np.empty((len(parts), len(theta)))
    first = np.cumsum(parts) - parts
    for j, angle in enumerate(theta.tolist()):
        product = math.sin(angle) * np.sin(psi)
        reach = np.minimum(_FALLS * sigma / np.sqrt(np.maximum(product, 1e-30)), math.pi)[:, None]
        way = 0.5 * reach * (node + 1.0)
        chord2 = np.sin(0.5 * (angle - psi))[:, None] ** 2 + product[:, None] * np.sin(0.5 * way) ** 2
        apart = 2.0 * np.arcsin(np.minimum(np.sqrt(chord2), 1.0))
        f = np.exp(-math.log(2.0) * (apart / half_angle_rad) ** 2) * node_weight * (0.5 / math.pi) * reach
        mean[:, j] = np.add.reduceat(f.sum(axis=1) * weight, first)
        along[:, j] = np.add.reduceat((f * np.cos(way)).sum(axis=1) * weight * psi, first)
    return mean, along


@compiled
def _between(table: Array, row: IntArray, weight: Array, log_angle: Array, angle_rad: Array) -> Array:
    """(n,) the table between rows (n,) and the next, at angles (n,), linear between its columns."""
    value = np.empty(len(row))
    last = len(log_angle) - 2
    for i in range(len(row)):
        right = (np.log(min(max(angle_rad[i], _FIRST_RAD), math.pi)) - log_angle[0]) / (log_angle[1] - log_angle[0])
        column, up = min(int(right), last), weight[i]
        right -= column
        low = table[row[i], column] * (1.0 - right) + table[row[i], column + 1] * right
        high = table[row[i] + 1, column] * (1.0 - right) + table[row[i] + 1, column + 1] * right
        value[i] = low * (1.0 - up) + high * up
    return value
