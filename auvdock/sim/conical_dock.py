"""The conical station in the simulator: the nose passes the throat, the latch closes behind the bow."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.station import ConicalStationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.numeric.rotations import rotation_of_quat_wxyz
from auvdock.sim.contacts import Contacts
from auvdock.sim.dock import DockReport, Watch, Weld
from auvdock.sim.latch import Latch
from auvdock.sim.station_geometry import station_geoms

__all__ = ["ConicalDock"]


class ConicalDock:
    """Implements `auvdock.sim.dock.Dock` for `ConicalStationCfg`."""

    latch_time_s = 0.1
    """Stops 0.5 m/s within some 5 cm, as a sprung pawl does."""

    def __init__(self, station: ConicalStationCfg, vehicle: VehicleCfg) -> None:
        """Prepare the latch."""
        self.depth_m = station.depth_m
        self.free_world_m = (10.0, 0.0, -station.depth_m)
        self._station = station
        self._reach_m = vehicle.nose_x_m
        self._latch = Latch(station.latch, station.funnel)
        # The latch looks at a nose behind the throat only; the station frame is not turned against the world.
        self.watch = Watch(self._reach_m, np.array([1.0, 0.0, 0.0]), -station.funnel.length_m)
        self._nose_m = (math.inf, 0.0, 0.0)
        self._axis_angle_rad = 0.0

    def assets(self) -> list[str]:
        """None beyond the common materials."""
        return []

    def geoms(self) -> list[str]:
        """Funnel, tube, end stop, posts, lamps and floor."""
        return station_geoms(self._station)

    def reset(self) -> None:
        """Latch open."""
        self._latch.reset()

    def update(self, time_s: float, qpos: list[float], qvel: list[float], contacts: Contacts) -> Weld | None:
        """Follow the nose; the weld holds the body where it is, at the nose, as a pawl behind the bow would."""
        (r00, r01, r02), (r10, _, _), (r20, _, _) = rotation_of_quat_wxyz(np.array(qpos[3:]))
        reach = self._reach_m
        nose = qpos[0] + reach * r00, qpos[1] + reach * r10, qpos[2] + reach * r20 + self.depth_m
        # The tube points along −x of the station frame, which is not turned against the world.
        angle = math.atan2(math.hypot(r10, r20), -r00)
        self._nose_m, self._axis_angle_rad = nose, angle
        inward = -(qvel[0] + reach * (r01 * qvel[5] - r02 * qvel[4]))
        if not self._latch.update(time_s, nose, inward, angle):
            return None
        w, x, y, z = qpos[3:7]
        return Weld((nose[0], nose[1], nose[2] - self.depth_m), (reach, 0.0, 0.0), (w, x, y, z))

    def ground_z_m(self, x_m: float, y_m: float) -> float:
        """The floor; funnel and tube are open."""
        return -self._station.depth_m - self._station.floor_below_m

    @property
    def latched(self) -> bool:
        """True once the latch has closed."""
        return self._latch.closed_at_s is not None

    def switch_force_n(self, contacts: Contacts, position_world_m: Array, rotation: Array) -> float:
        """The bow's switch."""
        return contacts.bow_force_n(position_world_m, rotation[:, 0])

    def report(self) -> DockReport:
        """Nose, angle to the tube, latch and entry."""
        latch = self._latch
        return DockReport(self._nose_m, self._axis_angle_rad, self.latched, latch.docked, latch.entry)
