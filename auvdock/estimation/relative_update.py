"""The relative filter's arithmetic, compiled: dead reckoning, fusing a pose, fusing a bearing.

Everything works in place on two arrays: the estimate (x, y, z, ψ_s), and its covariance P (4, 4).
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.cholesky import factorise, forward
from auvdock.numeric.compiled import compiled
from auvdock.numeric.motion import GROUND, LEVEL, RATE, WATER
from auvdock.numeric.rotations import headed, sine_axis
from auvdock.numeric.scalars import cross, within_pi

__all__ = ["ACCEPTED", "LEFT_OUT", "REFUSED", "relative_period"]

LEFT_OUT, ACCEPTED, REFUSED = 0.0, 1.0, 2.0
"""Verdicts on a measurement: none came or it is not usable; fused; an outlier."""

_LEAST_AHEAD = 0.2
"""A direction to a light must point ahead of the camera by so much: z of the unit ray."""


@compiled
def relative_period(
    estimate: Array,
    covariance: Array,
    motion: Array,
    yaw_rad: float,
    dt_s: float,
    mounting: Array,
    law: Array,
    pose: Array,
    noise: Array,
    impatient: bool,
    ray: Array,
) -> tuple[float, float]:
    """One period: dead reckoning, then a pose, then a bearing, as far as they came.

    Args:
        estimate: (4,) camera in the station frame in m, ψ_s in rad; brought up to date in place.
        covariance: (4, 4) P; likewise.
        motion: (20,) `Senses.motion`.
        yaw_rad: compass heading.
        dt_s: period; 0 to leave the dead reckoning out.
        mounting: (5, 3) R_body_camera, the camera on the body in m, the light of the bearing in the station frame in m.
        law: (17,) diagonal of Q; what is added to the diagonal of a pose's covariance, the factor on that covariance,
            the gate, the least trace of an acceptable rotation mismatch; of a bearing the floor of the variance in
            rad², the spread of the light in m, the gate, the least range in m.
        pose: (4, 4) T_station_camera; NaN for none.
        noise: (6, 6) its covariance.
        impatient: leave the bearing out if the pose is refused, as the filter then starts anew.
        ray: (3,) unit direction to the light in the camera frame; 0 for none.

    Returns:
        The verdicts on the pose and on the bearing.
    """
    if dt_s > 0.0:
        _reckon(estimate, covariance, motion, yaw_rad, dt_s, mounting, law[:4])
    of_pose = _fuse_pose(estimate, covariance, motion, yaw_rad, mounting, pose, noise, law[4:13])
    if impatient and of_pose == REFUSED:
        return of_pose, LEFT_OUT
    return of_pose, _fuse_bearing(estimate, covariance, motion, yaw_rad, mounting, ray, law[13:])


@compiled
def _reckon(
    estimate: Array, covariance: Array, motion: Array, yaw_rad: float, dt_s: float, mounting: Array, process: Array
) -> None:
    """ṗ = R_station_body (v + ω × r_camera), P ← F P Fᵀ + Q."""
    body, rate, lever = motion[GROUND:WATER], motion[RATE:GROUND], mounting[3]
    swing = cross(rate[0], rate[1], rate[2], lever[0], lever[1], lever[2])
    ahead, port, up = body[0] + swing[0], body[1] + swing[1], body[2] + swing[2]
    turned = headed(yaw_rad - estimate[3], motion[LEVEL:].reshape(3, 3))
    velocity = np.empty(3)
    for i in range(3):
        velocity[i] = turned[i, 0] * ahead + turned[i, 1] * port + turned[i, 2] * up
        estimate[i] += velocity[i] * dt_s
    # A turn of the axis turns the velocity the other way: ∂v/∂ψ_s = −e_z × v.
    _move(covariance, velocity[1] * dt_s, -velocity[0] * dt_s, process)


@compiled
def _fuse_pose(
    estimate: Array,
    covariance: Array,
    motion: Array,
    yaw_rad: float,
    mounting: Array,
    pose: Array,
    noise: Array,
    law: Array,
) -> float:
    """Fuse a measured pose, or refuse it as an outlier; the verdict.

    The innovation is (p_measured − p, log(R_predictedᵀ R_measured)) with R = R_z(−ψ_s) R_world_body R_body_camera,
    so ∂(rotation)/∂ψ_s = −Rᵀ e_z; tilt is known, which sharpens the position through the pose's own correlations.
    """
    if not (_is_finite(pose) and _is_finite(noise)):
        return LEFT_OUT
    predicted = _station_camera(motion, yaw_rad - estimate[3], mounting)
    e = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            e[i, j] = predicted[0, i] * pose[0, j] + predicted[1, i] * pose[1, j] + predicted[2, i] * pose[2, j]
    if not e[0, 0] + e[1, 1] + e[2, 2] > law[8]:
        return REFUSED
    innovation = np.empty(6)
    for i in range(3):
        innovation[i] = pose[i, 3] - estimate[i]
    innovation[3], innovation[4], innovation[5] = sine_axis(e)
    distance, shift, rest = _fused(covariance, innovation, predicted[2], noise, law[6], law[:6])
    if not distance < law[7]:
        return REFUSED
    for i in range(4):
        for j in range(4):
            covariance[i, j] = rest[i, j]
    _shift(estimate, shift)
    return ACCEPTED


@compiled
def _fuse_bearing(
    estimate: Array,
    covariance: Array,
    motion: Array,
    yaw_rad: float,
    mounting: Array,
    ray: Array,
    law: Array,
) -> float:
    """Fuse the direction to a light at a known place: two scalar updates of d_x/d_z and d_y/d_z; the verdict.

    d = Rᵀ (target − p) in the camera frame, with ∂d/∂p = −Rᵀ and ∂d/∂ψ_s = Rᵀ (e_z × (target − p)).
    """
    if not (math.isfinite(ray[0] + ray[1] + ray[2]) and ray[2] > _LEAST_AHEAD):
        return LEFT_OUT
    c = _station_camera(motion, yaw_rad - estimate[3], mounting)
    to_target, d = np.empty(3), np.empty(3)
    for i in range(3):
        to_target[i] = mounting[4, i] - estimate[i]
    for i in range(3):
        d[i] = c[0, i] * to_target[0] + c[1, i] * to_target[1] + c[2, i] * to_target[2]
    if d[2] < law[3]:
        return LEFT_OUT
    variance = law[0] + (law[1] / d[2]) ** 2
    tx, ty = -to_target[1], to_target[0]  # e_z × (target − p)
    rows, misses, spread = np.empty((2, 4)), np.empty(2), np.empty(4)
    distance = 0.0
    for n in range(2):
        # Row of ∂(d_n/d_z)/∂(p, ψ_s).
        ratio, measured = d[n] / d[2], ray[n] / ray[2]
        ax, ay = (c[0, n] - ratio * c[0, 2]) / d[2], (c[1, n] - ratio * c[1, 2]) / d[2]
        rows[n, 0], rows[n, 1], rows[n, 2] = -ax, -ay, -(c[2, n] - ratio * c[2, 2]) / d[2]
        rows[n, 3] = ax * tx + ay * ty
        misses[n] = measured - ratio
        _times(covariance, rows[n], spread)
        distance += misses[n] * misses[n] / (_dot(rows[n], spread) + variance)
    if distance > law[2]:
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
    _shift(estimate, shift)
    return ACCEPTED


@compiled
def _shift(estimate: Array, shift: Array) -> None:
    """Move the estimate; ψ_s stays within ±π."""
    for i in range(3):
        estimate[i] += shift[i]
    estimate[3] = within_pi(estimate[3] + shift[3])


@compiled
def _station_camera(motion: Array, heading_rad: float, mounting: Array) -> Array:
    """R_station_camera (3, 3) of a body that heads `heading_rad` in the station frame."""
    body, camera = headed(heading_rad, motion[LEVEL:].reshape(3, 3)), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            camera[i, j] = body[i, 0] * mounting[0, j] + body[i, 1] * mounting[1, j] + body[i, 2] * mounting[2, j]
    return camera


@compiled
def _is_finite(matrix: Array) -> bool:
    """Whether all squares of a matrix are finite in sum."""
    total = 0.0
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            total += matrix[i, j] * matrix[i, j]
    return math.isfinite(total)


@compiled
def _dot(a: Array, b: Array) -> float:
    """Of two (4,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@compiled
def _times(covariance: Array, vector: Array, out: Array) -> None:
    """P times a vector (4,), into `out`."""
    for i in range(4):
        out[i] = _dot(covariance[i], vector)


@compiled
def _move(covariance: Array, by_turn_x: float, by_turn_y: float, process: Array) -> None:
    """P ← F P Fᵀ + diag(process) with F = 1 but for what a turn of the axis does to x and y, F₀₃ and F₁₃."""
    for j in range(4):
        covariance[0, j] += by_turn_x * covariance[3, j]
        covariance[1, j] += by_turn_y * covariance[3, j]
    for i in range(4):
        turned = covariance[i, 3]
        covariance[i, 0] += by_turn_x * turned
        covariance[i, 1] += by_turn_y * turned
        covariance[i, i] += process[i]


@compiled
def _fused(
    covariance: Array, innovation: Array, turn: Array, noise: Array, inflation: float, floor: Array
) -> tuple[float, Array, Array]:
    """Kalman update of a covariance P (4, 4) by a pose.

    With H = [1, 0; 0, -turn] the innovation (6,) has the covariance S = H P Hᵀ + inflation noise + diag(floor) (6, 6).

    Returns:
        Its squared Mahalanobis distance, `inf` for a singular S; the state's shift (4,); (1 - K H) P (4, 4).
    """
    sensitivity = np.zeros((6, 4))
    for i in range(3):
        sensitivity[i, i] = 1.0
        sensitivity[3 + i, 3] = -turn[i]
    shared = np.zeros((4, 6))  # P Hᵀ
    for j in range(4):
        for i in range(6):
            for k in range(4):
                shared[j, i] += sensitivity[i, k] * covariance[k, j]
    lower = np.empty((6, 6))
    for i in range(6):
        for j in range(i + 1):
            value = inflation * noise[i, j]
            if i == j:
                value += floor[i]
            for k in range(4):
                value += shared[k, i] * sensitivity[j, k]
            lower[i, j] = value
    if not factorise(lower):
        return np.inf, np.zeros(4), covariance
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
    return distance, shift, rest
