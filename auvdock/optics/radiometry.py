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
from auvdock.optics.bands import electrons_per_joule
from auvdock.optics.light import peak_intensity_w_sr
from auvdock.optics.light_loop import received
from auvdock.optics.water import WaterCfg

__all__ = ["LightSet", "Received"]


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
        self.behind = np.column_stack([recessed.astype(np.float64), setback[recessed], places])
        self.rim = np.array([rim_x, *rim_centre, rim_radius2])
        lamps_of = minus_profile, self.absorption_per_m, self.scattering_per_m, self.peak_w_sr
        self.lamps = np.column_stack([self.positions_m, self.axes, *lamps_of])

    def received(self, T_station_camera: Array) -> Received:
        """Core and halo irradiance of every lamp at a camera pose (4, 4)."""
        ray, parts = received(T_station_camera, self.lamps, self.behind, self.rim)
        return Received(ray, parts[0], parts[1], parts[2], parts[3])
