"""Marine snow: flakes drifting in the water before the lens, lit by the station's lamps and by daylight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.lens import Lens
from auvdock.optics.nuisance import SnowLevel
from auvdock.optics.radiometry import Received

__all__ = ["Flakes", "MarineSnow"]

_BOX_M = 3.0
_MOST = 48


@dataclass(frozen=True, eq=False)
class Flakes:
    """The brightest flakes in view.

    Attributes:
        pixels: (k, 2) positions.
        irradiance_w_m2: (k,) light of each at the lens.
        sigma_px: (k,) size on the sensor.
    """

    pixels: Array
    irradiance_w_m2: Array
    sigma_px: Array


class MarineSnow:
    """Flakes at rest in the world, repeated in boxes of 3 m, so that they pass by as the camera moves.

    A flake of cross section A at distance z, under irradiance E, sends E A p(Θ) e^{-c z} / z² into the lens. The phase
    function p = 0.5 (1 + 20 e^{-(Θ / 0.3)²}) / 4π, half absorbing with a forward lobe, is ours.
    """

    def __init__(self, level: SnowLevel, lens: Lens, attenuation_per_m: float) -> None:
        """Keep the level; flakes come with `reset`."""
        self._level, self._lens, self._attenuation = level, lens, attenuation_per_m
        self._places = np.zeros((0, 3))
        self._areas = np.zeros(0)

    def reset(self, rng: np.random.Generator) -> None:
        """Scatter the flakes anew."""
        count = round(self._level.flakes_per_m3 * _BOX_M**3)
        self._places = rng.uniform(0.0, _BOX_M, (count, 3))
        diameter = self._level.diameter_m * rng.lognormal(0.0, 0.4, count)
        self._areas = math.pi / 4.0 * diameter**2

    def flakes(self, T_world_camera: Array, received: Received, daylight_w_m2: float) -> Flakes | None:
        """The brightest flakes that a camera (4, 4) sees, None if there is none."""
        if len(self._places) == 0:
            return None
        relative = self._places - T_world_camera[:3, 3]
        relative -= np.round(relative / _BOX_M) * _BOX_M
        inside_camera = relative @ T_world_camera[:3, :3]
        ahead = inside_camera[:, 2] > 0.15
        inside_camera = inside_camera[ahead]
        z = np.linalg.norm(inside_camera, axis=1)
        rays = inside_camera / z[:, None]
        pixels, visible = self._lens.locate(rays, 4.0)
        if not visible.any():
            return None
        pixels, z, rays, area = pixels[visible], z[visible], rays[visible], self._areas[ahead][visible]
        lit = received.core_w_m2 + received.halo_w_m2
        mean_ray = lit @ received.ray_camera
        length = float(np.linalg.norm(mean_ray))
        angle = np.arccos(np.clip(rays @ mean_ray / length, -1.0, 1.0)) if length > 0.0 else np.full(len(rays), math.pi)
        phase = 0.5 / (4.0 * math.pi) * (1.0 + 20.0 * np.exp(-((angle / 0.3) ** 2)))
        source = float(lit.sum()) * phase + daylight_w_m2 * 0.25 / math.pi
        irradiance = source * area * np.exp(-self._attenuation * z) / (z * z)
        best = np.argsort(irradiance)[::-1][:_MOST]
        width_px = np.sqrt(area[best] / math.pi) / z[best] / self._lens.rad_per_px
        return Flakes(pixels[best], irradiance[best], 0.5 * width_px)
