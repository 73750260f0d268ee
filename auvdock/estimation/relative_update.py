"""The relative filter's arithmetic, compiled: dead reckoning, fusing a pose, fusing a bearing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.cholesky import factorise, forward
from auvdock.numeric.compiled import compiled
from auvdock.numeric.motion import Motion, stale_walk_m2_s
from auvdock.numeric.records import Record, Records
from auvdock.numeric.rotations import headed, sine_axis
from auvdock.numeric.scalars import Vector, cross, within_pi

__all__ = ["ACCEPTED", "LEFT_OUT", "REFUSED", "RelativeBelief", "RelativeLaw", "advance", "station_point"]

LEFT_OUT, ACCEPTED, REFUSED = 0, 1, 2
"""Verdicts on a measurement: none came or it is not usable; fused; an outlier."""

_LEAST_AHEAD = 0.2
"""A direction to a light must point ahead of the camera by so much: z of the unit ray."""


@dataclass
class RelativeBelief(Record):
    """The state of the filter, x = (p, ψ_s), and its covariance P."""

    camera_m: Annotated[Array, 3]
    """p, camera in the station frame."""
    axis_yaw_rad: float
    """ψ_s, compass yaw of the station's x axis."""
    covariance: Annotated[Array, 4, 4]
    """P, m² and rad²."""


@dataclass(frozen=True)
class RelativeLaw(Record):
    """What the filter goes by: the camera's mounting, and noise and limits (`relative_state.FilterCfg`)."""

    dt_s: float
    """Period over which is reckoned; 0 leaves the dead reckoning out."""
    R_body_camera: Annotated[Array, 3, 3]
    camera_m: Annotated[Array, 3]
    """Camera on the body."""
    target_m: Annotated[Array, 3]
    """The light whose direction may be fused, station frame."""
    process: Annotated[Array, 4]
    """Diagonal of Q for one period, m² and rad²."""
    pose_floor: Annotated[Array, 6]
    """What is added to the diagonal of a pose's covariance, m² and rad²."""
    pose_inflation: float
    """Factor on that covariance."""
    pose_gate: float
    """Greatest squared Mahalanobis distance of a pose."""
    least_trace: float
    """Least trace of the rotation between expected and measured attitude, 1 + 2 cos of the angle."""
    bearing_floor_rad2: float
    """Variance of a direction."""
    target_spread_m: float
    """Standard deviation of the light's place."""
    bearing_gate: float
    """Greatest squared Mahalanobis distance of a direction."""
    min_bearing_range_m: float
    """Least distance of the light ahead of the camera."""


class _Correction(NamedTuple):
    """What a pose does to the belief: its squared Mahalanobis distance, shift (4,) of x, covariance (4, 4) after it."""

    distance: float
    shift: Array
    covariance: Array


@compiled
def advance(
    after: Records[RelativeBelief],
    before: Records[RelativeBelief],
    motion: Records[Motion],
    yaw_rad: float,
    law: Records[RelativeLaw],
    pose: Array,
    noise: Array,
    impatient: bool,
    ray: Array,
) -> tuple[int, int]:
    """One period: dead reckoning, then a pose, then a bearing, as far as they came.

    Args:
        after: (1,) takes the next belief.
        before: (1,) the last one.
        motion: (1,) `Senses.motion`.
        yaw_rad: compass heading.
        law: (1,).
        pose: (4, 4) T_station_camera; NaN for none.
        noise: (6, 6) its covariance.
        impatient: leave the bearing out if the pose is refused, as the filter then starts anew.
        ray: (3,) unit direction to the light in the camera frame; 0 for none.

    Returns:
        What became of the pose and of the bearing: `LEFT_OUT`, `ACCEPTED` or `REFUSED`.
    """
    after[0] = before[0]
    ground, rate, R_level_body = motion[0].ground_m_s, motion[0].rate_rad_s, motion[0].R_level_body
    now, by = after[0], law[0]
    if by.dt_s > 0.0:
        _reckon(now, ground, rate, headed(yaw_rad - now.axis_yaw_rad, R_level_body), by)
        stale = stale_walk_m2_s(motion[0].ground_age_s) * by.dt_s
        for i in range(3):
            now.covariance[i, i] += stale
    of_pose = _fuse_pose(now, yaw_rad, R_level_body, pose, noise, by)
    if impatient and of_pose == REFUSED:
        return of_pose, LEFT_OUT
    return of_pose, _fuse_bearing(now, yaw_rad, R_level_body, ray, by)


@compiled
def station_point(
    belief: Records[RelativeBelief], motion: Records[Motion], yaw_rad: float, x_m: float, y_m: float, z_m: float
) -> tuple[Vector, float]:
    """`RelativeState.station_point` of a point (x, y, z) from the camera in body axes, and ψ_s."""
    now = belief[0]
    R, camera = headed(yaw_rad - now.axis_yaw_rad, motion[0].R_level_body), now.camera_m
    point_m = (
        camera[0] + (R[0, 0] * x_m + R[0, 1] * y_m + R[0, 2] * z_m),
        camera[1] + (R[1, 0] * x_m + R[1, 1] * y_m + R[1, 2] * z_m),
        camera[2] + (R[2, 0] * x_m + R[2, 1] * y_m + R[2, 2] * z_m),
    )
    return point_m, now.axis_yaw_rad


@compiled
def _reckon(now: RelativeBelief, ground_m_s: Array, rate_rad_s: Array, R_station_body: Array, law: RelativeLaw) -> None:
    """ṗ = R_station_body (v + ω × r_camera), P ← F P Fᵀ + Q."""
    lever, dt_s = law.camera_m, law.dt_s
    swing = cross(rate_rad_s[0], rate_rad_s[1], rate_rad_s[2], lever[0], lever[1], lever[2])
    ahead, port, up = ground_m_s[0] + swing[0], ground_m_s[1] + swing[1], ground_m_s[2] + swing[2]
    velocity = np.empty(3)
    for i in range(3):
        velocity[i] = R_station_body[i, 0] * ahead + R_station_body[i, 1] * port + R_station_body[i, 2] * up
        now.camera_m[i] += velocity[i] * dt_s
    # A turn of the axis turns the velocity the other way: ∂v/∂ψ_s = −e_z × v.
    _propagate(now.covariance, velocity[1] * dt_s, -velocity[0] * dt_s, law.process)


@compiled
def _fuse_pose(
    now: RelativeBelief, yaw_rad: float, R_level_body: Array, pose: Array, noise: Array, law: RelativeLaw
) -> int:
    """Fuse a measured pose, or refuse it as an outlier; the verdict.

    The innovation is (p_measured − p, log(Rᵀ R_measured)) with the expected rotation R = R_z(−ψ_s) R_world_body
    R_body_camera, so ∂(rotation)/∂ψ_s = −Rᵀ e_z; tilt is known, which sharpens the position through the pose's own
    correlations.
    """
    if not (_is_finite(pose) and _is_finite(noise)):
        return LEFT_OUT
    expected, e = _station_camera(yaw_rad - now.axis_yaw_rad, R_level_body, law), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            e[i, j] = expected[0, i] * pose[0, j] + expected[1, i] * pose[1, j] + expected[2, i] * pose[2, j]
    if not e[0, 0] + e[1, 1] + e[2, 2] > law.least_trace:
        return REFUSED
    innovation = np.empty(6)
    for i in range(3):
        innovation[i] = pose[i, -1] - now.camera_m[i]
    innovation[3:] = sine_axis(e)
    corrected = _correct(now.covariance, innovation, expected[2], noise, law)
    if not corrected.distance < law.pose_gate:
        return REFUSED
    for i in range(4):
        for j in range(4):
            now.covariance[i, j] = corrected.covariance[i, j]
    _shift(now, corrected.shift)
    return ACCEPTED


@compiled
def _fuse_bearing(now: RelativeBelief, yaw_rad: float, R_level_body: Array, ray: Array, law: RelativeLaw) -> int:
    """Fuse the direction to a light at a known place: two scalar updates of d_x/d_z and d_y/d_z; the verdict.

    d = Rᵀ (target − p) in the camera frame, with ∂d/∂p = −Rᵀ and ∂d/∂ψ_s = Rᵀ (e_z × (target − p)).
    """
    if not (math.isfinite(ray[0] + ray[1] + ray[2]) and ray[2] > _LEAST_AHEAD):
        return LEFT_OUT
    c, covariance = _station_camera(yaw_rad - now.axis_yaw_rad, R_level_body, law), now.covariance
    to_target, d = np.empty(3), np.empty(3)
    for i in range(3):
        to_target[i] = law.target_m[i] - now.camera_m[i]
    for i in range(3):
        d[i] = c[0, i] * to_target[0] + c[1, i] * to_target[1] + c[2, i] * to_target[2]
    if d[2] < law.min_bearing_range_m:
        return LEFT_OUT
    variance = law.bearing_floor_rad2 + (law.target_spread_m / d[2]) ** 2
    tx, ty = -to_target[1], to_target[0]  # e_z × (target − p)
    rows, misses, spread = np.empty((2, 4)), np.empty(2), np.empty(4)
    distance = 0.0
    for n in range(2):
        # Row of ∂(d_n/d_z)/∂(p, ψ_s).
        ratio, measured = d[n] / d[2], ray[n] / ray[2]
        ax, ay = (c[0, n] - ratio * c[0, 2]) / d[2], (c[1, n] - ratio * c[1, 2]) / d[2]
        rows[n, 0], rows[n, 1], rows[n, 2] = -ax, -ay, -(c[2, n] - ratio * c[2, 2]) / d[2]
        rows[n, -1] = ax * tx + ay * ty
        misses[n] = measured - ratio
        _times(covariance, rows[n], spread)
        distance += misses[n] * misses[n] / (_dot(rows[n], spread) + variance)
    if distance > law.bearing_gate:
        return REFUSED
    shift = np.zeros(4)
    for n in range(2):
        _times(covariance, rows[n], spread)
        scale = 1.0 / (_dot(rows[n], spread) + variance)
        step = scale * (misses[n] - _dot(rows[n], shift))
        for i in range(4):
            shift[i] += spread[i] * step
            for j in range(4):
                covariance[i, j] -= scale * spread[i] * spread[j]
    _shift(now, shift)
    return ACCEPTED


@compiled
def _shift(now: RelativeBelief, shift: Array) -> None:
    """Add to the state; ψ_s stays within ±π."""
    for i in range(3):
        now.camera_m[i] += shift[i]
    now.axis_yaw_rad = within_pi(now.axis_yaw_rad + shift[-1])


@compiled
def _station_camera(heading_rad: float, R_level_body: Array, law: RelativeLaw) -> Array:
    """R_station_camera (3, 3) of a body that heads `heading_rad` in the station frame."""
    body, camera, mounting = headed(heading_rad, R_level_body), np.empty((3, 3)), law.R_body_camera
    for i in range(3):
        for j in range(3):
            camera[i, j] = body[i, 0] * mounting[0, j] + body[i, 1] * mounting[1, j] + body[i, 2] * mounting[2, j]
    return camera


@compiled
def _is_finite(matrix: Array) -> bool:
    """Whether every element is finite, and their squares do not overflow."""
    total = 0.0
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            total += matrix[i, j] * matrix[i, j]
    return math.isfinite(total)


@compiled
def _dot(a: Array, b: Array) -> float:
    """Scalar product of two vectors (4,), its terms added in order."""
    total = a[0] * b[0]
    for i in range(1, 4):
        total += a[i] * b[i]
    return total


@compiled
def _times(covariance: Array, vector: Array, out: Array) -> None:
    """P times a vector (4,), into `out`."""
    for i in range(4):
        out[i] = _dot(covariance[i], vector)


@compiled
def _propagate(covariance: Array, by_turn_x: float, by_turn_y: float, process: Array) -> None:
    """P ← F P Fᵀ + diag(process) with F = 1 but for what a turn of the axis does to x and y, F₀₃ and F₁₃."""
    for j in range(4):
        covariance[0, j] += by_turn_x * covariance[-1, j]
        covariance[1, j] += by_turn_y * covariance[-1, j]
    for i in range(4):
        turned = covariance[i, -1]
        covariance[i, 0] += by_turn_x * turned
        covariance[i, 1] += by_turn_y * turned
        covariance[i, i] += process[i]


@compiled
def _correct(covariance: Array, innovation: Array, turn: Array, noise: Array, law: RelativeLaw) -> _Correction:
    """Kalman update of a covariance P (4, 4) by a pose.

    With H = [1, 0; 0, -turn] the innovation (6,) has the covariance S = H P Hᵀ + inflation noise + diag(floor) (6, 6).
    The distance is `inf` for a singular S.
    """
    sensitivity = np.zeros((6, 4))
    for i in range(3):
        sensitivity[i, i] = 1.0
        sensitivity[3 + i, -1] = -turn[i]
    shared = np.zeros((4, 6))  # P Hᵀ
    for j in range(4):
        for i in range(6):
            for k in range(4):
                shared[j, i] += sensitivity[i, k] * covariance[k, j]
    lower = np.empty((6, 6))
    for i in range(6):
        for j in range(i + 1):
            value = law.pose_inflation * noise[i, j]
            if i == j:
                value += law.pose_floor[i]
            for k in range(4):
                value += shared[k, i] * sensitivity[j, k]
            lower[i, j] = value
    if not factorise(lower):
        return _Correction(np.inf, np.zeros(4), covariance.copy())
    # With S = L Lᵀ: L⁻¹ times the innovation, and L⁻¹ H P column by column.
    white, gain = innovation.copy(), shared
    forward(lower, white)
    for j in range(4):
        forward(lower, gain[j])
    distance = 0.0
    for i in range(6):
        distance += white[i] * white[i]
    shift, rest = np.zeros(4), covariance.copy()
    for i in range(4):
        for k in range(6):
            shift[i] += gain[i, k] * white[k]
        for j in range(i + 1):
            value = 0.5 * (covariance[i, j] + covariance[j, i])
            for k in range(6):
                value -= gain[i, k] * gain[j, k]
            rest[i, j] = rest[j, i] = value
    return _Correction(distance, shift, rest)
