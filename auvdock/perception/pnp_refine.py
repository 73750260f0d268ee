"""Levenberg–Marquardt on the reprojection error, and all that follows from its result: the loops of `perception.pnp`.

With y = R X + t, R = exp([r]): ∂y/∂t = 1 and ∂y/∂r = -[R X] J_l(r), J_l the left Jacobian of the rotation group
(Barfoot 2017, equation 7.77). The image of y is OpenCV's: pinhole, three radial and two tangential terms.

Lights come as one table and results go as one array: Numba takes and gives that at a fraction of what many cost.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.cholesky import factorise, forward, solve
from auvdock.numeric.compiled import compiled
from auvdock.numeric.lens import FX, FY, K3, pixel_of, slopes
from auvdock.numeric.lights import (
    ATTITUDE,
    COST,
    COVARIANCE,
    ERROR,
    PIXEL,
    RESIDUAL,
    ROTATION,
    SEEN,
    SIGMA,
    TRANSFORM,
    TRANSLATION,
)
from auvdock.numeric.rotations import left_jacobian, rotation_of, vector_of
from auvdock.numeric.scalars import cross

__all__ = ["refine", "solve_from"]

_PRIOR_WEIGHT = K3 + 1
_MAX_ITERATIONS = 20


@compiled
def solve_from(
    start: Array, lights: Array, prior: Array, terms: Array, heading_weight: float, decrement: float
) -> Array:
    """Refine a pose and tell all that is asked about it.

    The cost of an attitude other than the prior's is (r - r₀)ᵀ J_lᵀ W J_l (r - r₀), with W = w of a small rotation
    about any axis, or w_h about the station's upright one.

    Args:
        start: (6 or more,) rotation vector r and translation t to start from.
        lights: (n, 7) table: X, Y, Z in the station frame, m; image u, v and its σ, px; 1 if seen, 0 if predicted.
        prior: (3, 3) R of the vehicle's own attitude.
        terms: (10,) fx, fy, cx, cy, k1, k2, p1, p2, k3 of the camera, and w of the prior, 0 for none.
        heading_weight: w_h, at most w.
        decrement: expected fall of χ² at which to stop.

    Returns:
        (70 + n,) r; t; R (3, 3); T_station_camera (4, 4); covariance (6, 6); angle to the prior, rad; χ², nan where it
        did not end well and nothing else counts; mean of the seen lights' residuals, or of all where none is seen, px;
        residuals (n,), px. It does not end well where the lights coincide or lie on one line, their noise considered,
        or where a number is not finite.
    """
    result = np.zeros(RESIDUAL + len(lights))
    if not _is_wide(lights):
        result[COST] = np.nan
        return result
    expected, weight = np.zeros(3), np.zeros((3, 3))
    if terms[_PRIOR_WEIGHT] > 0.0:
        for i in range(3):
            weight[i, i] = terms[_PRIOR_WEIGHT]
            for j in range(3):
                weight[i, j] += (heading_weight - terms[_PRIOR_WEIGHT]) * (prior[i, 2] * prior[j, 2])
        expected = vector_of(prior)
        left = left_jacobian(expected)
        weight = left.T @ weight @ left
    good, pose, residual, factor, cost = refine(start[:ROTATION], lights, terms, expected, weight, decrement)
    if not good:
        result[COST] = np.nan
        return result
    rotation = rotation_of(pose[:TRANSLATION])
    for i in range(6):
        result[i] = pose[i]
    trace = 0.0
    for i in range(3):
        row = TRANSFORM + 4 * i
        for j in range(3):
            result[ROTATION + 3 * i + j], result[row + j] = rotation[i, j], rotation[j, i]
            trace += rotation[i, j] * prior[i, j]
        result[row + 3] = -(rotation[0, i] * pose[3] + rotation[1, i] * pose[4] + rotation[2, i] * pose[5])
        result[TRANSFORM + 12 + i] = 0.0
    result[TRANSFORM + 15] = 1.0
    _put_covariance(pose, rotation, factor, result)
    result[ATTITUDE] = math.acos(max(-1.0, min(1.0, (trace - 1.0) / 2.0)))
    result[COST] = cost
    seen, error, error_seen = 0, 0.0, 0.0
    for i in range(len(lights)):
        size = math.hypot(residual[i, 0], residual[i, 1])
        result[RESIDUAL + i] = size
        error += size
        if lights[i, SEEN] > 0.0:
            seen += 1
            error_seen += size
    result[ERROR] = error_seen / seen if seen > 0 else error / len(lights)
    if not math.isfinite(result.sum()):
        result[COST] = np.nan
    return result


@compiled
def _is_wide(lights: Array) -> bool:
    """Whether the images of lights (n, 7) spread by more than their noise along the direction of least spread.

    The smaller eigenvalue of the scatter Σ (u - ū)(u - ū)ᵀ is above Σ σ², which noise alone gives.
    """
    if len(lights) < 3:
        return False
    u, v = lights[:, PIXEL] - lights[:, PIXEL].mean(), lights[:, PIXEL + 1] - lights[:, PIXEL + 1].mean()
    uu, uv, vv, noise = (u * u).sum(), (u * v).sum(), (v * v).sum(), (lights[:, SIGMA] ** 2).sum()
    # The product of both eigenvalues is the determinant; a difference would lose the small one beside the large one.
    larger = 0.5 * (uu + vv) + math.sqrt((0.5 * (uu - vv)) ** 2 + uv * uv)
    return larger > noise and uu * vv - uv * uv > noise * larger


@compiled
def refine(
    start: Array, lights: Array, terms: Array, prior: Array, prior_weight: Array, decrement: float
) -> tuple[bool, Array, Array, Array, float]:
    """Refine a pose (r, t) (6,) on the weighted reprojection error and a prior of r.

    Args:
        start: (6,) pose to start from.
        lights: (n, 7) table as in `solve_from`.
        terms: (10,) as in `solve_from`.
        prior: (3,) rotation vector.
        prior_weight: (3, 3) W of its cost (r - prior)ᵀ W (r - prior), zeros for none.
        decrement: expected fall of χ² at which to stop.

    Returns:
        Whether it ended well; the pose; residuals (n, 2) of the last pose that was evaluated; lower Cholesky factor
        (6, 6) of JᵀWJ, prior included; χ².
    """
    count = len(lights)
    best, trial = start.copy(), start.copy()
    residual, difference = np.zeros((count, 2)), np.zeros((count, 2))
    jacobian = np.zeros((count, 2, 6))
    normal, gradient, factor, step = np.zeros((6, 6)), np.zeros(6), np.zeros((6, 6)), np.zeros(6)
    damping, cost = 0.0, math.inf
    for _ in range(_MAX_ITERATIONS):
        _project(trial, lights, terms, difference, jacobian)
        trial_cost = 0.0
        for i in range(count):
            for axis in range(2):
                difference[i, axis] -= lights[i, PIXEL + axis]
                trial_cost += (difference[i, axis] / lights[i, SIGMA]) ** 2
        for i in range(3):
            for j in range(3):
                trial_cost += (trial[i] - prior[i]) * prior_weight[i, j] * (trial[j] - prior[j])
        if not math.isfinite(trial_cost):
            return False, best, residual, factor, cost
        if trial_cost <= cost:
            cost = trial_cost
            for i in range(6):
                best[i] = trial[i]
            for i in range(count):
                residual[i, 0], residual[i, 1] = difference[i, 0], difference[i, 1]
            damping *= 0.1
            _normal_equations(jacobian, difference, lights, best, prior, prior_weight, normal, gradient)
        else:
            damping = max(10.0 * damping, 1e-3)
        for i in range(6):
            for j in range(6):
                factor[i, j] = normal[i, j]
            if damping > 1e-9:
                factor[i, i] += damping * normal[i, i]
        if not factorise(factor):
            damping = max(10.0 * damping, 1e-3)
            continue
        for i in range(6):
            step[i] = gradient[i]
        solve(factor, step)
        # The expected fall of χ²: the square of the step in units of the pose's standard deviation.
        fall = 0.0
        for i in range(6):
            trial[i] = best[i] - step[i]
            fall += gradient[i] * step[i]
        if fall < decrement and damping <= 1e-9:
            # Undamped, so the factor is that of the normal matrix itself.
            return trial[5] > 0.0, trial, residual, factor, cost
    return factorise(normal) and best[5] > 0.0, best, residual, normal, cost


@compiled
def _normal_equations(
    jacobian: Array,
    difference: Array,
    lights: Array,
    pose: Array,
    prior: Array,
    prior_weight: Array,
    normal: Array,
    gradient: Array,
) -> None:
    """Put JᵀWJ and JᵀW times the residuals, prior included, into `normal` (6, 6) and `gradient` (6,)."""
    for i in range(6):
        gradient[i] = 0.0
        for j in range(6):
            normal[i, j] = 0.0
    for i in range(3):
        for j in range(3):
            normal[i, j] = prior_weight[i, j]
            gradient[i] += prior_weight[i, j] * (pose[j] - prior[j])
    for k in range(len(lights)):
        weight = 1.0 / lights[k, SIGMA] ** 2
        for axis in range(2):
            for i in range(6):
                gradient[i] += weight * jacobian[k, axis, i] * difference[k, axis]
                for j in range(i + 1):
                    normal[i, j] += weight * jacobian[k, axis, i] * jacobian[k, axis, j]
    for i in range(6):
        for j in range(i):
            normal[j, i] = normal[i, j]


@compiled
def _project(pose: Array, lights: Array, terms: Array, image: Array, jacobian: Array) -> None:
    """Put the pixels (n, 2) of lights (n, 3 or more) under a pose (6,) into `image`, derivatives into (n, 2, 6)."""
    rotation, left = rotation_of(pose[:3]), left_jacobian(pose[:3])
    fx, fy = terms[FX], terms[FY]
    turned, by_r, by_y = np.empty(3), np.empty((3, 3)), np.zeros((2, 3))
    for n in range(len(lights)):
        for i in range(3):
            turned[i] = rotation[i, 0] * lights[n, 0] + rotation[i, 1] * lights[n, 1] + rotation[i, 2] * lights[n, 2]
        depth = turned[2] + pose[5]
        per_m = 1.0 / depth if depth != 0.0 else 1.0
        x, y = (turned[0] + pose[3]) * per_m, (turned[1] + pose[4]) * per_m
        image[n, 0], image[n, 1] = pixel_of(x, y, terms)
        xx, yy, xy = slopes(x, y, terms)
        by_y[0, 0], by_y[0, 1] = fx * xx * per_m, fx * (xy * per_m)
        by_y[1, 0], by_y[1, 1] = fy * (xy * per_m), fy * yy * per_m
        for axis in range(2):
            by_y[axis, 2] = -by_y[axis, 0] * x - by_y[axis, 1] * y
        # -[R X] J_l, column by column.
        for j in range(3):
            by_r[0, j], by_r[1, j], by_r[2, j] = cross(
                left[0, j], left[1, j], left[2, j], turned[0], turned[1], turned[2]
            )
        for axis in range(2):
            for j in range(3):
                jacobian[n, axis, j] = (
                    by_y[axis, 0] * by_r[0, j] + by_y[axis, 1] * by_r[1, j] + by_y[axis, 2] * by_r[2, j]
                )
                jacobian[n, axis, 3 + j] = by_y[axis, j]


@compiled
def _put_covariance(pose: Array, rotation: Array, factor: Array, result: Array) -> None:
    """Put the covariance (6, 6) of (camera position in the station, small rotation in the camera frame) into a result.

    With Σ = (JᵀWJ)⁻¹ over (r, t), δ = J_l(r) dr a small rotation of the camera axes: d(position) =
    -Rᵀ (dt + t × δ), and the camera turns by -δ.

    Args:
        pose: (6,) r and t.
        rotation: (3, 3) R.
        factor: (6, 6) lower Cholesky factor of JᵀWJ.
        result: as `solve_from` returns it.
    """
    left = left_jacobian(pose[:3])
    to = np.zeros((6, 6))
    for j in range(3):
        a, b, c = cross(pose[3], pose[4], pose[5], left[0, j], left[1, j], left[2, j])
        for i in range(3):
            to[i, j] = -(rotation[0, i] * a + rotation[1, i] * b + rotation[2, i] * c)
            to[i, 3 + j] = -rotation[j, i]
            to[3 + i, j] = -left[i, j]
    # With L Lᵀ = JᵀWJ and M = L⁻¹ toᵀ the covariance is Mᵀ M.
    for row in range(6):
        forward(factor, to[row])
    for i in range(6):
        for j in range(i + 1):
            value = 0.0
            for k in range(6):
                value += to[i, k] * to[j, k]
            result[COVARIANCE + 6 * i + j] = result[COVARIANCE + 6 * j + i] = value
