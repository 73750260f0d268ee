"""What each light sends into the camera: unscattered core and scattered halo, from any pose.

One computation serves the renderer, the `beacons` fidelity and planners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.core.compiled import compiled
from auvdock.optics.bands import electrons_per_joule
from auvdock.optics.light import peak_intensity_w_sr
from auvdock.optics.water import WaterCfg

__all__ = ["LightSet", "Received"]

_NEAREST_M2 = 1e-4


class Received(NamedTuple):
    """Light at the camera, per lamp.

    Attributes:
        ray_camera: (n, 3) unit directions to the lamps in the camera frame.
        range_m: (n,) distances.
        scattering_depth: (n,) b r.
        core_w_m2: (n,) irradiance of the unscattered light, normal to the ray: I f(θ) e^{-(a+b) r} / r².
        halo_w_m2: (n,) irradiance of the forward-scattered light: I f(θ) e^{-a r} (1 - e^{-b r}) / r².
    """

    ray_camera: Array
    range_m: Array
    scattering_depth: Array
    core_w_m2: Array
    halo_w_m2: Array


class LightSet:
    """Lamps in one water, in the station frame.

    With a funnel, a lamp that is set back behind the plane of the array sits inside the funnel whose rim carries the
    array: from outside it is seen through the mouth only. Without one, nothing hides a lamp.
    """

    def __init__(
        self,
        layout: BeaconLayout,
        water: WaterCfg,
        extra: Sequence[BeaconCfg] = (),
        *,
        funnel: bool = True,
    ) -> None:
        """Precompute what does not depend on the pose.

        Args:
            layout: the station's beacons; they come first.
            water: the water between lamps and camera.
            extra: further lamps, in the station frame.
            funnel: the station is a funnel along x whose rim carries the array.
        """
        lamps = (*layout.beacons, *extra)
        self.count = len(lamps)
        self.station_count = len(layout.beacons)
        self.positions_m = np.array([lamp.position_m for lamp in lamps], dtype=np.float64)
        axes = np.array([lamp.axis for lamp in lamps], dtype=np.float64)
        self.axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        self.peak_w_sr = np.array([peak_intensity_w_sr(lamp) for lamp in lamps])
        self.flux_w = np.array([lamp.power_w * lamp.efficiency for lamp in lamps])
        half = np.radians([lamp.beam_angle_deg for lamp in lamps]) / 2.0
        self._minus_profile = -math.log(2.0) / half**2
        self.absorption_per_m = np.array([water.absorption_at(lamp.wavelength_nm) for lamp in lamps])
        self.scattering_per_m = np.array([water.scattering_at(lamp.wavelength_nm) for lamp in lamps])
        self.electrons_per_j = np.array([electrons_per_joule(lamp.wavelength_nm) for lamp in lamps])
        array = layout.array_positions_m
        self._rim_x = float(np.mean(array[:, 0]))
        self._rim_centre = array[:, 1:].mean(axis=0)
        self._rim_radius2 = float(np.max(np.sum((array[:, 1:] - self._rim_centre) ** 2, axis=1)))
        setback = self._rim_x - self.positions_m[:, 0]
        inside = np.sum((self.positions_m[:, 1:] - self._rim_centre) ** 2, axis=1) < self._rim_radius2
        self._recessed = np.flatnonzero(((setback > 0.05) & inside & funnel)[: self.station_count])
        places = self.positions_m[self._recessed, 1:] - self._rim_centre
        # In plain floats, since there are few of them.
        self._behind: list[tuple[int, float, float, float]] = [
            (int(index), float(setback[index]), float(y), float(z))
            for index, (y, z) in zip(self._recessed, places, strict=True)
        ]

    def received(self, T_station_camera: Array) -> Received:
        """Core and halo irradiance of every lamp at a camera pose (4, 4)."""
        ray, range_m, depth, total = _received(
            T_station_camera,
            self.positions_m,
            self.axes,
            self._minus_profile,
            self.absorption_per_m,
            self.scattering_per_m,
            self.peak_w_sr,
        )
        camera = T_station_camera[:3, 3]
        ahead = float(camera[0]) - self._rim_x
        if ahead > 0.0 and self._behind:
            to_y, to_z = (camera[1:] - self._rim_centre).tolist()
            for index, setback, y, z in self._behind:
                share = setback / (setback + ahead)
                across, up = y * (1.0 - share) + to_y * share, z * (1.0 - share) + to_z * share
                if across * across + up * up > self._rim_radius2:
                    total[index] = 0.0
        core = total * np.exp(-depth)
        return Received(ray, range_m, depth, core, total - core)


@compiled
def _received(
    T_station_camera: Array,
    positions_m: Array,
    axes: Array,
    minus_profile: Array,
    absorption_per_m: Array,
    scattering_per_m: Array,
    peak_w_sr: Array,
) -> tuple[Array, Array, Array, Array]:
    """Rays in the camera frame (n, 3), ranges, scattering depths and irradiances (n,) that absorption leaves."""
    count = len(positions_m)
    ray, offset = np.empty((count, 3)), np.empty(3)
    range_m, depth, total = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        r2 = along = 0.0
        for k in range(3):
            offset[k] = positions_m[i, k] - T_station_camera[k, 3]
            r2 += offset[k] * offset[k]
            along -= offset[k] * axes[i, k]
        r2 = max(r2, _NEAREST_M2)
        r = math.sqrt(r2)
        angle = math.acos(min(max(along / r, -1.0), 1.0))
        total[i] = peak_w_sr[i] * math.exp(minus_profile[i] * angle * angle - absorption_per_m[i] * r) / r2
        range_m[i], depth[i] = r, scattering_per_m[i] * r
        for k in range(3):
            ray[i, k] = 0.0
            for axis in range(3):
                ray[i, k] += offset[axis] / r * T_station_camera[axis, k]
    return ray, range_m, depth, total
