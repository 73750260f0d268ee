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

__all__ = ["FlashLines", "SpotModel", "Spots"]

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
        self._first2 = float(self.radii_px[0]) ** 2
        self._per_log2 = 0.5 / math.log(self.radii_px[1] / self.radii_px[0])
        table = halo_table(water.scattering_angle_rad)
        self._table = table
        self._rows = table.density_rows(self.radii_px * lens.rad_per_px) * lens.rad_per_px**2
        self._lens_sigma2 = cfg.lens_sigma_px**2
        self._lamp_px_m2 = (cfg.lamp_radius_m / 2.0 / lens.rad_per_px) ** 2
        self._channel = lights.electrons_per_j * lens.aperture_m2
        self._samples = lens.camera.width_px * lens.camera.height_px * 3

    def sigma_px(self, range_m: Array) -> Array:
        """(n,) standard deviation of the core on the sensor."""
        return np.sqrt(self._lens_sigma2 + self._lamp_px_m2 / (range_m * range_m))

    def spots(self, received: Received, index: IntArray) -> Spots:
        """Profiles of the lights `index` (m,)."""
        row, weight = self._table.row_of(received.scattering_depth[index])
        core, halo = received.core_w_m2[index], received.halo_w_m2[index]
        sigma, profile = _profiles(
            core,
            halo,
            received.range_m[index],
            row,
            weight,
            self._rows,
            self._minus_half_r2,
            self._lens_sigma2,
            self._lamp_px_m2,
        )
        return Spots(core, halo, sigma, profile, self._channel.take(index, 0))

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
        return _at_distance(spots.profile, distance2_px2, self._first2, self._per_log2)


@compiled
def _profiles(
    core: Array,
    halo: Array,
    range_m: Array,
    row: IntArray,
    weight: Array,
    rows: Array,
    minus_half_r2: Array,
    lens_sigma2: float,
    lamp_px_m2: float,
) -> tuple[Array, Array]:
    """Widths (m,) and profiles (m, k) of spots."""
    sigma, profile = np.empty(len(core)), np.empty((len(core), len(minus_half_r2)))
    for i in range(len(core)):
        sigma2 = lens_sigma2 + lamp_px_m2 / (range_m[i] * range_m[i])
        sigma[i] = math.sqrt(sigma2)
        peak = core[i] / (2.0 * math.pi * sigma2)
        below, above = rows[row[i]], rows[row[i] + 1]
        for k in range(len(minus_half_r2)):
            profile[i, k] = (below[k] + weight[i] * (above[k] - below[k])) * halo[i]
            exponent = minus_half_r2[k] / sigma2
            if exponent > _LEAST_EXPONENT:
                profile[i, k] += peak * math.exp(exponent)
    return sigma, profile


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
def _at_distance(profile: Array, distance2_px2: Array, first2: float, per_log2: float) -> Array:
    """`SpotModel.at_distance`."""
    value = np.empty((len(distance2_px2), len(profile)))
    last = profile.shape[1] - 1
    for i in range(len(distance2_px2)):
        for j in range(len(profile)):
            place = math.log(max(distance2_px2[i, j], first2) / first2) * per_log2
            value[i, j] = profile[j, min(int(place + 0.5), last)]
    return value
