"""The landing station in the simulator: the seat comes to rest in the guides, an arm closes and pulls it tight."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.numeric.rotations import rotation_of_quat_wxyz
from auvdock.sim.contacts import Contacts
from auvdock.sim.dock import DockReport, Watch, Weld
from auvdock.sim.landing_geometry import landing_geoms
from auvdock.sim.landing_latch import LandingLatch, Posture
from auvdock.sim.truth import LandingTruth

__all__ = ["LandingDock"]


_WATCH_M = 3.0
"""Height of the body's origin over its place, above which no hull reaches down to the station."""


class LandingDock:
    """Implements `auvdock.sim.dock.Dock` for `LandingStationCfg`."""

    latch_time_s = 0.3
    """The arm pulls 30 kg of vehicle and 30 kg of water over its 6 cm of reach with some 40 N; ours."""

    def __init__(self, station: LandingStationCfg, vehicle: VehicleCfg) -> None:
        """Prepare the latch."""
        self.depth_m = station.depth_m
        self.free_world_m = (10.0, 0.0, 2.0 - station.depth_m)
        self._station = station
        self._nose_x_m = vehicle.nose_x_m
        self._seat_body_m = tuple(float(part) for part in vehicle.seat_body_m)
        self._place_z_m = station.guide.seat_height_m - station.depth_m
        self._latch = LandingLatch(station.latch)
        # Well before anything can touch: the touchdown takes its speed from the step before.
        self.watch = Watch(0.0, np.array([0.0, 0.0, 1.0]), self._place_z_m + _WATCH_M)
        self._last_down_m_s = 0.0
        self._nose_m = (0.0, 0.0, 0.0)
        self._posture = Posture((0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
        self._axis_angle_rad = 0.0

    def assets(self) -> list[str]:
        """None beyond the common materials."""
        return []

    def geoms(self) -> list[str]:
        """Platform, guides, tag plate, lamps and floor."""
        return landing_geoms(self._station)

    def reset(self) -> None:
        """Latch open."""
        self._latch.reset()
        self._last_down_m_s = 0.0

    def update(self, time_s: float, qpos: list[float], qvel: list[float], contacts: Contacts) -> Weld | None:
        """Follow the seat; the weld pulls it to its place, heading and pitch to the centre line's, roll as it is."""
        (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = rotation_of_quat_wxyz(np.array(qpos[3:]))
        sx, sy, sz = self._seat_body_m
        p, q, r = qvel[3:6]
        ax, ay, az = q * sz - r * sy, r * sx - p * sz, p * sy - q * sx
        u = qvel[0] + r00 * ax + r01 * ay + r02 * az
        v = qvel[1] + r10 * ax + r11 * ay + r12 * az
        w = qvel[2] + r20 * ax + r21 * ay + r22 * az
        error = (
            qpos[0] + r00 * sx + r01 * sy + r02 * sz,
            qpos[1] + r10 * sx + r11 * sy + r12 * sz,
            qpos[2] + r20 * sx + r21 * sy + r22 * sz - self._place_z_m,
        )
        reach = self._nose_x_m
        self._nose_m = qpos[0] + reach * r00, qpos[1] + reach * r10, qpos[2] + reach * r20 + self.depth_m
        self._axis_angle_rad = math.atan2(math.hypot(r10, r20), r00)
        tilt = math.atan2(math.hypot(r20, r21), r22)
        speed = math.sqrt(u * u + v * v + w * w)
        self._posture = Posture(error, math.atan2(r10, r00), tilt, speed)
        if contacts.touching_station:
            self._latch.touch(time_s, self._last_down_m_s, contacts.force_n)
        self._last_down_m_s = -w
        if not self._latch.update(time_s, self._posture):
            return None
        roll = math.atan2(r21, r22)
        place = (0.0, 0.0, self._place_z_m)
        return Weld(place, (sx, sy, sz), (math.cos(0.5 * roll), math.sin(0.5 * roll), 0.0, 0.0))

    def ground_z_m(self, x_m: float, y_m: float) -> float:
        """The platform's upper face, beside it the floor."""
        station = self._station
        is_above = abs(x_m) <= 0.5 * station.length_m and abs(y_m) <= 0.5 * station.width_m
        return -station.depth_m if is_above else -station.depth_m - station.height_m

    @property
    def latched(self) -> bool:
        """True once the latch has closed."""
        return self._latch.closed_at_s is not None

    def switch_force_n(self, contacts: Contacts, position_world_m: Array, rotation: Array) -> float:
        """The underside's switch: of the hull's lower half, or of the keel's."""
        return contacts.underside_force_n(position_world_m, rotation[:, 2], self._seat_body_m[2])

    def report(self) -> DockReport:
        """Nose, seat, latch and touchdown."""
        latch, posture = self._latch, self._posture
        seat_error_m = np.array(posture.seat_error_m)
        seat_error_m.flags.writeable = False
        return DockReport(
            self._nose_m,
            self._axis_angle_rad,
            self.latched,
            latch.docked,
            landing=LandingTruth(
                seat_error_m=seat_error_m,
                heading_error_rad=posture.heading_rad,
                tilt_rad=posture.tilt_rad,
                touchdown_speed_m_s=latch.touchdown_speed_m_s,
                touchdown_time_s=latch.touchdown_time_s,
                touchdown_force_n=latch.touchdown_force_n,
            ),
        )
