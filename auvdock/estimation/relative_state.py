"""Where the vehicle is before the station: camera poses fused with DVL, gyroscopes, inclinometer and compass.

Extended Kalman filter over (x, y, z, ψ_s): position of the camera in the station frame and the compass bearing ψ_s of
the station's approach axis. A station stands level, so roll and pitch come from the inclinometer, and ψ_s, a constant
that soaks up the compass' bias too, turns the compass heading into a relative heading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import PoseEstimate
from auvdock.core.limits import Count, Positive
from auvdock.estimation.relative_update import (
    ACCEPTED,
    LEFT_OUT,
    REFUSED,
    RelativeBelief,
    RelativeLaw,
    advance,
    station_point,
)
from auvdock.estimation.senses import Senses, Vector
from auvdock.numeric.records import Records, new_rows

__all__ = ["FilterCfg", "RelativeFilter", "RelativeState"]

_NO_POSE, _NO_NOISE = np.full((4, 4), math.nan), np.zeros((6, 6))
_NO_RAY = np.zeros(3)
_BELIEF = RelativeBelief.dtype()


@dataclass(frozen=True)
class FilterCfg(Checked):
    """Noise levels of the relative filter."""

    position_walk_m_rs: Positive = 0.03
    """Dead reckoning: standard deviation of position after 1 s, growing with the square root of time."""
    heading_walk_rad_rs: Positive = 0.004
    """The same for the bearing of the station's axis."""
    position_floor_m: Positive = 0.02
    """Added to a measured position's standard deviation."""
    rotation_floor_rad: Positive = 0.02
    """Added to a measured rotation's standard deviation: inclinometer, compass and the station's own tilt."""
    inflation: Positive = 3.0
    """Factor on a measured covariance: errors of successive frames are alike, which a filter takes for independent."""
    bearing_floor_rad: Positive = 0.02
    """Standard deviation of the direction to the entrance lamps."""
    entrance_spread_m: Positive = 0.05
    """Uncertainty of the entrance lamps' centre, as some of them may be hidden."""
    min_bearing_range_m: Positive = 0.6
    """Nearer than this to the entrance lamps, some of them leave the image and their centre misleads."""
    gate: Positive = 22.5
    """Greatest squared Mahalanobis distance of an accepted pose: 99.9 % of χ² with 6 degrees of freedom."""
    bearing_gate: Positive = 13.8
    """The same for a direction: 99.9 % of χ² with 2 degrees of freedom."""
    max_tilt_mismatch_rad: Positive = 0.26
    """A first pose whose roll or pitch disagrees more with the inclinometer is refused."""
    max_rotation_mismatch_rad: Positive = 0.6
    """A pose whose rotation differs more from the expected one is refused outright."""
    restart_after: Count = 10
    """So many refused poses in a row start the filter anew: the estimate, not the poses, is then wrong."""


class RelativeState(NamedTuple):
    """Estimate at one moment.

    Attributes:
        belief: (1,) mean and covariance; never written to.
        since_fix_s: time since the last accepted pose.
        fixes: accepted poses since the filter started.
        refused: poses refused since the last accepted one.
        restarts: how often poses disagreed for so long that the filter began anew.
    """

    belief: Records[RelativeBelief]
    since_fix_s: float
    fixes: int
    refused: int
    restarts: int

    @property
    def camera_m(self) -> Vector:
        """Camera in the station frame."""
        x, y, z = self.belief["camera_m"][0].tolist()
        return x, y, z

    @property
    def axis_yaw_rad(self) -> float:
        """Compass yaw of the station's x axis."""
        return self.belief["axis_yaw_rad"].item()

    @property
    def covariance(self) -> Array:
        """(4, 4) of (camera_m, axis_yaw_rad), m² and rad²."""
        return self.belief["covariance"][0]

    @property
    def cross_track_sigma_m(self) -> float:
        """Standard deviation across the axis, the worse of sideways and vertical."""
        covariance = self.belief["covariance"]
        return math.sqrt(max(covariance.item(0, 1, 1), covariance.item(0, 2, 2), 0.0))

    def station_point(self, senses: Senses, from_camera_m: Vector) -> tuple[Vector, float]:
        """A point of the vehicle in the station frame, given from the camera in body axes; and `axis_yaw_rad`."""
        x, y, z = from_camera_m
        return station_point(self.belief, senses.motion, senses.yaw_rad, x, y, z)


class RelativeFilter:
    """Reckoning and updates as pure functions of `RelativeState`."""

    def __init__(self, cfg: FilterCfg, T_body_camera: Array, dt_s: float, target_m: Vector = (0.0, 0.0, 0.0)) -> None:
        """Precompute noise and mounting.

        Args:
            cfg: noise levels.
            T_body_camera: (4, 4) pose of the camera on the body.
            dt_s: control period.
            target_m: the light whose direction may be fused, station frame.
        """
        self._cfg = cfg
        self._restart_after = cfg.restart_after
        self._R_body_camera = np.ascontiguousarray(T_body_camera[:3, :3])
        self._floor = np.array([cfg.position_floor_m**2] * 3 + [cfg.rotation_floor_rad**2] * 3)
        walk, turn = cfg.position_walk_m_rs**2 * dt_s, cfg.heading_walk_rad_rs**2 * dt_s
        law = RelativeLaw(
            dt_s=dt_s,
            R_body_camera=self._R_body_camera,
            camera_m=T_body_camera[:3, 3],
            target_m=np.array(target_m),
            process=np.array([walk, walk, walk, turn]),
            pose_floor=self._floor,
            pose_inflation=cfg.inflation,
            pose_gate=cfg.gate,
            least_trace=1.0 + 2.0 * math.cos(cfg.max_rotation_mismatch_rad),
            bearing_floor_rad2=cfg.bearing_floor_rad**2,
            target_spread_m=cfg.entrance_spread_m,
            bearing_gate=cfg.bearing_gate,
            min_bearing_range_m=cfg.min_bearing_range_m,
        )
        self._dt_s = dt_s
        self._law, self._law_at_once = law.packed(), replace(law, dt_s=0.0).packed()

    def advance(
        self, state: RelativeState, senses: Senses, pose: PoseEstimate | None = None, ray_camera: Array | None = None
    ) -> RelativeState:
        """One period: dead reckoning, then `update` with what came; the equations are those of `relative_update`."""
        return self._run(state, senses, self._dt_s, pose, ray_camera)

    def update(
        self, state: RelativeState, senses: Senses, pose: PoseEstimate | None = None, ray_camera: Array | None = None
    ) -> RelativeState:
        """Fuse a measured pose and a direction (3,) in the camera frame to the target, or refuse them as outliers.

        After `restart_after` refused poses the filter starts anew from the pose. What is not finite changes nothing.
        """
        return self._run(state, senses, 0.0, pose, ray_camera)

    def _run(
        self,
        state: RelativeState,
        senses: Senses,
        dt_s: float,
        pose: PoseEstimate | None,
        ray_camera: Array | None,
    ) -> RelativeState:
        T, cov = (pose.T_station_camera, pose.covariance) if pose is not None else (_NO_POSE, _NO_NOISE)
        impatient = state.refused + 1 >= self._restart_after
        law = self._law if dt_s > 0.0 else self._law_at_once
        belief: Records[RelativeBelief] = new_rows(1, _BELIEF)
        ray = ray_camera if ray_camera is not None else _NO_RAY
        of_pose, of_bearing = advance(belief, state.belief, senses.motion, senses.yaw_rad, law, T, cov, impatient, ray)
        if dt_s == 0.0 and of_pose == LEFT_OUT and of_bearing != ACCEPTED:
            return state
        since_fix_s, fixes, refused = state.since_fix_s + dt_s, state.fixes, state.refused
        if of_pose == ACCEPTED:
            since_fix_s, fixes, refused = 0.0, fixes + 1, 0
        elif of_pose == REFUSED:
            refused += 1
        after = RelativeState(belief, since_fix_s, fixes, refused, state.restarts)
        if pose is None or of_pose != REFUSED or not impatient:
            return after
        fresh = self.start(pose, senses, state.restarts + 1)
        return self.update(fresh if fresh is not None else after, senses, ray_camera=ray_camera)

    def start(self, pose: PoseEstimate, senses: Senses, restarts: int = 0) -> RelativeState | None:
        """A first state from one pose.

        None if it is not finite, lies behind the station or tilts otherwise than the inclinometer says.
        """
        T, cov = pose.T_station_camera, pose.covariance
        if not (np.isfinite(T).all() and np.isfinite(cov).all()):
            return None
        R_station_body = T[:3, :3] @ self._R_body_camera.T
        pitch = -math.asin(max(-1.0, min(1.0, float(R_station_body[2, 0]))))
        roll = math.atan2(float(R_station_body[2, 1]), float(R_station_body[2, 2]))
        limit = self._cfg.max_tilt_mismatch_rad
        # The station's lights can be seen from its front only.
        if abs(pitch - senses.pitch_rad) > limit or abs(roll - senses.roll_rad) > limit or T[0, 3] < 0.0:
            return None
        yaw = math.atan2(float(R_station_body[1, 0]), float(R_station_body[0, 0]))
        noise = self._cfg.inflation * cov + np.diag(self._floor)
        # A small rotation ρ in the camera frame turns the estimate of ψ_s by −(Rᵀ e_z) · ρ.
        select = np.zeros((4, 6))
        select[:3, :3] = np.eye(3)
        select[3, 3:] = -T[2, :3]
        axis_yaw_rad = math.remainder(senses.yaw_rad - yaw, math.tau)
        belief = RelativeBelief(T[:3, 3], axis_yaw_rad, select @ noise @ select.T)
        return RelativeState(belief.packed(), 0.0, 1, 0, restarts)
