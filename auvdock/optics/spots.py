"""A light as a spot on the sensor: its radial profile in electrons, and how much of the image it saturates."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray, constant
from auvdock.optics.halo import halo_table
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet, Received
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import WaterCfg

__all__ = ["FlashLines", "SpotModel", "Spots"]

_RADII = 32
_TWO_PI = constant(2.0 * math.pi)
_ZERO, _HALF, _ONE, _TWO = constant(0.0), constant(0.5), constant(1.0), constant(2.0)
_LAST = np.array(_RADII - 1)


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
        first2 = float(self.radii_px[0]) ** 2
        self._first2, self._log_first2 = constant(first2), constant(math.log(first2))
        self._per_log2 = constant(0.5 / math.log(self.radii_px[1] / self.radii_px[0]))
        self._starts = np.arange(0, lights.count * _RADII, _RADII)
        table = halo_table(water.scattering_angle_rad)
        self._table = table
        self._rows = table.density_rows(self.radii_px * lens.rad_per_px) * lens.rad_per_px**2
        self._rises = np.diff(self._rows, axis=0)
        self._lens_sigma2 = constant(cfg.lens_sigma_px**2)
        self._lamp_px_m2 = constant((cfg.lamp_radius_m / 2.0 / lens.rad_per_px) ** 2)
        self._channel = lights.electrons_per_j * lens.aperture_m2
        self._samples = lens.camera.width_px * lens.camera.height_px * 3

    def sigma_px(self, range_m: Array) -> Array:
        """(n,) standard deviation of the core on the sensor."""
        return np.sqrt(self._lens_sigma2 + self._lamp_px_m2 / (range_m * range_m))

    def spots(self, received: Received, index: IntArray) -> Spots:
        """Profiles of the lights `index` (m,)."""
        core, halo, range_m = received.core_w_m2[index], received.halo_w_m2[index], received.range_m[index]
        sigma2 = self._lamp_px_m2 / (range_m * range_m)
        sigma2 += self._lens_sigma2
        row, weight = self._table.row_of(received.scattering_depth[index])
        profile = self._rises.take(row, 0)
        profile *= weight[:, None]
        profile += self._rows.take(row, 0)
        profile *= halo[:, None]
        gauss = self._minus_half_r2 / sigma2[:, None]
        np.exp(gauss, out=gauss)
        gauss *= (core / (_TWO_PI * sigma2))[:, None]
        profile += gauss
        return Spots(core, halo, np.sqrt(sigma2), profile, self._channel.take(index, 0))

    def saturated_area_px2(self, spots: Spots, level_e_s: float) -> Array:
        """(m, 3) area of each spot above a level in electrons per second, per channel; overlap is not counted."""
        level = spots.profile[:, None, :] * (spots.channel * (2.5 / level_e_s))[:, :, None]
        level -= _TWO
        np.maximum(level, _ZERO, out=level)
        np.minimum(level, _ONE, out=level)
        return level @ self.ring_px2

    def share(self, area_px2: Array) -> float:
        """Share of the image's samples that areas (m, 3) are."""
        return float(np.add.reduce(area_px2, axis=None)) / self._samples

    def at_distance(self, spots: Spots, distance2_px2: Array) -> Array:
        """(m, m) irradiance per pixel at squared distances (m, m) from the lights along the second axis.

        Taken at the nearest tabulated radius; the radii are 22 % apart.
        """
        place = np.log(np.maximum(distance2_px2, self._first2))
        place -= self._log_first2
        place *= self._per_log2
        place += _HALF
        index = place.astype(np.int64)
        np.minimum(index, _LAST, out=index)
        index += self._starts[: len(index)]
        return spots.profile.take(index)
