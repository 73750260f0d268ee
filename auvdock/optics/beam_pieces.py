"""How the light of a beam's pieces spreads about them, for the renderer and for the `beacons` fidelity alike.

A piece sends unscattered light, which shows the beam as it is, and scattered light, which spreads as the halo
smoothed over the piece's size s. With w the halo within s of a point, a share w² is a Gaussian of this size, for a halo
that is narrower than the piece, and the rest is (1 + w) h(√(θ² + s²)), for one that is broader; together they hold what
h holds. A beam that is wider than its piece is long has no direction left to show: its unscattered light is a Gaussian
as well.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import LEAST_EXPONENT
from auvdock.optics.halo import HALO_ROWS, HaloTable
from auvdock.optics.view import Beam

__all__ = ["BeamPieces", "PieceLight"]

_ANGLES = 512
_FIRST_RAD = 1e-4
_FILL = 0.7
"""Standard deviation of a piece's Gaussian over the piece's length."""


class PieceLight(NamedTuple):
    """Shares of a beam's pieces (k,) and their sizes.

    Attributes:
        size_rad: (k,) standard deviation of the Gaussians.
        log_density: (k, angles) logarithm of each piece's halo per steradian and scattered light, over log angle.
        scattered: (k,) share that is scattered on the way to the camera.
        ribbon: (k,) share that shows the beam sharp.
        blob: (k,) share in the Gaussian.
    """

    size_rad: Array
    log_density: Array
    scattered: Array
    ribbon: Array
    blob: Array


class BeamPieces:
    """Tables of one lamp in one water."""

    def __init__(self, halo: HaloTable, first_row: int, least_rad: float) -> None:
        """Tabulate the halo.

        Args:
            halo: of the water.
            first_row: of the lamp's wavelength there.
            least_rad: least size of a piece's Gaussian.
        """
        self._halo, self._first_row = halo, first_row
        own = slice(first_row, first_row + HALO_ROWS)
        self._first, self._last = math.log(_FIRST_RAD), math.log(math.pi)
        self._per_step = (_ANGLES - 1) / (self._last - self._first)
        grid = np.exp(np.linspace(self._first, self._last, _ANGLES))
        self._log_rows = np.log(np.maximum(halo.density_rows(grid)[own].astype(np.float64), 1e-30))
        self._encircled = halo.encircled_rows(grid)[own]
        self._least_rad = least_rad

    def light(self, beam: Beam) -> PieceLight:
        """How the pieces' light divides."""
        length = _FILL * np.diff(beam.edge_rad)
        size = np.hypot(np.maximum(length, self._least_rad), beam.width_rad)
        row, weight = self._halo.row_of(beam.scattering_depth, 0)
        column, right = self._place(0.5 * np.log(np.minimum(size, math.pi) ** 2))
        low = self._encircled[row, column] * (1.0 - right) + self._encircled[row, column + 1] * right
        high = self._encircled[row + 1, column] * (1.0 - right) + self._encircled[row + 1, column + 1] * right
        within = low * (1.0 - weight) + high * weight
        scattered = self._halo.scattered(beam.scattering_depth, self._first_row)
        scattered = scattered / (scattered + np.exp(-beam.scattering_depth))
        ribbon = (1.0 - scattered) / (1.0 + (beam.width_rad / length) ** 4)
        blob = 1.0 - scattered - ribbon + scattered * within**2
        rows = self._log_rows[row] * (1.0 - weight[:, None]) + self._log_rows[row + 1] * weight[:, None]
        rows += np.log1p(within)[:, None]
        return PieceLight(size, rows, scattered, ribbon, blob)

    def per_sr(self, pieces: PieceLight, angle2: Array, gauss: Array) -> Array:
        """(k, n) share of each piece's light per steradian at squared angles (n,) or (k, n) from it.

        Args:
            pieces: of the beam.
            angle2: squared angles.
            gauss: (k,) shares in the Gaussians, `blob` or with the ribbon on top.
        """
        each = np.broadcast_to(angle2, (len(pieces.size_rad), angle2.shape[-1]))
        return _per_sr(*pieces[:3], gauss, each, self._first, self._per_step)

    def _place(self, log_angle: Array) -> tuple[IntArray, Array]:
        """Column below each log angle and the weight of the one above."""
        place = (log_angle - self._first) * self._per_step
        column = np.minimum(place.astype(np.int64), _ANGLES - 2)
        return column, place - column


@compiled
def _per_sr(
    size_rad: Array, log_density: Array, scattered: Array, gauss: Array, angle2: Array, first: float, per_step: float
) -> Array:
    """`BeamPieces.per_sr` at squared angles (k, n)."""
    pieces, count = angle2.shape
    density = np.empty((pieces, count))
    last = log_density.shape[1] - 2
    for k in range(pieces):
        size2 = size_rad[k] * size_rad[k]
        peak, table = gauss[k] / (2.0 * math.pi * size2), log_density[k]
        for i in range(count):
            place = (0.5 * np.log(angle2[k, i] + size2) - first) * per_step
            column = min(int(place), last)
            halo = table[column] + (place - column) * (table[column + 1] - table[column])
            density[k, i] = scattered[k] * np.exp(halo)
            exponent = angle2[k, i] * (-0.5 / size2)
            if exponent > LEAST_EXPONENT:
                density[k, i] += peak * np.exp(exponent)
    return density
