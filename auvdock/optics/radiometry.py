"""The lamps of a scene in one water, asked for their light from any pose.

One computation serves the renderer, the `beacons` fidelity and planners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.numeric.records import Records
from auvdock.optics.arrival import Arrival, Lamp, Projection, Rim, arrive, arrive_everywhere
from auvdock.optics.bands import electrons_per_joule
from auvdock.optics.halo import HaloTable, halo_of
from auvdock.optics.light import peak_intensity_w_sr
from auvdock.optics.water import WaterCfg

__all__ = ["LightSet"]


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
        dark: IntArray | None = None,
    ) -> None:
        """Precompute what does not depend on the pose.

        Args:
            layout: the station's beacons; they come first.
            water: the water between lamps and camera.
            extra: further lamps, in the station frame.
            funnel: the station is a funnel along x whose rim carries the array.
            dark: indices of lamps that do not shine.
        """
        beacons = (*layout.beacons, *extra)
        self.count, self.station_count = len(beacons), len(layout.beacons)
        array = layout.array_positions_m
        rim_x, rim_centre = float(np.mean(array[:, 0])), array[:, 1:].mean(axis=0)
        rim_radius2 = float(np.max(np.sum((array[:, 1:] - rim_centre) ** 2, axis=1)))
        self.rim: Records[Rim] = Rim(rim_x, float(rim_centre[0]), float(rim_centre[1]), rim_radius2).packed()
        """The funnel's rim, one row."""
        self.lamps: Records[Lamp] = Lamp.zeros(self.count)
        """(n,) the lamps."""
        lamps = self.lamps
        lamps["place_m"] = [beacon.position_m for beacon in beacons]
        axes = np.array([beacon.axis for beacon in beacons], dtype=np.float64)
        lamps["axis"] = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        half = np.radians([beacon.beam_angle_deg for beacon in beacons]) / 2.0
        lamps["minus_profile"] = -math.log(2.0) / half**2
        lamps["absorption_per_m"] = [water.absorption_at(beacon.wavelength_nm) for beacon in beacons]
        lamps["scattering_per_m"] = [water.scattering_at(beacon.wavelength_nm) for beacon in beacons]
        lamps["peak_w_sr"] = [peak_intensity_w_sr(beacon) for beacon in beacons]
        lamps["flux_w"] = [beacon.power_w * beacon.efficiency for beacon in beacons]
        lamps["electrons_per_j"] = [electrons_per_joule(beacon.wavelength_nm) for beacon in beacons]
        setback, lateral = rim_x - lamps["place_m"][:, 0], lamps["place_m"][:, 1:] - rim_centre
        inside = (setback > 0.05) & (np.sum(lateral**2, axis=1) < rim_radius2)
        nm = [beacon.wavelength_nm for beacon in beacons]
        self.halo: HaloTable = halo_of(water, nm)
        """Of the lamps' light in this water."""
        lamps["halo_row"] = [self.halo.first_row(one) for one in nm]
        lamps["recessed"] = inside & funnel & (np.arange(self.count) < self.station_count)
        if dark is not None:
            lamps["peak_w_sr"][dark] = 0.0
            lamps["flux_w"][dark] = 0.0

    def column(self, name: str) -> Array:
        """(n, ...) one of the fields of `lamps`, as an array of its own."""
        return self.lamps[name].copy()

    def arrive(self, T_station_camera: Array, projection: Records[Projection]) -> Records[Arrival]:
        """(n,) the light of every lamp at a camera pose (4, 4), through a lens (`Lens.projection`)."""
        return arrive(T_station_camera, self.lamps, self.rim, projection, self.halo.places, self.halo.whole)

    def arrive_everywhere(self, T_station_camera: Array, projection: Records[Projection]) -> Records[Arrival]:
        """(m n,) the same at many poses (m, 4, 4), pose by pose."""
        halo = self.halo
        return arrive_everywhere(T_station_camera, self.lamps, self.rim, projection, halo.places, halo.whole)
