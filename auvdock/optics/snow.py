"""Marine snow: flakes drifting in the water before the lens, lit by the station's lamps and by daylight."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.lens import Lens
from auvdock.optics.nuisance import SnowLevel
from auvdock.optics.view import Flakes, Moment, View

__all__ = ["MarineSnow"]

_BOX_M = 3.0
_MOST = 48


class MarineSnow:
    """Flakes at rest in the world, repeated in boxes of 3 m, so that they pass by as the camera moves.

    A flake of cross section A at distance z, under irradiance E, sends E A p(Θ) e^{-c z} / z² into the lens. The phase
    function p = 0.5 (1 + 20 e^{-(Θ / 0.3)²}) / 4π, half absorbing with a forward lobe, is ours.
    """

    def __init__(
        self, level: SnowLevel, lens: Lens, attenuation_per_m: float, daylight: Callable[[float], Array]
    ) -> None:
        """Keep what lights the flakes; they come with `reset`.

        Args:
            level: how many, and how large.
            lens: the camera's geometry.
            attenuation_per_m: c of the water.
            daylight: (3,) irradiance per band at a depth in m.
        """
        self._level, self._lens, self._attenuation, self._daylight = level, lens, attenuation_per_m, daylight
        self.places_m: Array = np.zeros((0, 3))
        """(n, 3) the flakes within a box."""
        self._areas = np.zeros(0)

    def reset(self, rng: np.random.Generator) -> None:
        """Scatter the flakes anew."""
        count = round(self._level.flakes_per_m3 * _BOX_M**3)
        self.places_m = rng.uniform(0.0, _BOX_M, (count, 3))
        diameter = self._level.diameter_m * rng.lognormal(0.0, 0.4, count)
        self._areas = math.pi / 4.0 * diameter**2

    def drift(self, view: View, moment: Moment) -> View:
        """A step: the brightest flakes that the camera sees, if there is one."""
        relative = self.places_m - view.T_world_camera[:3, 3]
        relative -= np.round(relative / _BOX_M) * _BOX_M
        inside_camera = relative @ view.T_world_camera[:3, :3]
        ahead = inside_camera[:, 2] > 0.15
        inside_camera = inside_camera[ahead]
        z = np.linalg.norm(inside_camera, axis=1)
        rays = inside_camera / z[:, None]
        pixels, visible = self._lens.locate(rays, 4.0)
        if not visible.any():
            return view
        pixels, z, rays, area = pixels[visible], z[visible], rays[visible], self._areas[ahead][visible]
        arrivals = view.arrivals
        lit = arrivals["core_w_m2"] + arrivals["halo_w_m2"]
        mean_ray = lit @ arrivals["ray_camera"].copy()
        length = float(np.linalg.norm(mean_ray))
        angle = np.arccos(np.clip(rays @ mean_ray / length, -1.0, 1.0)) if length > 0.0 else np.full(len(rays), math.pi)
        phase = 0.5 / (4.0 * math.pi) * (1.0 + 20.0 * np.exp(-((angle / 0.3) ** 2)))
        source = float(lit.sum()) * phase + float(self._daylight(view.depth_m)[0]) * 0.25 / math.pi
        irradiance = source * area * np.exp(-self._attenuation * z) / (z * z)
        best = np.argsort(irradiance)[::-1][:_MOST]
        width_px = np.sqrt(area[best] / math.pi) / z[best] / self._lens.rad_per_px
        return view._replace(flakes=Flakes(pixels[best], irradiance[best], 0.5 * width_px))
