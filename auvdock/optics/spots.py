"""A light as a spot on the sensor: its radial profile in electrons, and how much of the image it saturates."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.numeric.records import Records
from auvdock.optics.arrival import Arrival
from auvdock.optics.blur import blurred_halo
from auvdock.optics.lens import Lens
from auvdock.optics.meeting import Candidate, level_at, meet, saturate
from auvdock.optics.radiometry import LightSet
from auvdock.optics.sensor import SensorScale
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.spread import BLURS, RADII, Spot, SpreadLaw, halo_profiles, profiles, spread

__all__ = ["FlashLines", "SpotModel", "Spots"]


_NEAR_M = 0.3
"""Nearer than this a lamp's halo is blurred no more."""


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


class Spots(NamedTuple):
    """Radial profiles of the lights in view.

    Attributes:
        rows: (m,) the lights.
        profile: (m, k) irradiance per pixel at `SpotModel.radii_px`, W/m² per pixel.
        flash: the rotating beacon among them, None if there is none in view.
    """

    rows: Records[Spot]
    profile: Array
    flash: FlashLines | None = None


class SpotModel:
    """Spreads core and halo over the sensor, radially symmetric about each light.

    The core is a Gaussian: the lens' point spread function widened by the lamp's face, σ² = σ_lens² + (R / (2 r) f)²
    (a uniform disc of radius R has variance R²/4 per axis). The halo is blurred as much (`optics.blur`).

    Attributes:
        radii_px: (k,) radii at which profiles are tabulated.
        ring_px2: (k,) areas of the rings that they stand for.
        law: how light spreads, one row.
        samples: number of the image's samples, three per pixel.
    """

    def __init__(self, lens: Lens, lights: LightSet, cfg: ImagingCfg, smoothing_px2: float = 0.0) -> None:
        """Tabulate the halo at fixed radii.

        Args:
            lens: the camera's geometry.
            lights: the lamps in their water.
            cfg: the camera as an instrument.
            smoothing_px2: variance per axis by which a detector smooths on top.
        """
        self.lights = lights
        radii = np.geomspace(0.35, 0.45 * lens.camera.width_px, RADII)
        edges = np.concatenate([[0.0], np.sqrt(radii[1:] * radii[:-1]), radii[-1:]])
        self.radii_px: Array = radii
        self.ring_px2: Array = math.pi * np.diff(edges**2)
        least_px2 = cfg.lens_sigma_px**2 + smoothing_px2
        face_px2_m2 = (cfg.lamp_radius_m / 2.0 / lens.rad_per_px) ** 2
        spans = math.log1p(face_px2_m2 / _NEAR_M**2 / least_px2)
        blurs_px2 = least_px2 * np.exp(np.linspace(0.0, spans, BLURS))
        self._halo = blurred_halo(lights.halo, radii, lens.rad_per_px, blurs_px2)
        self.law: Records[SpreadLaw] = SpreadLaw(
            lens_px2=least_px2,
            face_px2_m2=face_px2_m2,
            aperture_m2=lens.aperture_m2,
            radius_px=radii,
            ring_px2=self.ring_px2,
            per_log_px2=0.5 / math.log(radii[1] / radii[0]),
            blurs_per_log=(BLURS - 1) / spans if spans > 0.0 else 0.0,
        ).packed()
        self._core_px2, self._face_px2_m2 = self.law["lens_px2"].item(), self.law["face_px2_m2"].item()
        self.samples = lens.camera.width_px * lens.camera.height_px * 3

    def sigma_px(self, range_m: Array) -> Array:
        """(n,) standard deviation of the core on the sensor."""
        return np.sqrt(self._core_px2 + self._face_px2_m2 / (range_m * range_m))

    def spread(self, arrivals: Records[Arrival], shown: BoolArray) -> Spots:
        """Of the lights (n,) that arrive those that are shown (n,), as spots."""
        return Spots(*spread(arrivals, shown, self.lights.lamps, self.law, self._halo))

    def profiles(self, arrivals: Records[Arrival]) -> Array:
        """(n, k) profiles of lights (n,), 0 for those that are not on the sensor."""
        return profiles(arrivals, self.law, self._halo)

    def halo_profiles(self, arrivals: Records[Arrival]) -> Array:
        """(n, k) halos of unit light per pixel at `radii_px`, of lights (n,)."""
        return halo_profiles(arrivals, self.law, self._halo)

    def saturated_area_px2(self, spots: Spots, level_e_s: float) -> Array:
        """(m, 3) area of each spot above a level in electrons per second, per channel; overlap is not counted."""
        return saturate(spots.rows, spots.profile, self.law, level_e_s)

    def share(self, area_px2: Array) -> float:
        """Share of the image's samples that areas (m, 3) are."""
        return float(np.add.reduce(area_px2, axis=None)) / self.samples

    def level_at(self, spots: Spots, distance2_px2: Array) -> Array:
        """(m, m) irradiance per pixel at squared distances (m, m) from the lights along the second axis."""
        return level_at(spots.profile, distance2_px2, self.law)

    def meet(
        self, spots: Spots, scale: SensorScale, exposure_s: float, behind_e_s: Array
    ) -> tuple[Records[Candidate], Array, float]:
        """The lights (m,) among each other, before `behind_e_s` (3,) electrons per second and pixel.

        Returns:
            The lights as a detector meets them, squared distances (m, m) between them, and the saturated area, all in
            px, as `meeting.meet`.
        """
        return meet(spots.rows, spots.profile, self.law, scale.law, behind_e_s, exposure_s)
