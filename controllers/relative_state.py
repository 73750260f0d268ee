"""Where the vehicle is before the station: camera poses fused with DVL, gyroscopes, inclinometer and compass.

Extended Kalman filter over (x, y, z, ψ_s): position of the camera in the station frame and the compass bearing ψ_s of
the station's approach axis. A station stands level, so roll and pitch come from the inclinometer, and ψ_s, a constant
that soaks up the compass' bias too, turns the compass heading into a relative heading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.controllers.senses import Rows, Senses, Vector, cross, rotate, rotate_back, turn
from auvdock.core.arrays import Array
from auvdock.core.compiled import compiled
from auvdock.core.contracts import PoseEstimate
from auvdock.core.errors import ConfigError

__all__ = ["FilterCfg", "RelativeFilter", "RelativeState"]


Quad = tuple[float, float, float, float]


@dataclass(frozen=True)
class FilterCfg:
    """Noise levels of the relative filter."""

    position_walk_m_rs: float = 0.03
    """Dead reckoning: standard deviation of position after 1 s, growing with the square root of time."""
    heading_walk_rad_rs: float = 0.004
    """The same for the bearing of the station's axis."""
    position_floor_m: float = 0.02
    """Added to a measured position's standard deviation."""
    rotation_floor_rad: float = 0.02
    """Added to a measured rotation's standard deviation: inclinometer, compass and the station's own tilt."""
    inflation: float = 3.0
    """Factor on a measured covariance: errors of successive frames are alike, which a filter takes for independent."""
    bearing_floor_rad: float = 0.02
    """Standard deviation of the direction to the entrance lamps."""
    entrance_spread_m: float = 0.05
    """Uncertainty of the entrance lamps' centre, as some of them may be hidden."""
    min_bearing_range_m: float = 0.6
    """Nearer than this to the entrance lamps, some of them leave the image and their centre misleads."""
    gate: float = 22.5
    """Greatest squared Mahalanobis distance of an accepted pose: 99.9 % of χ² with 6 degrees of freedom."""
    bearing_gate: float = 13.8
    """The same for a direction: 99.9 % of χ² with 2 degrees of freedom."""
    max_tilt_mismatch_rad: float = 0.26
    """A first pose whose roll or pitch disagrees more with the inclinometer is refused."""
    max_rotation_mismatch_rad: float = 0.6
    """A pose whose rotation differs more from the expected one is refused outright."""
    restart_after: int = 10
    """So many refused poses in a row start the filter anew: the estimate, not the poses, is then wrong."""

    def __post_init__(self) -> None:
        """All are positive."""
        for name, value in vars(self).items():
            if not value > 0:
                raise ConfigError(f"control.filter.{name}", value, "a value above 0")


class RelativeState(NamedTuple):
    """Estimate at one moment.

    Attributes:
        camera_m: camera in the station frame.
        axis_yaw_rad: compass yaw of the station's x axis.
        covariance: (4, 4) of (camera_m, axis_yaw_rad), m² and rad²; never written to.
        since_fix_s: time since the last accepted pose.
        fixes: accepted poses since the filter started.
        refused: poses refused since the last accepted one.
        restarts: how often poses disagreed for so long that the filter began anew.
    """

    camera_m: Vector
    axis_yaw_rad: float
    covariance: Array
    since_fix_s: float
    fixes: int
    refused: int
    restarts: int

    @property
    def cross_track_sigma_m(self) -> float:
        """Standard deviation across the axis, the worse of sideways and vertical."""
        return math.sqrt(max(float(self.covariance[1, 1]), float(self.covariance[2, 2]), 0.0))


class RelativeFilter:
    """Predict and update as pure functions of `RelativeState`."""

    def __init__(self, cfg: FilterCfg, T_body_camera: Array, dt_s: float, front: Vector = (1.0, 0.0, 0.0)) -> None:
        """Precompute noise and mounting.

        Args:
            cfg: noise levels.
            T_body_camera: (4, 4) pose of the camera on the body.
            dt_s: control period.
            front: side of the station, station frame, from which its lights can be seen: a first pose lies there.
        """
        self._cfg = cfg
        self._front = front
        self._dt_s = dt_s
        self._lever: Vector = (float(T_body_camera[0, 3]), float(T_body_camera[1, 3]), float(T_body_camera[2, 3]))
        self._R_body_camera = np.ascontiguousarray(T_body_camera[:3, :3])
        walk, turn = cfg.position_walk_m_rs**2 * dt_s, cfg.heading_walk_rad_rs**2 * dt_s
        self._process = np.diag([walk, walk, walk, turn])
        self._floor = np.diag([cfg.position_floor_m**2] * 3 + [cfg.rotation_floor_rad**2] * 3)
        self._max_trace = 1.0 + 2.0 * math.cos(cfg.max_rotation_mismatch_rad)

    def predict(self, state: RelativeState, senses: Senses) -> RelativeState:
        """Dead reckoning over one period: ṗ = R_station_body (v + ω × r_camera); covariance F P Fᵀ + Q."""
        dt_s = self._dt_s
        spin = cross(senses.rate_rad_s, self._lever)
        ground = senses.ground_m_s
        body = (ground[0] + spin[0], ground[1] + spin[1], ground[2] + spin[2])
        velocity = rotate(self._R_station_body(state.axis_yaw_rad, senses), body)
        x, y, z = state.camera_m
        # A turn of the axis turns the velocity the other way: ∂v/∂ψ_s = −e_z × v.
        return RelativeState(
            (x + velocity[0] * dt_s, y + velocity[1] * dt_s, z + velocity[2] * dt_s),
            state.axis_yaw_rad,
            _moved(state.covariance, velocity[1] * dt_s, -velocity[0] * dt_s, self._process),
            state.since_fix_s + dt_s,
            state.fixes,
            state.refused,
            state.restarts,
        )

    def start(self, pose: PoseEstimate, senses: Senses, restarts: int = 0) -> RelativeState | None:
        """A first state from one pose, or None if its tilt disagrees with the inclinometer or it is not finite."""
        T, cov = pose.T_station_camera, pose.covariance
        if not (np.isfinite(T).all() and np.isfinite(cov).all()):
            return None
        R_station_body = T[:3, :3] @ self._R_body_camera.T
        pitch = -math.asin(max(-1.0, min(1.0, float(R_station_body[2, 0]))))
        roll = math.atan2(float(R_station_body[2, 1]), float(R_station_body[2, 2]))
        limit = self._cfg.max_tilt_mismatch_rad
        x, y, z = T[:3, 3].tolist()
        front = self._front[0] * x + self._front[1] * y + self._front[2] * z
        if abs(pitch - senses.pitch_rad) > limit or abs(roll - senses.roll_rad) > limit or front < 0.0:
            return None
        yaw = math.atan2(float(R_station_body[1, 0]), float(R_station_body[0, 0]))
        noise = self._cfg.inflation * cov + self._floor
        # A small rotation ρ in the camera frame turns the estimate of ψ_s by −(Rᵀ e_z) · ρ.
        select = np.zeros((4, 6))
        select[:3, :3] = np.eye(3)
        select[3, 3:] = -T[2, :3]
        return RelativeState(
            (x, y, z),
            math.remainder(senses.yaw_rad - yaw, math.tau),
            select @ noise @ select.T,
            0.0,
            1,
            0,
            restarts,
        )

    def update_pose(self, state: RelativeState, senses: Senses, pose: PoseEstimate) -> RelativeState:
        """Fuse a measured pose, or refuse it as an outlier; after `restart_after` refusals start anew from it.

        The innovation is (p_measured − p, log(R_predictedᵀ R_measured)) with R = R_z(−ψ_s) R_world_body R_body_camera,
        so ∂(rotation)/∂ψ_s = −Rᵀ e_z; tilt is known, which sharpens the position through the pose's own correlations.
        """
        cfg = self._cfg
        T, cov = pose.T_station_camera, pose.covariance
        if not math.isfinite(float(np.vdot(T, T)) + float(np.vdot(cov, cov))):
            return state
        R_station_body = np.array(self._R_station_body(state.axis_yaw_rad, senses)).reshape(3, 3)
        predicted = R_station_body.dot(self._R_body_camera)
        e: list[float] = predicted.T.dot(T[:3, :3]).ravel().tolist()
        sine = (0.5 * (e[7] - e[5]), 0.5 * (e[2] - e[6]), 0.5 * (e[3] - e[1]))
        x, y, z = state.camera_m
        px, py, pz = T[:3, 3].tolist()
        if e[0] + e[4] + e[8] > self._max_trace:
            innovation = np.array([px - x, py - y, pz - z, *sine])
            distance, shift, covariance = _fused(
                state.covariance, innovation, predicted[2], cov, cfg.inflation, self._floor
            )
            if distance < cfg.gate:
                dx, dy, dz, turn = shift.tolist()
                return RelativeState(
                    (x + dx, y + dy, z + dz),
                    math.remainder(state.axis_yaw_rad + turn, math.tau),
                    covariance,
                    0.0,
                    state.fixes + 1,
                    0,
                    state.restarts,
                )
        if state.refused + 1 >= cfg.restart_after:
            fresh = self.start(pose, senses, state.restarts + 1)
            if fresh is not None:
                return fresh
        return state._replace(refused=state.refused + 1)

    def update_bearing(
        self, state: RelativeState, senses: Senses, ray_camera: Array, target_m: Vector
    ) -> RelativeState:
        """Fuse the direction to a light at a known place: two scalar updates of d_x/d_z and d_y/d_z.

        d = Rᵀ (target − p) in the camera frame, with ∂d/∂p = −Rᵀ and ∂d/∂ψ_s = Rᵀ (e_z × (target − p)).
        """
        cfg = self._cfg
        rx, ry, rz = ray_camera.tolist()
        if not (math.isfinite(rx + ry + rz) and rz > 0.2):
            return state
        R_station_body = self._R_station_body(state.axis_yaw_rad, senses)
        columns = np.array(R_station_body).reshape(3, 3).dot(self._R_body_camera)
        c: list[float] = columns.ravel().tolist()
        camera = state.camera_m
        to_target = (target_m[0] - camera[0], target_m[1] - camera[1], target_m[2] - camera[2])
        dx, dy, dz = rotate_back((c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]), to_target)
        if dz < cfg.min_bearing_range_m:
            return state
        variance = cfg.bearing_floor_rad**2 + (cfg.entrance_spread_m / dz) ** 2
        tx, ty = -to_target[1], to_target[0]  # e_z × (target − p)
        rows: list[tuple[float, float, float, float]] = []
        misses: list[float] = []
        for column, ratio, measured in ((0, dx / dz, rx / rz), (1, dy / dz, ry / rz)):
            # Row of ∂(d_i/d_z)/∂(p, ψ_s).
            ax, ay = (c[column] - ratio * c[2]) / dz, (c[3 + column] - ratio * c[5]) / dz
            rows.append((-ax, -ay, -(c[6 + column] - ratio * c[8]) / dz, ax * tx + ay * ty))
            misses.append(measured - ratio)
        lines: list[list[float]] = state.covariance.tolist()
        distance = 0.0
        for row, miss in zip(rows, misses, strict=True):
            distance += miss * miss / (_dot(row, _times(lines, row)) + variance)
        if distance > cfg.bearing_gate:
            return state
        shift = (0.0, 0.0, 0.0, 0.0)
        for row, miss in zip(rows, misses, strict=True):
            spread = _times(lines, row)
            scale = 1.0 / (_dot(row, spread) + variance)
            step = scale * (miss - _dot(row, shift))
            shift = (
                shift[0] + spread[0] * step,
                shift[1] + spread[1] * step,
                shift[2] + spread[2] * step,
                shift[3] + spread[3] * step,
            )
            x, y, z, w = spread
            lines = [
                [a - scaled * x, b - scaled * y, c - scaled * z, d - scaled * w]
                for (a, b, c, d), scaled in zip(lines, [scale * left for left in spread], strict=True)
            ]
        return state._replace(
            camera_m=(camera[0] + shift[0], camera[1] + shift[1], camera[2] + shift[2]),
            axis_yaw_rad=math.remainder(state.axis_yaw_rad + shift[3], math.tau),
            covariance=np.array(lines),
        )

    @staticmethod
    def _R_station_body(axis_yaw_rad: float, senses: Senses) -> Rows:
        return turn(senses.level, senses.yaw_rad - axis_yaw_rad)


@compiled
def _moved(covariance: Array, by_turn_x: float, by_turn_y: float, process: Array) -> Array:
    """F P Fᵀ + Q (4, 4) with F = 1 but for what a turn of the axis does to x and y, F₀₃ and F₁₃."""
    moved = covariance.copy()
    moved[0] += by_turn_x * covariance[3]
    moved[1] += by_turn_y * covariance[3]
    turned = moved[:, 3].copy()
    moved[:, 0] += by_turn_x * turned
    moved[:, 1] += by_turn_y * turned
    return moved + process


@compiled
def _fused(
    covariance: Array, innovation: Array, turn: Array, noise: Array, inflation: float, floor: Array
) -> tuple[float, Array, Array]:
    """Kalman update of a covariance P (4, 4) by a pose.

    With H = [1, 0; 0, -turn] the innovation (6,) has the covariance S = H P Hᵀ + inflation × noise + floor (6, 6).

    Returns:
        Its squared Mahalanobis distance, `inf` for a singular S; the state's shift (4,); (1 - K H) P (4, 4).
    """
    sensitivity = np.zeros((6, 4))
    for i in range(3):
        sensitivity[i, i] = 1.0
        sensitivity[3 + i, 3] = -turn[i]
    shared = np.zeros((6, 4))
    for i in range(6):
        for j in range(4):
            for k in range(4):
                shared[i, j] += sensitivity[i, k] * covariance[k, j]
    # S = L Lᵀ, row by row; beside it L⁻¹ H P and L⁻¹ times the innovation.
    lower, gain, white = np.zeros((6, 6)), shared.copy(), innovation.copy()
    distance = 0.0
    for i in range(6):
        for j in range(i + 1):
            value = inflation * noise[i, j] + floor[i, j]
            for k in range(4):
                value += shared[i, k] * sensitivity[j, k]
            for k in range(j):
                value -= lower[i, k] * lower[j, k]
            if i > j:
                lower[i, j] = value / lower[j, j]
            elif value > 0.0:
                lower[i, i] = math.sqrt(value)
            else:
                return np.inf, np.zeros(4), covariance
        for k in range(i):
            white[i] -= lower[i, k] * white[k]
            for j in range(4):
                gain[i, j] -= lower[i, k] * gain[k, j]
        white[i] /= lower[i, i]
        for j in range(4):
            gain[i, j] /= lower[i, i]
        distance += white[i] * white[i]
    shift, rest = np.zeros(4), covariance.copy()
    for i in range(4):
        for k in range(6):
            shift[i] += gain[k, i] * white[k]
        for j in range(i + 1):
            value = 0.5 * (covariance[i, j] + covariance[j, i])
            for k in range(6):
                value -= gain[k, i] * gain[k, j]
            rest[i, j] = rest[j, i] = value
    return distance, shift, rest


def _dot(a: Quad, b: Quad) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


def _times(matrix: list[list[float]], vector: Quad) -> Quad:
    x, y, z, w = vector
    a, b, c, d = matrix
    return (
        a[0] * x + a[1] * y + a[2] * z + a[3] * w,
        b[0] * x + b[1] * y + b[2] * z + b[3] * w,
        c[0] * x + c[1] * y + c[2] * z + c[3] * w,
        d[0] * x + d[1] * y + d[2] * z + d[3] * w,
    )
