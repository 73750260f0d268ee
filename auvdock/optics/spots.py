"""A light as a spot on the sensor: its radial profile in electrons, and how much of the image it saturates."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.compiled import compiled
from auvdock.optics.halo import halo_table
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet, Received
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import WaterCfg

__all__ = ["FlashLines", "Meeting", "SpotModel", "Spots", "squared_distances"]

_RADII = 32
_LEAST_EXPONENT = -60.0
"""Of a Gaussian; what is left there is below the rounding of any halo."""


class FlashLines(NamedTuple):
    """A rotating beacon's spot, lamp and beam together, about its brightest point.

    Attributes:
        place: index among the lights in view.
        middle_px: distance of that point from the lamp, along the beam's image.
        way: (2,) unit direction of the beam's image on the sensor.
        lines: (3, k) irradiance per pixel at `SpotModel.radii_px` from that point: ahead, back and across, W/m².
    """

    place: int
    middle_px: float
    way: Array
    lines: Array


class Spots:
    """Radial profiles of the lights in view, in electrons per second and pixel.

    Attributes:
        core: (m,) core irradiance, W/m².
        halo: (m,) halo irradiance, W/m².
        sigma_px: (m,) width of the core on the sensor.
        profile: (m, k) irradiance per pixel at `SpotModel.radii_px`, W/m² per pixel.
        channel: (m, 3) electrons per second for 1 W/m² on a pixel: red, green, blue.
        flash: the rotating beacon among them, None if there is none in view.
    """

    __slots__ = ("channel", "core", "flash", "halo", "profile", "sigma_px")

    def __init__(self, core: Array, halo: Array, sigma_px: Array, profile: Array, channel: Array) -> None:
        """Hold the arrays."""
        self.core, self.halo, self.sigma_px, self.profile, self.channel = core, halo, sigma_px, profile, channel
        self.flash: FlashLines | None = None


class SpotModel:
    """Spreads core and halo over the sensor, radially symmetric about each light.

    The core is a Gaussian: the lens' point spread function widened by the lamp's face, σ² = σ_lens² + (R / (2 r) f)²
    (a uniform disc of radius R has variance R²/4 per axis).
    """

    def __init__(self, lens: Lens, lights: LightSet, water: WaterCfg, cfg: ImagingCfg) -> None:
        """Tabulate the halo at fixed radii."""
        self.radii_px = np.geomspace(0.35, 0.45 * lens.camera.width_px, _RADII)
        edges = np.concatenate([[0.0], np.sqrt(self.radii_px[1:] * self.radii_px[:-1]), self.radii_px[-1:]])
        self.ring_px2 = math.pi * np.diff(edges**2)
        self._minus_half_r2 = -0.5 * self.radii_px**2
        self._spacing = np.array([self.radii_px[0] ** 2, 0.5 / math.log(self.radii_px[1] / self.radii_px[0])])
        table = halo_table(water.scattering_angle_rad)
        self._table = table
        self._rows = table.density_rows(self.radii_px * lens.rad_per_px) * lens.rad_per_px**2
        # Of the core: variance by the lens, and by the lamp's face at 1 m.
        self._widths = np.array([cfg.lens_sigma_px**2, (cfg.lamp_radius_m / 2.0 / lens.rad_per_px) ** 2])
        self._channel = lights.electrons_per_j * lens.aperture_m2
        self._samples = lens.camera.width_px * lens.camera.height_px * 3

    def sigma_px(self, range_m: Array) -> Array:
        """(n,) standard deviation of the core on the sensor."""
        return np.sqrt(self._widths[0] + self._widths[1] / (range_m * range_m))

    def spots(self, received: Received, index: IntArray) -> Spots:
        """Profiles of the lights `index` (m,)."""
        row, weight = self._table.row_of(received.scattering_depth[index])
        core, halo, sigma, profile, channel = _profiles(
            index,
            received.core_w_m2,
            received.halo_w_m2,
            received.range_m,
            row,
            weight,
            self._rows,
            self._minus_half_r2,
            self._widths,
            self._channel,
        )
        return Spots(core, halo, sigma, profile, channel)

    def saturated_area_px2(self, spots: Spots, level_e_s: float) -> Array:
        """(m, 3) area of each spot above a level in electrons per second, per channel; overlap is not counted."""
        return _areas(spots.profile, spots.channel, 2.5 / level_e_s, self.ring_px2)

    def share(self, area_px2: Array) -> float:
        """Share of the image's samples that areas (m, 3) are."""
        return float(np.add.reduce(area_px2, axis=None)) / self._samples

    def at_distance(self, spots: Spots, distance2_px2: Array) -> Array:
        """(m, m) irradiance per pixel at squared distances (m, m) from the lights along the second axis.

        Taken at the nearest tabulated radius; the radii are 22 % apart.
        """
        return _at_distance(spots.profile, distance2_px2, self._spacing)

    def meet(self, spots: Spots, pixels: Array, exposure_s: float, saturated_e: float) -> Meeting:
        """The lights at pixels (m, 2) among each other: at each one's centre its own light and that of the others.

        Args:
            spots: the lights' profiles.
            pixels: their places on the sensor.
            exposure_s: exposure time.
            saturated_e: electrons at which a sample is saturated.
        """
        place, own, around, radius, area, distance2 = _met(
            spots.profile,
            spots.channel,
            pixels,
            self.ring_px2,
            self._spacing,
            exposure_s,
            2.5 * exposure_s / saturated_e,
        )
        return Meeting(place, own, around, radius, area / self._samples, distance2)


class Meeting(NamedTuple):
    """Lights on the sensor as they are seen beside each other.

    Attributes:
        channel: (m,) in which each is brightest: 0 red, 1 green, 2 blue.
        own_e: (m,) electrons of its own light at its centre, in that channel.
        around_e: (m,) electrons of all others' light there.
        radius_px: (m,) radius of the disc that it saturates.
        share: share of the image's samples that are saturated; overlap is not counted.
        distance2_px2: (m, m) squared distances between them.
    """

    channel: IntArray
    own_e: Array
    around_e: Array
    radius_px: Array
    share: float
    distance2_px2: Array


@compiled
def _profiles(
    index: IntArray,
    core: Array,
    halo: Array,
    range_m: Array,
    row: IntArray,
    weight: Array,
    rows: Array,
    minus_half_r2: Array,
    widths: Array,
    channel: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Core, halo and widths (m,), profiles (m, k) and channels (m, 3) of the lights `index` (m,) of n."""
    count = len(index)
    cores, halos, sigma, channels = np.empty(count), np.empty(count), np.empty(count), np.empty((count, 3))
    profile = np.empty((count, len(minus_half_r2)))
    for i in range(count):
        light = index[i]
        cores[i], halos[i] = core[light], halo[light]
        for c in range(3):
            channels[i, c] = channel[light, c]
        sigma2 = widths[0] + widths[1] / (range_m[light] * range_m[light])
        sigma[i] = math.sqrt(sigma2)
        peak = core[light] / (2.0 * math.pi * sigma2)
        below, above = rows[row[i]], rows[row[i] + 1]
        for k in range(len(minus_half_r2)):
            profile[i, k] = (below[k] + weight[i] * (above[k] - below[k])) * halo[light]
            exponent = minus_half_r2[k] / sigma2
            if exponent > _LEAST_EXPONENT:
                profile[i, k] += peak * math.exp(exponent)
    return cores, halos, sigma, profile, channels


@compiled
def _areas(profile: Array, channel: Array, scale: float, ring_px2: Array) -> Array:
    """`SpotModel.saturated_area_px2`: of each ring the part between 0 and 1 by which it is above the level."""
    area = np.zeros((len(profile), 3))
    for i in range(len(profile)):
        for c in range(3):
            per_w = channel[i, c] * scale
            for k in range(len(ring_px2)):
                area[i, c] += min(max(profile[i, k] * per_w - 2.0, 0.0), 1.0) * ring_px2[k]
    return area


@compiled
def _at_distance(profile: Array, distance2_px2: Array, spacing: Array) -> Array:
    """`SpotModel.at_distance`."""
    value = np.empty((len(distance2_px2), len(profile)))
    first2, per_log2 = spacing[0], spacing[1]
    last = profile.shape[1] - 1
    for i in range(len(distance2_px2)):
        for j in range(len(profile)):
            place = math.log(max(distance2_px2[i, j], first2) / first2) * per_log2
            value[i, j] = profile[j, min(int(place + 0.5), last)]
    return value


@compiled
def squared_distances(pixels: Array) -> Array:
    """(m, m) squared distances between points (m, 2)."""
    distance2 = np.empty((len(pixels), len(pixels)))
    for i in range(len(pixels)):
        for j in range(len(pixels)):
            x, y = pixels[i, 0] - pixels[j, 0], pixels[i, 1] - pixels[j, 1]
            distance2[i, j] = x * x + y * y
    return distance2


@compiled
def _met(
    profile: Array, channel: Array, pixels: Array, ring_px2: Array, spacing: Array, exposure_s: float, scale: float
) -> tuple[IntArray, Array, Array, Array, float, Array]:
    """`SpotModel.meet`, with the total saturated area in px² in place of the share."""
    count = len(profile)
    place, own, around = np.empty(count, dtype=np.int64), np.empty(count), np.empty(count)
    radius, distance2 = np.empty(count), squared_distances(pixels)
    areas, level = _areas(profile, channel, scale, ring_px2), _at_distance(profile, distance2, spacing)
    total = 0.0
    for i in range(count):
        best = 0
        for c in range(1, 3):
            if channel[i, c] * exposure_s > channel[i, best] * exposure_s:
                best = c
        place[i] = best
        around[i] = 0.0
        for j in range(count):
            around[i] += level[i, j] * (channel[j, best] * exposure_s)
        own[i] = level[i, i] * (channel[i, best] * exposure_s)
        around[i] -= own[i]
        greatest = 0.0
        for c in range(3):
            total += areas[i, c]
            greatest = max(greatest, areas[i, c])
        radius[i] = math.sqrt(greatest / math.pi)
    return place, own, around, radius, total, distance2
