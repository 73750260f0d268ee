"""How many of the array's lights the threshold detector finds from a place."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.optics.detection_model import DetectionModelCfg
from auvdock.perception.threshold import ThresholdCfg
from auvdock.planning.separation import separate
from auvdock.planning.sight import Sight

__all__ = ["Detectability", "Sighting"]

_CHUNK = 500
_SMOOTHED = 0.386
"""Standard deviation of white noise after the detector's 3 × 3 smoothing."""
_LEAST_NOISE_DN = 0.5
_CENTRE_FLOOR_PX = 0.05
"""Least standard deviation of a centre: fitted models of bright lights go down to 0."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """What is found of k array lights from m places.

    Attributes:
        found: (m, k) lights that the detector finds, each as a light of its own.
        contrast_dn: (m, k) codes above the background.
        pixels: (m, k, 2) positions on the sensor.
        sigma_px: (m, k) standard deviation of a found light's centre, per axis.
        sensitivity_s: (m,) exposure time × gain.
    """

    found: BoolArray
    contrast_dn: Array
    pixels: Array
    sigma_px: Array
    sensitivity_s: Array

    @property
    def count(self) -> IntArray:
        """(m,) lights found."""
        return np.count_nonzero(self.found, axis=1)


class Detectability:
    """Applies the detector's own thresholds where the camera's exposure has settled.

    A light is found if it falls on the sensor, stands above the background by the detector's threshold (a number of σ
    of the sensor's noise, and a least contrast), and at some level of its cuts hangs together with no brighter light.
    """

    def __init__(self, sight: Sight, model: DetectionModelCfg, threshold: ThresholdCfg | None = None) -> None:
        """Keep what is needed.

        Args:
            sight: the camera in the water.
            model: the detector's fitted behaviour: how precisely it finds a light's centre.
            threshold: the detector's thresholds.
        """
        self.sight, self.model, self.threshold = sight, model, threshold or ThresholdCfg()
        array = sight.array.tolist()
        # The array first; others of its colour can swallow its lights.
        self._rivals = np.array([*array, *(index for index in sight.blue.tolist() if index not in array)])

    def sighting(self, points_m: Array) -> Sighting:
        """From camera places (m, 3) in the station frame."""
        starts = range(0, max(len(points_m), 1), _CHUNK)
        parts = [self._chunk(points_m[start : start + _CHUNK]) for start in starts]
        return Sighting(
            np.concatenate([part.found for part in parts]),
            np.concatenate([part.contrast_dn for part in parts]),
            np.concatenate([part.pixels for part in parts]),
            np.concatenate([part.sigma_px for part in parts]),
            np.concatenate([part.sensitivity_s for part in parts]),
        )

    def seen(self, points_m: Array, needed: int = 4) -> BoolArray:
        """(m,) places (m, 3) from which at least `needed` array lights are found."""
        return self.sighting(points_m).count >= needed

    def _chunk(self, points_m: Array) -> Sighting:
        sight, k = self.sight, len(self.sight.array)
        exposure_cfg = sight.imaging.exposure
        arrivals, shape = sight.look(points_m), (len(points_m), sight.lights.count)
        pixels, inside = arrivals["pixel"].reshape(*shape, 2), arrivals["inside"].reshape(shape)
        profile = sight.profiles(arrivals)
        sensitivity = sight.sensitivity_s(profile, pixels)
        exposure = np.minimum(sensitivity, exposure_cfg.max_s if exposure_cfg.automatic else math.inf)
        gain = np.maximum(sensitivity / exposure, 1.0)
        rivals = self._rivals
        noise = np.maximum(_LEAST_NOISE_DN, _SMOOTHED * sight.noise_dn(gain))
        found, contrast = separate(
            lambda places: sight.codes(profile, pixels, exposure, gain, places),
            pixels[:, rivals],
            inside[:, rivals],
            noise,
            self.threshold,
        )
        width = sight.spots.sigma_px(arrivals["range_m"].reshape(shape)[:, sight.array])
        contrast = contrast[:, :k]
        spread = self.model.centre_at_100 * width * (100.0 / np.maximum(contrast, 1.0)) ** 2
        sigma = np.sqrt(self.model.centre_floor_px**2 + spread**2 + _CENTRE_FLOOR_PX**2)
        return Sighting(found[:, :k], contrast, pixels[:, sight.array], sigma, sensitivity)
