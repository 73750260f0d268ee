"""The halo: how much light of a lamp arrives scattered, and from where, in one water.

Whoever asks for it asks `halo_of`: renderer, `beacons` fidelity, rotating beacon and planners. It comes from the tables
of single photons (`optics.photons.table`), over b r and angle at the a / b that the water has at a lamp's wavelength. A
water whose phase function is "wells" has the model of that name (`optics.wells`).

A table holds a block of rows for each wavelength, one below the other, so that a lamp is found by its block's first row
and its b r. A lamp's halo is I f(θ) e^{-a r} / r² times (1 - e^{-b r}) `whole`, and that times a density over angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Records
from auvdock.optics.arrival import HaloPlaces, place_in_halo
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.table import PhotonHalo, photon_halo_of
from auvdock.optics.water import WELLS, WaterCfg
from auvdock.optics.wells import wells_halo

__all__ = ["HALO_ANGLE_RAD", "HALO_ROWS", "HaloTable", "halo_of"]

HALO_ROWS = 112
"""Rows of b r for each wavelength."""
_BEND_BR, _LAST_BR = 2.0, 60.0
_LEAST_BR = 1e-5
HALO_ANGLE_RAD = np.geomspace(1e-5, math.pi / 2.0, 192)
"""Angles at which the halo is kept."""
_STEP = math.log(HALO_ANGLE_RAD[1] / HALO_ANGLE_RAD[0])
_HALF_PI = math.pi / 2.0
_NOTHING = 1e-30


class _Block(NamedTuple):
    """Halo of one wavelength over b r (`HALO_ROWS`,) and `HALO_ANGLE_RAD`.

    Attributes:
        whole: (rows,) light within 90° over 1 - e^{-b r}.
        density: (rows, angles) halo per steradian, over what lies within 90°.
        log_within: (rows, angles) logarithm of the share within.
    """

    whole: Array
    density: Array
    log_within: Array


class HaloTable:
    """Halos of one water over b r and angle, of unit light without the loss e^{-a r}, for some wavelengths.

    Rows are even in ln(1 + b r / 2), 112 for b r from 0 to 60, and read linearly: within 2 % of the photons' table for
    a / b up to 1, and for more wherever absorption leaves e^-40 of the light. Beyond b r = 60 the last row is held, so
    is a / b beyond 0.01 and 100. Inside 10 µrad the light within an angle goes on as the same power of it, its radiance
    is held. No photon was counted that arrives from behind a camera, beyond 90° off the lamp: radiance goes on as 2/π ×
    (π - θ) / sin θ of that at 90°, single scattering by a phase function that is even backwards; `whole` is without it.

    Attributes:
        places: where in a block which b r is, one row.
        whole: (rows,) light within 90° over 1 - e^{-b r}, of all blocks.
    """

    def __init__(self, blocks: dict[float, _Block], phase: Callable[[Array], Array]) -> None:
        """Put blocks below one another.

        Args:
            blocks: by wavelength in nm.
            phase: the water's phase function in 1/sr.
        """
        self._first = {nm: HALO_ROWS * k for k, nm in enumerate(blocks)}
        self.places: Records[HaloPlaces] = HaloPlaces(_BEND_BR, (HALO_ROWS - 1) / _reach(), HALO_ROWS - 1.0).packed()
        parts = list(blocks.values())
        self.whole: Array = np.concatenate([block.whole for block in parts])
        self._density = np.concatenate([block.density for block in parts])
        self._log_within = np.concatenate([block.log_within for block in parts])
        self._phase = phase

    def first_row(self, wavelength_nm: float) -> int:
        """First row of the block of one of the table's wavelengths."""
        return self._first[wavelength_nm]

    def density_rows(self, angle_rad: Array) -> NDArray[np.float32]:
        """(rows, m) halo per steradian at fixed angles (m,), over what lies within 90°, of single precision."""
        behind = np.minimum(np.maximum(angle_rad, _HALF_PI), math.pi - 1e-6)
        return _blend(self._density, *_place(angle_rad), (math.pi - behind) / np.sin(behind) / _HALF_PI)

    def encircled_rows(self, angle_rad: Array) -> Array:
        """(rows, m) share of what lies within 90° that lies within half angles (m,) above 0."""
        column, weight = _place(angle_rad)
        power = (self._log_within[:, 1:2] - self._log_within[:, :1]) / _STEP
        below = np.minimum(np.log(angle_rad / HALO_ANGLE_RAD[0]), 0.0)
        rows = self._log_within[:, column] * (1.0 - weight) + self._log_within[:, column + 1] * weight
        return np.exp(rows + power * below)

    def row_of(self, br: Array, first_row: int) -> tuple[IntArray, Array]:
        """Row (n,) below each b r (n,) in a block and the weight (n,) of the row above."""
        row, weight = place_in_halo(br, self.places)
        return row + first_row, weight

    def scattered(self, br: Array, first_row: int) -> Array:
        """(n,) all light within 90° at b r (n,)."""
        return self._read(self.whole, br, first_row) * -np.expm1(-br)

    def median_rad(self, br: Array, first_row: int) -> Array:
        """(n,) angle within which half of that light lies."""
        return np.exp(self._read(self._log_medians, br, first_row))

    def density(self, br: float, angle_rad: Array, first_row: int = 0) -> Array:
        """(m,) halo per steradian at angles (m,) for one b r."""
        return self._one(self.density_rows(angle_rad), br, first_row)

    def encircled(self, br: float, angle_rad: Array, first_row: int = 0) -> Array:
        """(m,) halo within half angles (m,) for one b r."""
        return self._one(self.encircled_rows(angle_rad), br, first_row)

    def phase_per_sr(self, angle_rad: Array) -> Array:
        """(m,) the water's phase function in 1/sr at scattering angles (m,) above 0."""
        return self._phase(angle_rad)

    def _one(self, rows: Array | NDArray[np.float32], br: float, first_row: int) -> Array:
        depth = np.array([br])
        row, weight = self.row_of(depth, first_row)
        blend = rows[row[0]] * (1.0 - weight[0]) + rows[row[0] + 1] * weight[0]
        return blend * self.scattered(depth, first_row)

    def _read(self, rows: Array, br: Array, first_row: int) -> Array:
        row, weight = self.row_of(br, first_row)
        return rows[row] * (1.0 - weight) + rows[row + 1] * weight

    @cached_property
    def _log_medians(self) -> Array:
        """(rows,) logarithm of the angle within which half of the light lies."""
        log_angle = np.log(HALO_ANGLE_RAD)
        return np.array([np.interp(math.log(0.5), row, log_angle) for row in self._log_within])


def halo_of(water: WaterCfg, wavelengths_nm: Sequence[float] = (450.0,)) -> HaloTable:
    """The halos in a water at some wavelengths: a few milliseconds for each, and kept.

    Raises:
        ConfigError: no halo ships for the water's phase function.
    """
    return _halo_of(water, tuple(dict.fromkeys(wavelengths_nm)))


@lru_cache(maxsize=16)
def _halo_of(water: WaterCfg, wavelengths_nm: tuple[float, ...]) -> HaloTable:
    if water.phase == WELLS:
        model = wells_halo(water.scattering_angle_rad)
        br = _rows_br()
        block = _block(br, model.encircled(br, HALO_ANGLE_RAD), model.density(br, HALO_ANGLE_RAD))
        return HaloTable(dict.fromkeys(wavelengths_nm, block), model.phase)
    halo = photon_halo_of(water)
    blocks = {nm: _photon_block(halo, water.absorption_at(nm), water.scattering_at(nm)) for nm in wavelengths_nm}
    return HaloTable(blocks, load_phase(halo.phase).density)


def _photon_block(halo: PhotonHalo, a: float, b: float) -> _Block:
    low, high = np.exp(halo.log_absorption[[0, -1]])
    ratio, br = float(np.clip(a / b if b > 0.0 else high, low, high)), _rows_br()
    return _block(br, *halo.read(br, ratio, HALO_ANGLE_RAD))


def _block(br: Array, within: Array, density: Array) -> _Block:
    whole = np.maximum(within[:, -1:], 1e-300)
    return _Block(whole[:, 0] / -np.expm1(-br), density / whole, np.log(np.maximum(within / whole, _NOTHING)))


def _place(angle_rad: Array) -> tuple[IntArray, Array]:
    """Column (m,) of the table below each angle (m,) and the weight of the one above, by the angle's logarithm."""
    place = np.log(np.clip(angle_rad, HALO_ANGLE_RAD[0], _HALF_PI) / HALO_ANGLE_RAD[0]) / _STEP
    column = np.minimum(place.astype(np.int64), len(HALO_ANGLE_RAD) - 2)
    return column, place - column


@compiled
def _blend(table: Array, column: IntArray, weight: Array, factor: Array) -> NDArray[np.float32]:
    """(rows, m) a table (rows, angles) between columns (m,) and the next, times a factor (m,)."""
    blend = np.empty((len(table), len(column)), dtype=np.float32)
    for row in range(len(table)):
        line, out = table[row], blend[row]
        for i in range(len(column)):
            low, high = line[column[i]], line[column[i] + 1]
            out[i] = (low + weight[i] * (high - low)) * factor[i]
    return blend


def _reach() -> float:
    return math.log1p(_LAST_BR / _BEND_BR)


@lru_cache(maxsize=1)
def _rows_br() -> Array:
    br = _BEND_BR * np.expm1(np.linspace(0.0, _reach(), HALO_ROWS))
    return np.clip(br, _LEAST_BR, _LAST_BR)
