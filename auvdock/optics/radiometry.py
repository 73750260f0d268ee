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
        minus_profile = -math.log(2.0) / half**2
        self.absorption_per_m = np.array([water.absorption_at(lamp.wavelength_nm) for lamp in lamps])
        self.scattering_per_m = np.array([water.scattering_at(lamp.wavelength_nm) for lamp in lamps])
        self.electrons_per_j = np.array([electrons_per_joule(lamp.wavelength_nm) for lamp in lamps])
        array = layout.array_positions_m
        rim_x, rim_centre = float(np.mean(array[:, 0])), array[:, 1:].mean(axis=0)
        rim_radius2 = float(np.max(np.sum((array[:, 1:] - rim_centre) ** 2, axis=1)))
        setback = rim_x - self.positions_m[:, 0]
        inside = np.sum((self.positions_m[:, 1:] - rim_centre) ** 2, axis=1) < rim_radius2
        recessed = np.flatnonzero(((setback > 0.05) & inside & funnel)[: self.station_count])
        # Of each lamp inside the funnel its index, how far it is set back and where it lies from the rim's centre.
        places = self.positions_m[recessed, 1:] - rim_centre
        self._behind = np.column_stack([recessed.astype(np.float64), setback[recessed], places])
        self._rim = np.array([rim_x, *rim_centre, rim_radius2])
        lamps_of = minus_profile, self.absorption_per_m, self.scattering_per_m, self.peak_w_sr
        self._lamps = np.column_stack([self.positions_m, self.axes, *lamps_of])

    def received(self, T_station_camera: Array) -> Received:
        """Core and halo irradiance of every lamp at a camera pose (4, 4)."""
        ray, parts = _received(T_station_camera, self._lamps, self._behind, self._rim)
        return Received(ray, parts[0], parts[1], parts[2], parts[3])


@compiled
def _received(T_station_camera: Array, lamps: Array, behind: Array, rim: Array) -> tuple[Array, Array]:
    """Rays in the camera frame (n, 3), and range, scattering depth, core and halo (4, n).

    Args:
        T_station_camera: (4, 4).
        lamps: (n, 10) position, axis, factor of θ² in the beam's exponent, absorption, scattering, peak intensity.
        behind: (k, 4) lamps inside the funnel: index, setback, y and z from the rim's centre.
        rim: (4,) x of its plane, y and z of its centre, square of its radius.
    """
    count = len(lamps)
    ray, offset = np.empty((count, 3)), np.empty(3)
    parts, total = np.empty((4, count)), np.empty(count)
    for i in range(count):
        r2 = along = 0.0
        for k in range(3):
            offset[k] = lamps[i, k] - T_station_camera[k, 3]
            r2 += offset[k] * offset[k]
            along -= offset[k] * lamps[i, 3 + k]
        r2 = max(r2, _NEAREST_M2)
        r = math.sqrt(r2)
        angle = math.acos(min(max(along / r, -1.0), 1.0))
        total[i] = lamps[i, 9] * math.exp(lamps[i, 6] * angle * angle - lamps[i, 7] * r) / r2
        parts[0, i], parts[1, i] = r, lamps[i, 8] * r
        for k in range(3):
            ray[i, k] = 0.0
            for axis in range(3):
                ray[i, k] += offset[axis] / r * T_station_camera[axis, k]
    ahead = T_station_camera[0, 3] - rim[0]
    if ahead > 0.0:
        to_y, to_z = T_station_camera[1, 3] - rim[1], T_station_camera[2, 3] - rim[2]
        for k in range(len(behind)):
            share = behind[k, 1] / (behind[k, 1] + ahead)
            across, up = behind[k, 2] * (1.0 - share) + to_y * share, behind[k, 3] * (1.0 - share) + to_z * share
            if across * across + up * up > rim[3]:
                total[int(behind[k, 0])] = 0.0
    for i in range(count):
        parts[2, i] = total[i] * math.exp(-parts[1, i])
        parts[3, i] = total[i] - parts[2, i]
    return ray, parts
