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

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.optics.halo import halo_table
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet, Received
from auvdock.optics.spots import SpotModel
from auvdock.optics.water import WaterCfg

__all__ = ["LightsImage", "add_spot"]

_ENTRIES = 4096
_SPLIT_COARSE_PX = 6
_ROOT_2 = math.sqrt(2.0)
_LEAST_E = 2e-3
"""Electrons in a pixel below which a lamp's halo is not worth drawing: of a hundred such nothing is seen."""


class LightsImage:
    """Cores and halos of a set of lamps on one camera's sensor."""

    def __init__(self, lens: Lens, lights: LightSet, water: WaterCfg, spots: SpotModel) -> None:
        """Tabulate the halo on the shared index."""
        self._lens, self._spots = lens, spots
        self._scale = np.float32((_ENTRIES - 1) / _ROOT_2)
        index = np.arange(_ENTRIES) / float(self._scale)
        angle = np.maximum(2.0 * np.arcsin(np.minimum(index**2 / 2.0, 1.0)), 1e-7)
        table = halo_table(water.scattering_angle_rad)
        self._table = table
        self._rows = table.density_rows(angle).astype(np.float32)
        split_px = _SPLIT_COARSE_PX * lens.factor
        self._split_px = split_px
        self.reach_px = float(split_px)
        self._split_rad = split_px * lens.rad_per_px
        inner = np.array([self._split_rad, 0.97 * self._split_rad, 1.03 * self._split_rad])
        self._inner_rows = table.density_rows(inner)
        self._encircled = table.encircled_rows(inner[:1])[:, 0]
        last = int(math.sqrt(2.0 * math.sin(self._split_rad / 2.0)) * float(self._scale))
        self._inner_angle2 = (angle[: last + 1] ** 2).astype(np.float32)
        self._rays = np.ascontiguousarray(lens.rays.T, dtype=np.float32)
        self._coarse_solid_angle = lens.solid_angle_sr.ravel().astype(np.float32)
        self._channel = lights.electrons_per_j * lens.aperture_m2
        self._most_channel = self._channel.max(axis=1)
        self._colours, self._colour_of = np.unique(self._channel, axis=0, return_inverse=True)

    def coarse(self, received: Received, index: IntArray, exposure_s: float) -> NDArray[np.float32]:
        """Smooth parts of the halos of lamps `index` (m,): electrons per image pixel on the coarse grid, (h, w, 3)."""
        shape = self._lens.shape
        if len(index) == 0:
            return np.zeros((*shape, 3), dtype=np.float32)
        row, weight, smooth = self._halos(received, index)
        light = received.halo_w_m2[index]
        per_e = self._most_channel[index] * exposure_s * self._lens.rad_per_px**2
        shown = np.flatnonzero(light * smooth[:, 0] * per_e > _LEAST_E)
        radiance = np.zeros((len(self._colours), self._rays.shape[1]), dtype=np.float32)
        _add_smooth(
            radiance,
            self._colour_of[index[shown]],
            self._rays,
            received.ray_camera[index[shown]].astype(np.float32),
            self._rows,
            row[shown],
            weight[shown],
            smooth[shown],
            self._inner_angle2,
            self._scale,
            light[shown].astype(np.float32),
        )
        radiance *= self._coarse_solid_angle
        planes = (self._colours.T * exposure_s).astype(np.float32) @ radiance
        return np.asarray(cv2.merge(list(planes.reshape(3, *shape))), dtype=np.float32)

    def add_fine(
        self, image: NDArray[np.float32], received: Received, pixels: Array, index: IntArray, exposure_s: float
    ) -> None:
        """Add the halos' fine remainders and the cores of lamps `index` (m,) at their pixels to `image` (H, W, 3)."""
        if len(index) == 0:
            return
        row, weight, smooth = self._halos(received, index)
        sigma = self._spots.sigma_px(received.range_m[index])
        centre = np.rint(pixels[index])
        metric = self._lens.metric_at(centre)
        # The core's blur also softens the cusp of the halo.
        soft = 1.5 * sigma**2 * self._lens.rad_per_px**2
        encircled = self._encircled[row] * (1.0 - weight) + self._encircled[row + 1] * weight
        t2 = self._split_rad**2
        inside = encircled - math.pi * t2 * (smooth[:, 0] + 0.5 * smooth[:, 1] * t2)
        colour = self._channel[index] * exposure_s
        halo = (colour * (received.halo_w_m2[index] * inside)[:, None]).astype(np.float32)
        core = (colour * received.core_w_m2[index, None]).astype(np.float32)
        _add_lights(
            image,
            pixels[index],
            self._split_px,
            metric,
            soft,
            self._rows,
            row,
            weight,
            smooth,
            self._inner_angle2,
            self._scale,
            sigma,
            halo,
            core,
        )

    def _halos(self, received: Received, index: IntArray) -> tuple[IntArray, NDArray[np.float32], NDArray[np.float32]]:
        """Row and weight (m,) of the lamps' halos in the table, and the smooth inner parts' A, B of A + B θ² (m, 2)."""
        row, weight = self._table.row_of(received.scattering_depth[index])
        ends = self._inner_rows[row] * (1.0 - weight[:, None]) + self._inner_rows[row + 1] * weight[:, None]
        slope = (ends[:, 2] - ends[:, 1]) / (0.06 * self._split_rad)
        curve = slope / (2.0 * self._split_rad)
        level = ends[:, 0] - curve * self._split_rad**2
        return row, weight.astype(np.float32), np.column_stack([level, curve]).astype(np.float32)


def add_spot(image: NDArray[np.float32], pixel: Array, sigma_px: float, energy: NDArray[np.float32]) -> None:
    """Add a Gaussian spot of total `energy` (3,), integrated over each pixel, at a sub-pixel position (2,)."""
    _add_gaussian(image, float(pixel[0]), float(pixel[1]), sigma_px, energy)


@compiled
def _add_smooth(
    radiance: NDArray[np.float32],
    colour_of: IntArray,
    grid: NDArray[np.float32],
    rays: NDArray[np.float32],
    rows: NDArray[np.float32],
    row: IntArray,
    weight: NDArray[np.float32],
    smooth: NDArray[np.float32],
    inner_angle2: NDArray[np.float32],
    scale: np.float32,
    light: NDArray[np.float32],
) -> None:
    """Add the smooth parts of halos at `rays` (m, 3) to radiance (colours, n) at a grid (3, n)."""
    inner, count, entries = len(inner_angle2), grid.shape[1], rows.shape[1]
    table = np.empty(entries, dtype=np.float32)
    entry = np.empty(count, dtype=np.int32)
    for lamp in range(len(rays)):
        low, high, share, lamp_light = rows[row[lamp]], rows[row[lamp] + 1], weight[lamp], light[lamp]
        for i in range(entries):
            table[i] = (low[i] + share * (high[i] - low[i])) * lamp_light
        for i in range(inner):
            table[i] = (smooth[lamp, 0] + smooth[lamp, 1] * inner_angle2[i]) * lamp_light
        x, y, z = rays[lamp]
        for i in range(count):
            dx, dy, dz = grid[0, i] - x, grid[1, i] - y, grid[2, i] - z
            entry[i] = np.int32(np.sqrt(np.sqrt(dx * dx + dy * dy + dz * dz)) * scale)
        out = radiance[colour_of[lamp]]
        for i in range(count):
            out[i] += table[np.uint32(entry[i])]


@compiled
def _add_remainder(
    image: NDArray[np.float32],
    x: float,
    y: float,
    reach: int,
    metric: Array,
    soft: float,
    table: NDArray[np.float32],
    scale: np.float32,
    light: NDArray[np.float32],
) -> None:
    """Add a halo's remainder `table` within `reach` pixels of (x, y), scaled to a total of `light` (3,)."""
    beyond, side = len(table) - 1, 2 * reach + 1
    left, top = round(x) - reach, round(y) - reach
    g11, g12, g22 = np.float32(metric[0]), np.float32(2.0 * metric[1]), np.float32(metric[2])
    across = np.empty(side, dtype=np.float32)
    for i in range(side):
        across[i] = left + i - x
    entry = np.empty(side, dtype=np.int32)
    patch = np.empty((side, side), dtype=np.float32)
    total = 0.0
    for j in range(side):
        dy = np.float32(top + j - y)
        along, least = g12 * dy, g22 * dy * dy + np.float32(soft)
        for i in range(side):
            entry[i] = np.int32(np.sqrt(np.sqrt(across[i] * (g11 * across[i] + along) + least)) * scale)
        line = np.float32(0.0)
        for i in range(side):
            value = table[min(np.uint32(entry[i]), beyond)]
            patch[j, i] = value
            line += value
        total += line
    share = light / np.float32(max(total, 1e-30))
    for j in range(max(top, 0), min(top + side, image.shape[0])):
        for i in range(max(left, 0), min(left + side, image.shape[1])):
            value = patch[j - top, i - left]
            image[j, i, 0] += value * share[0]
            image[j, i, 1] += value * share[1]
            image[j, i, 2] += value * share[2]


@compiled
def _add_gaussian(image: NDArray[np.float32], x: float, y: float, sigma_px: float, energy: NDArray[np.float32]) -> None:
    """`add_spot` at (x, y)."""
    reach = math.ceil(4.5 * sigma_px) + 1
    left, top = round(x) - reach, round(y) - reach
    first_x, last_x = max(left, 0), min(left + 2 * reach + 1, image.shape[1])
    first_y, last_y = max(top, 0), min(top + 2 * reach + 1, image.shape[0])
    if first_x >= last_x or first_y >= last_y:
        return
    scale = 1.0 / (sigma_px * _ROOT_2)
    across = np.empty(last_x - first_x, dtype=np.float32)
    below = math.erf((first_x - 0.5 - x) * scale)
    for i in range(len(across)):
        above = math.erf((first_x + i + 0.5 - x) * scale)
        across[i] = 0.5 * (above - below)
        below = above
    below = math.erf((first_y - 0.5 - y) * scale)
    for j in range(first_y, last_y):
        above = math.erf((j + 0.5 - y) * scale)
        down = np.float32(0.5 * (above - below))
        below = above
        for i in range(first_x, last_x):
            value = down * across[i - first_x]
            image[j, i, 0] += value * energy[0]
            image[j, i, 1] += value * energy[1]
            image[j, i, 2] += value * energy[2]


@compiled
def _add_lights(
    image: NDArray[np.float32],
    pixels: Array,
    reach: int,
    metric: Array,
    soft: Array,
    rows: NDArray[np.float32],
    row: IntArray,
    weight: NDArray[np.float32],
    smooth: NDArray[np.float32],
    inner_angle2: NDArray[np.float32],
    scale: np.float32,
    sigma: Array,
    halo: NDArray[np.float32],
    core: NDArray[np.float32],
) -> None:
    """Add to an image lamps (m,) at pixels (m, 2): halos above their smooth parts and cores, of colours (m, 3)."""
    table = np.zeros(len(inner_angle2) + 1, dtype=np.float32)
    for k in range(len(pixels)):
        if max(halo[k].max(), core[k].max()) < _LEAST_E:
            continue
        low, high, share = rows[row[k]], rows[row[k] + 1], weight[k]
        for i in range(len(inner_angle2)):
            table[i] = low[i] + share * (high[i] - low[i]) - (smooth[k, 0] + smooth[k, 1] * inner_angle2[i])
        _add_remainder(image, pixels[k, 0], pixels[k, 1], reach, metric[k], soft[k], table, scale, halo[k])
        _add_gaussian(image, pixels[k, 0], pixels[k, 1], sigma[k], core[k])
