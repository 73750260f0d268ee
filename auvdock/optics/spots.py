"""A light as a spot on the sensor: its radial profile in electrons, and how much of the image it saturates."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.optics.halo import halo_table
from auvdock.optics.lens import Lens
from auvdock.optics.light_loop import areas, at_distance, met, spread
from auvdock.optics.radiometry import LightSet, Received
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import WaterCfg

__all__ = ["FlashLines", "Meeting", "SpotModel", "Spots"]

_RADII = 32


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

    Attributes:
        radii_px: (k,) radii at which profiles are tabulated.
        ring_px2: (k,) area of the ring that each stands for.
        spacing: (2,) where among them a distance is, for `light_loop.at_distance`.
        spreading: what `light_loop.spread` takes of halo and lens.
        channel: (n, 3) electrons per second for 1 W/m² of each light on a pixel: red, green, blue.
        samples: number of the image's samples, three per pixel.
    """

    def __init__(self, lens: Lens, lights: LightSet, water: WaterCfg, cfg: ImagingCfg) -> None:
        """Tabulate the halo at fixed radii."""
        self.radii_px = np.geomspace(0.35, 0.45 * lens.camera.width_px, _RADII)
        edges = np.concatenate([[0.0], np.sqrt(self.radii_px[1:] * self.radii_px[:-1]), self.radii_px[-1:]])
        self.ring_px2 = math.pi * np.diff(edges**2)
        self.spacing = np.array([self.radii_px[0] ** 2, 0.5 / math.log(self.radii_px[1] / self.radii_px[0])])
        table = halo_table(water.scattering_angle_rad)
        rows = table.density_rows(self.radii_px * lens.rad_per_px) * lens.rad_per_px**2
        # Of the core: variance by the lens, and by the lamp's face at 1 m.
        self._widths = np.array([cfg.lens_sigma_px**2, (cfg.lamp_radius_m / 2.0 / lens.rad_per_px) ** 2])
        self.spreading = rows, table.places, -0.5 * self.radii_px**2, self._widths
        self.channel = lights.electrons_per_j * lens.aperture_m2
        self.samples = lens.camera.width_px * lens.camera.height_px * 3

    def sigma_px(self, range_m: Array) -> Array:
        """(n,) standard deviation of the core on the sensor."""
        return np.sqrt(self._widths[0] + self._widths[1] / (range_m * range_m))

    def spots(self, received: Received, index: IntArray) -> Spots:
        """Profiles of the lights `index` (m,)."""
        core, halo, sigma, profile, channel = spread(
            index,
            received.range_m,
            received.scattering_depth,
            received.core_w_m2,
            received.halo_w_m2,
            *self.spreading,
            self.channel,
        )
        return Spots(core, halo, sigma, profile, channel)

    def saturated_area_px2(self, spots: Spots, level_e_s: float) -> Array:
        """(m, 3) area of each spot above a level in electrons per second, per channel; overlap is not counted."""
        return areas(spots.profile, spots.channel, level_e_s, self.ring_px2)

    def share(self, area_px2: Array) -> float:
        """Share of the image's samples that areas (m, 3) are."""
        return float(np.add.reduce(area_px2, axis=None)) / self.samples

    def at_distance(self, spots: Spots, distance2_px2: Array) -> Array:
        """(m, m) irradiance per pixel at squared distances (m, m) from the lights along the second axis.

        Taken at the nearest tabulated radius; the radii are 22 % apart.
        """
        return at_distance(spots.profile, distance2_px2, self.spacing)

    def meet(self, spots: Spots, pixels: Array, exposure_s: float, saturated_e: float) -> Meeting:
        """The lights at pixels (m, 2) among each other: at each one's centre its own light and that of the others.

        Args:
            spots: the lights' profiles.
            pixels: their places on the sensor.
            exposure_s: exposure time.
            saturated_e: electrons at which a sample is saturated.
        """
        place, own, around, radius, area, distance2 = met(
            spots.profile, spots.channel, pixels, self.ring_px2, self.spacing, exposure_s, saturated_e
        )
        return Meeting(place, own, around, radius, area / self.samples, distance2)


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
