"""What the landing pilot reads of the belief, and how it carries that on between frames."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.controllers.landing.guidance import Place
from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Percept, PoseEstimate
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.transforms import invert
from auvdock.core.vehicle import VehicleCfg
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.estimation.senses import Senses, Vector, cross
from auvdock.numeric.motion import stale_walk_m2_s

__all__ = ["Belief", "BeliefReader"]


class Belief(NamedTuple):
    """Where the vehicle is at one moment, as the pilot takes it from the newest percept.

    Attributes:
        place: of the seat.
        axis_yaw_rad: compass heading of the station's axis.
        variance_m2: of the horizontal place, along the worse axis.
        since_fix_s: time since a pose was last measured.
        restarts: how often the estimate had begun anew.
        fixes: poses measured since it last did.
    """

    place: Place
    axis_yaw_rad: float
    variance_m2: float
    since_fix_s: float
    restarts: int
    fixes: int


class BeliefReader:
    """Takes the pose of each percept as it is: perception's measurements were filtered once, in `estimation`.

    In control periods without a pose the place moves with the DVL, p ← p + R_station_body (v + ω × r_seat) dt, and its
    variance grows as a random walk's, the more the longer the DVL has had no bottom lock.
    """

    def __init__(
        self, vehicle: VehicleCfg, station: LandingStationCfg, camera: Camera, walk_m_rs: float, dt_s: float
    ) -> None:
        """Precompute geometry.

        Args:
            vehicle: whose seat is meant.
            station: how high the guides' seat lies above the platform.
            camera: with its mounting.
            walk_m_rs: standard deviation of dead reckoning after 1 s, growing with the square root of time.
            dt_s: control period.
        """
        x, y, z = vehicle.seat_body_m.tolist()
        self._seat_m: Vector = (x, y, z)
        self._T_camera_body = invert(camera.T_body_camera)
        self._seat_height_m = station.guide.seat_height_m
        self._walk_m2 = walk_m_rs**2 * dt_s
        self._dt_s = dt_s

    def advance(self, belief: Belief | None, percept: Percept | None, senses: Senses) -> Belief | None:
        """The belief of this control period."""
        pose = percept.pose if percept is not None else None
        if pose is not None and np.isfinite(pose.T_station_camera).all() and np.isfinite(pose.covariance).all():
            restarts = percept.restarts if isinstance(percept, LandingPercept) else 0
            return self._read(belief, pose, restarts, senses)
        return None if belief is None else self._reckon(belief, senses)

    def _read(self, belief: Belief | None, pose: PoseEstimate, restarts: int, senses: Senses) -> Belief:
        T: Array = pose.T_station_camera @ self._T_camera_body
        x, y, z = (T[:3, :3] @ self._seat_m + T[:3, 3]).tolist()
        heading = math.atan2(T[1, 0], T[0, 0])
        fixes, since_fix_s = (0, math.inf) if belief is None else (belief.fixes, belief.since_fix_s + self._dt_s)
        if belief is not None and restarts > belief.restarts:
            fixes = 0
        if pose.measured:
            fixes, since_fix_s = fixes + 1, 0.0
        return Belief(
            Place(x, y, z - self._seat_height_m, heading),
            math.remainder(senses.yaw_rad - heading, math.tau),
            float(max(pose.covariance[0, 0], pose.covariance[1, 1], 0.0)),
            since_fix_s,
            restarts,
            fixes,
        )

    def _reckon(self, belief: Belief, senses: Senses) -> Belief:
        heading = math.remainder(senses.yaw_rad - belief.axis_yaw_rad, math.tau)
        swing, ground = cross(senses.rate_rad_s, self._seat_m), senses.ground_m_s
        x, y, z = senses.level(heading, (ground[0] + swing[0], ground[1] + swing[1], ground[2] + swing[2]))
        dt, place = self._dt_s, belief.place
        return belief._replace(
            place=Place(place.ahead_m + x * dt, place.port_m + y * dt, place.height_m + z * dt, heading),
            variance_m2=belief.variance_m2 + self._walk_m2 + stale_walk_m2_s(senses.ground_age_s) * dt,
            since_fix_s=belief.since_fix_s + dt,
        )
