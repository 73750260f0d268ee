"""Draws cores and halos into a buffer of electrons.

A halo is split at a fixed angle into a part that is smooth everywhere and a fine remainder about its centre. The smooth
parts of all lamps are evaluated together on the coarse grid of `Lens` through one radial table, and enlarged; the
remainder is added in full resolution on a small patch and scaled so that the patch holds exactly the light that the
table says. Table and patch share one index, the fourth root of the squared chord: fine near the centre, wide outside.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from auvdock.core.arrays import Array, IntArray
from auvdock.optics.halo import halo_table
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet, Received
from auvdock.optics.spots import SpotModel
from auvdock.optics.water import WaterCfg

__all__ = ["LightsImage", "add_spot", "coloured"]

_ENTRIES = 4096
_SPLIT_COARSE_PX = 6
_ROOT_2 = math.sqrt(2.0)


class LightsImage:
    """Cores and halos of a set of lamps on one camera's sensor."""

    def __init__(self, lens: Lens, lights: LightSet, water: WaterCfg, spots: SpotModel) -> None:
        """Tabulate the halo on the shared index."""
        self._lens, self._spots = lens, spots
        self._scale = (_ENTRIES - 1) / _ROOT_2
        index = np.arange(_ENTRIES) / self._scale
        angle = 2.0 * np.arcsin(np.minimum(index**2 / 2.0, 1.0))
        self._angle = np.maximum(angle, 1e-7)
        table = halo_table(water.scattering_angle_rad)
        self._table = table
        self._rows = table.density_rows(self._angle).astype(np.float32)
        self._split_px = _SPLIT_COARSE_PX * lens.factor
        self.reach_px = float(self._split_px)
        self._split_rad = self._split_px * lens.rad_per_px
        inner = np.array([self._split_rad, 0.97 * self._split_rad, 1.03 * self._split_rad])
        self._inner_rows = table.density_rows(inner)
        self._encircled = table.encircled_rows(inner[:1])[:, 0]
        self._last_inner = int(math.sqrt(2.0 * math.sin(self._split_rad / 2.0)) * self._scale)
        self._inner_angle2 = (self._angle[: self._last_inner + 1] ** 2).astype(np.float32)
        self._rays = lens.rays.astype(np.float32)
        self._coarse_solid_angle = np.repeat(lens.solid_angle_sr.astype(np.float32)[:, :, None], 3, axis=2)
        self._channel = lights.electrons_per_j * lens.aperture_m2
        self._reach = np.arange(-self._split_px, self._split_px + 1, dtype=np.float64)

    def coarse(self, received: Received, index: IntArray, exposure_s: float) -> NDArray[np.float32]:
        """Smooth parts of the halos of lamps `index` (m,): electrons per image pixel on the coarse grid, (h, w, 3)."""
        if len(index) == 0:
            return np.zeros((*self._lens.shape, 3), dtype=np.float32)
        tables, smooth = self._tables(received, index)
        last = self._last_inner
        tables[:, : last + 1] = smooth[:, :1] + smooth[:, 1:2] * self._inner_angle2
        rays = received.ray_camera[index].astype(np.float32)
        chord2 = 2.0 - 2.0 * (rays @ self._rays.T)
        np.maximum(chord2, 0.0, out=chord2)
        np.sqrt(chord2, out=chord2)
        np.sqrt(chord2, out=chord2)
        chord2 *= self._scale
        place = chord2.astype(np.int32)
        place += (np.arange(len(index), dtype=np.int32) * _ENTRIES)[:, None]
        values = np.take(tables.ravel(), place)
        weight = (received.halo_w_m2[index, None] * self._channel[index] * exposure_s).astype(np.float32)
        image = (values.T @ weight).reshape(*self._lens.shape, 3)
        image *= self._coarse_solid_angle
        return image

    def add_fine(
        self, image: NDArray[np.float32], received: Received, pixels: Array, index: IntArray, exposure_s: float
    ) -> None:
        """Add the halos' fine remainders and the cores of lamps `index` (m,) at their pixels to `image` (H, W, 3)."""
        if len(index) == 0:
            return
        tables, smooth = self._tables(received, index)
        last = self._last_inner
        tables[:, : last + 1] -= smooth[:, :1] + smooth[:, 1:2] * self._inner_angle2
        tables[:, last + 1 :] = 0.0
        sigma = self._spots.sigma_px(received.range_m[index])
        centre = np.rint(pixels[index])
        offset = centre - pixels[index]
        metric = self._lens.metric_at(centre)
        dx = (self._reach[None, :] + offset[:, :1]).astype(np.float32)
        dy = (self._reach[None, :] + offset[:, 1:]).astype(np.float32)
        g = metric.astype(np.float32)
        # The core's blur also softens the cusp of the halo.
        soft = (1.5 * sigma**2 * self._lens.rad_per_px**2).astype(np.float32)
        angle2 = (g[:, :1] * dx * dx)[:, None, :] + (g[:, 2:] * dy * dy + soft[:, None])[:, :, None]
        angle2 += (2.0 * g[:, 1:2] * dy)[:, :, None] * dx[:, None, :]
        np.sqrt(angle2, out=angle2)
        np.sqrt(angle2, out=angle2)
        angle2 *= self._scale
        place = angle2.astype(np.int32)
        np.minimum(place, _ENTRIES - 1, out=place)
        place += (np.arange(len(index), dtype=np.int32) * _ENTRIES)[:, None, None]
        patch = np.take(tables.ravel(), place)
        inside = self._inside(received, index, smooth)
        total = patch.sum(axis=(1, 2), dtype=np.float64)
        patch *= (received.halo_w_m2[index] * inside / np.maximum(total, 1e-30)).astype(np.float32)[:, None, None]
        colour = (self._channel[index] * exposure_s).astype(np.float32)
        reach = self._split_px
        core = received.core_w_m2[index]
        narrow = sigma * 4.5 + 1.0 <= reach
        across, down = self._core_profiles(offset, sigma)
        down *= (core * narrow).astype(np.float32)[:, None]
        patch += down[:, :, None] * across[:, None, :]
        corner = centre.astype(np.int64) - reach
        for k in range(len(index)):
            _add_patch(image, patch[k], int(corner[k, 0]), int(corner[k, 1]), colour[k])
            if not narrow[k]:
                add_spot(image, pixels[index[k]], float(sigma[k]), colour[k] * np.float32(core[k]))

    def _core_profiles(self, offset: Array, sigma: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Shares of Gaussian cores (m, patch) per column and per row, lights at -`offset` (m, 2) from the centre."""
        edges = np.append(self._reach - 0.5, self._reach[-1] + 0.5)
        scale = 1.0 / (sigma * _ROOT_2)
        place = (edges + offset[:, :, None]) * scale[:, None, None]
        shares = np.diff(erf(place), axis=2).astype(np.float32)
        shares *= 0.5
        return shares[:, 0], shares[:, 1]

    def _tables(self, received: Received, index: IntArray) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Per lamp the density on the shared index (m, entries) and the smooth inner part's A, B of A + B θ² (m, 2)."""
        row, weight = self._table.row_of(received.scattering_depth[index])
        weight32 = weight.astype(np.float32)[:, None]
        tables = self._rows[row + 1]
        tables -= self._rows[row]
        tables *= weight32
        tables += self._rows[row]
        ends = self._inner_rows[row] * (1.0 - weight[:, None]) + self._inner_rows[row + 1] * weight[:, None]
        slope = (ends[:, 2] - ends[:, 1]) / (0.06 * self._split_rad)
        curve = slope / (2.0 * self._split_rad)
        level = ends[:, 0] - curve * self._split_rad**2
        return tables, np.column_stack([level, curve]).astype(np.float32)

    def _inside(self, received: Received, index: IntArray, smooth: NDArray[np.float32]) -> Array:
        """Share of the halo (m,) that the fine remainder holds: encircled energy less the smooth inner part's."""
        row, weight = self._table.row_of(received.scattering_depth[index])
        encircled = self._encircled[row] * (1.0 - weight) + self._encircled[row + 1] * weight
        t2 = self._split_rad**2
        return encircled - math.pi * t2 * (smooth[:, 0] + 0.5 * smooth[:, 1] * t2)


def add_spot(image: NDArray[np.float32], pixel: Array, sigma_px: float, energy: NDArray[np.float32]) -> None:
    """Add a Gaussian spot of total `energy` (3,), integrated over each pixel, at a sub-pixel position (2,)."""
    reach = math.ceil(4.5 * sigma_px) + 1
    x, y = float(pixel[0]), float(pixel[1])
    column, row = round(x), round(y)
    if column + reach < 0 or row + reach < 0 or column - reach >= image.shape[1] or row - reach >= image.shape[0]:
        return
    edges = np.arange(-reach, reach + 2) - 0.5
    scale = 1.0 / (sigma_px * _ROOT_2)
    across = np.diff(erf((edges + (column - x)) * scale)) * 0.5
    down = np.diff(erf((edges + (row - y)) * scale)) * 0.5
    _add_patch(image, np.outer(down, across).astype(np.float32), column - reach, row - reach, energy)


def _add_patch(
    image: NDArray[np.float32], patch: NDArray[np.float32], left: int, top: int, colour: NDArray[np.float32]
) -> None:
    height, width = image.shape[:2]
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + patch.shape[1], width), min(top + patch.shape[0], height)
    if x0 >= x1 or y0 >= y1:
        return
    image[y0:y1, x0:x1] += coloured(patch[y0 - top : y1 - top, x0 - left : x1 - left], colour)


def coloured(light: NDArray[np.float32], colour: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w, 3) light (h, w) times a colour (3,), plane by plane: NumPy is slow over a last axis of three."""
    return np.asarray(cv2.merge([light * part for part in colour]), dtype=np.float32)
