"""Draws cores and halos into a buffer of electrons.

A halo is split at a fixed angle into a part that is smooth everywhere and a fine remainder about its centre. The smooth
parts of all lamps are evaluated together on the coarse grid of `Lens` through one radial table, and enlarged; the
remainder, blurred as `SpotModel` has it, is added in full resolution on a small patch and scaled so that the patch
holds exactly the light that the table says. Table and patch share one index, the fourth root of the squared chord: fine
near the centre, wide outside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.optics.arrival import Arrival
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet
from auvdock.optics.spots import SpotModel
from auvdock.optics.spread import RADII

__all__ = ["LightsImage", "add_spot"]

_ENTRIES = 4096
_SPLIT_COARSE_PX = 6
_ROOT_2 = math.sqrt(2.0)
_LEAST_E = 2e-3
"""Electrons in a pixel below which a lamp's halo is not worth drawing: of a hundred such nothing is seen."""


class _Table(NamedTuple):
    """Halos by b r and the angle from the lamp.

    Attributes:
        rows: (h, entries) halo per steradian of unit light.
        inner_angle2: (i,) squared angles of the entries within the split.
        inner_radius: (i,) place of these entries among the radii of `SpotModel`.
        scale: entries per unit of the fourth root of the squared chord.
    """

    rows: NDArray[np.float32]
    inner_angle2: NDArray[np.float32]
    inner_radius: NDArray[np.float32]
    scale: np.float32


@dataclass
class _Halo(Record):
    """Where in the table a lamp's halo is, and its smooth part within the split: A + B θ². Of single precision."""

    row: int
    weight: float
    """Of the row above."""
    level: float
    """A, of unit light per steradian."""
    curve: float
    """B."""


@dataclass
class _Smooth(Record):
    """A lamp whose smooth part is drawn on the coarse grid."""

    halo: _Halo
    ray_camera: Annotated[NDArray[np.float32], 3]
    light_w_m2: float
    """Of single precision."""
    colour: int
    """Which of the different colours of the lamps."""


@dataclass
class _Fine(Record):
    """A lamp whose core and whose halo's remainder are drawn at full resolution."""

    halo: _Halo
    pixel: Annotated[Array, 2]
    metric: Annotated[Array, 3]
    """`Lens.metric` there."""
    sigma_px: float
    """Of the core."""
    inside: float
    """Share of the halo that the remainder holds; below 0 where the halo is flatter than its smooth part."""
    pixel_sr: float
    """Solid angle of a pixel there."""
    halo_e: Annotated[NDArray[np.float32], 3]
    """Electrons of the whole halo."""
    core_e: Annotated[NDArray[np.float32], 3]
    """Electrons of the core."""


class LightsImage:
    """Cores and halos of a set of lamps on one camera's sensor."""

    def __init__(self, lens: Lens, lights: LightSet, spots: SpotModel) -> None:
        """Tabulate the halo on the shared index."""
        self._lens, self._spots = lens, spots
        scale = np.float32((_ENTRIES - 1) / _ROOT_2)
        index = np.arange(_ENTRIES) / float(scale)
        angle = np.maximum(2.0 * np.arcsin(np.minimum(index**2 / 2.0, 1.0)), 1e-7)
        table = lights.halo
        split_px = _SPLIT_COARSE_PX * lens.factor
        self._split_px = split_px
        self.reach_px = float(split_px)
        self._split_rad = split_px * lens.rad_per_px
        inner = np.array([self._split_rad, 0.97 * self._split_rad, 1.03 * self._split_rad])
        self._inner_rows = table.density_rows(inner)
        self._encircled = table.encircled_rows(inner[:1])[:, 0]
        last = int(math.sqrt(2.0 * math.sin(self._split_rad / 2.0)) * float(scale))
        rows, inner_angle = table.density_rows(angle), angle[: last + 1]
        per_radius = math.log(spots.radii_px[1] / spots.radii_px[0])
        place = np.log(inner_angle / lens.rad_per_px / spots.radii_px[0]) / per_radius
        place = np.clip(place, 0.0, RADII - 1.001).astype(np.float32)
        self._table = _Table(rows, (inner_angle**2).astype(np.float32), place, scale)
        self._rays = np.ascontiguousarray(lens.rays.T, dtype=np.float32)
        self._coarse_solid_angle = lens.solid_angle_sr.ravel().astype(np.float32)
        self._channel = lights.column("electrons_per_j") * lens.aperture_m2
        self._most_channel = self._channel.max(axis=1)
        self._colours, self._colour_of = np.unique(self._channel, axis=0, return_inverse=True)

    def coarse(self, arrivals: Records[Arrival], index: IntArray, exposure_s: float) -> NDArray[np.float32]:
        """Smooth parts of the halos of lamps `index` (m,): electrons per image pixel on the coarse grid, (h, w, 3)."""
        shape = self._lens.shape
        if len(index) == 0:
            return np.zeros((*shape, 3), dtype=np.float32)
        halos, light = self._halos(arrivals, index), arrivals["halo_w_m2"][index]
        per_e = self._most_channel[index] * exposure_s * self._lens.rad_per_px**2
        shown = np.flatnonzero(light * halos["level"] * per_e > _LEAST_E)
        lamps = _Smooth.zeros(len(shown))
        lamps["halo"], lamps["light_w_m2"] = halos[shown], light[shown].astype(np.float32)  # type: ignore[index]  # some rows
        lamps["ray_camera"], lamps["colour"] = arrivals["ray_camera"][index[shown]], self._colour_of[index[shown]]
        radiance = np.zeros((len(self._colours), self._rays.shape[1]), dtype=np.float32)
        _add_smooth(radiance, self._rays, lamps, self._table)
        radiance *= self._coarse_solid_angle
        planes = (self._colours.T * exposure_s).astype(np.float32) @ radiance
        return np.asarray(cv2.merge(list(planes.reshape(3, *shape))), dtype=np.float32)

    def add_fine(
        self, image: NDArray[np.float32], arrivals: Records[Arrival], pixels: Array, index: IntArray, exposure_s: float
    ) -> None:
        """Add the halos' fine remainders and the cores of lamps `index` (m,) at their pixels to `image` (H, W, 3)."""
        if len(index) == 0:
            return
        halos, lamps = self._halos(arrivals, index), _Fine.zeros(len(index))
        row, weight = halos["row"], halos["weight"].astype(np.float32)
        sigma = self._spots.sigma_px(arrivals["range_m"][index])
        encircled = self._encircled[row] * (1.0 - weight) + self._encircled[row + 1] * weight
        t2 = self._split_rad**2
        level, curve = halos["level"].astype(np.float32), halos["curve"].astype(np.float32)
        inside = encircled - math.pi * t2 * (level + 0.5 * curve * t2)
        colour = self._channel[index] * exposure_s
        lamps["halo"], lamps["pixel"], lamps["sigma_px"] = halos, pixels[index], sigma
        metric = self._lens.metric_at(np.rint(pixels[index]))
        lamps["metric"], lamps["pixel_sr"] = metric, np.sqrt(metric[:, 0] * metric[:, 2] - metric[:, 1] ** 2)
        lamps["inside"], lamps["halo_e"] = inside, colour * arrivals["halo_w_m2"][index, None]
        lamps["core_e"] = colour * arrivals["core_w_m2"][index, None]
        profiles = self._spots.halo_profiles(arrivals[index]) / self._lens.rad_per_px**2
        _add_lights(image, lamps, profiles.astype(np.float32), self._table, self._split_px)

    def _halos(self, arrivals: Records[Arrival], index: IntArray) -> Records[_Halo]:
        """The halos of lamps `index` (m,)."""
        row, weight = arrivals["halo_row"][index], arrivals["halo_weight"][index]
        ends = self._inner_rows[row] * (1.0 - weight[:, None]) + self._inner_rows[row + 1] * weight[:, None]
        slope = (ends[:, 2] - ends[:, 1]) / (0.06 * self._split_rad)
        curve = slope / (2.0 * self._split_rad)
        halos = _Halo.zeros(len(index))
        halos["row"], halos["weight"] = row, weight.astype(np.float32)
        halos["level"] = (ends[:, 0] - curve * self._split_rad**2).astype(np.float32)
        halos["curve"] = curve.astype(np.float32)
        return halos


def add_spot(image: NDArray[np.float32], pixel: Array, sigma_px: float, energy: NDArray[np.float32]) -> None:
    """Add a Gaussian spot of total `energy` (3,), integrated over each pixel, at a sub-pixel position (2,)."""
    _add_gaussian(image, pixel, sigma_px, energy)


@compiled
def _add_smooth(
    radiance: NDArray[np.float32], grid: NDArray[np.float32], lamps: Records[_Smooth], table: _Table
) -> None:
    """Add the smooth parts of lamps (m,) to radiance (colours, n) at a grid of rays (3, n)."""
    rows, inner_angle2, _, scale = table
    inner, count, entries = len(inner_angle2), grid.shape[1], rows.shape[1]
    density = np.empty(entries, dtype=np.float32)
    entry = np.empty(count, dtype=np.int32)
    for lamp in range(len(lamps)):
        halo, light, ray = lamps[lamp].halo, np.float32(lamps[lamp].light_w_m2), lamps[lamp].ray_camera
        low, high, share = rows[halo.row], rows[halo.row + 1], np.float32(halo.weight)
        level, curve = np.float32(halo.level), np.float32(halo.curve)
        for i in range(entries):
            density[i] = (low[i] + share * (high[i] - low[i])) * light
        for i in range(inner):
            density[i] = (level + curve * inner_angle2[i]) * light
        x, y, z = ray[0], ray[1], ray[2]
        for i in range(count):
            dx, dy, dz = grid[0, i] - x, grid[1, i] - y, grid[2, i] - z
            entry[i] = np.int32(np.sqrt(np.sqrt(dx * dx + dy * dy + dz * dz)) * scale)
        out = radiance[lamps[lamp].colour]
        for i in range(count):
            out[i] += density[np.uint32(entry[i])]


@compiled
def _add_lights(
    image: NDArray[np.float32], lamps: Records[_Fine], profiles: NDArray[np.float32], table: _Table, reach: int
) -> None:
    """Add to an image lamps (m,): halos (m, k) above their smooth parts, within `reach` pixels, and cores."""
    _, inner_angle2, inner_radius, scale = table
    remainder = np.zeros(len(inner_angle2) + 1, dtype=np.float32)
    for k in range(len(lamps)):
        lamp, halo = lamps[k], lamps[k].halo
        if max(lamp.halo_e.max() * abs(lamp.inside), lamp.core_e.max()) < _LEAST_E:
            continue
        level, curve, profile = np.float32(halo.level), np.float32(halo.curve), profiles[k]
        for i in range(len(inner_angle2)):
            place = int(inner_radius[i])
            share = inner_radius[i] - np.float32(place)
            light = profile[place] + share * (profile[place + 1] - profile[place])
            remainder[i] = light - (level + curve * inner_angle2[i])
        _add_remainder(image, lamp, remainder, scale, reach)
        _add_gaussian(image, lamp.pixel, lamp.sigma_px, lamp.core_e)


@compiled
def _add_remainder(
    image: NDArray[np.float32], lamp: _Fine, table: NDArray[np.float32], scale: np.float32, reach: int
) -> None:
    """Add the remainder `table` of a lamp's halo within `reach` pixels, scaled to the electrons that it holds.

    The scale is near 1; it is kept from 0.5 to 2, since the remainder of a halo that is flat has no light to go by.
    """
    x, y, metric = lamp.pixel[0], lamp.pixel[1], lamp.metric
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
        along, least = g12 * dy, g22 * dy * dy
        for i in range(side):
            entry[i] = np.int32(np.sqrt(np.sqrt(across[i] * (g11 * across[i] + along) + least)) * scale)
        line = np.float32(0.0)
        for i in range(side):
            value = table[min(np.uint32(entry[i]), beyond)]
            patch[j, i] = value
            line += value
        total += line
    drawn = total * lamp.pixel_sr
    near_1 = min(max(lamp.inside / drawn, 0.5), 2.0) if drawn != 0.0 else 1.0
    share = lamp.halo_e * np.float32(lamp.pixel_sr * near_1)
    for j in range(max(top, 0), min(top + side, image.shape[0])):
        for i in range(max(left, 0), min(left + side, image.shape[1])):
            value = patch[j - top, i - left]
            image[j, i, 0] += value * share[0]
            image[j, i, 1] += value * share[1]
            image[j, i, 2] += value * share[2]


@compiled
def _add_gaussian(image: NDArray[np.float32], pixel: Array, sigma_px: float, energy: NDArray[np.float32]) -> None:
    """`add_spot`."""
    x, y = pixel[0], pixel[1]
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
