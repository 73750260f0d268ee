"""Levenberg–Marquardt on the reprojection error, and all that follows from its result: the loops of `perception.pnp`.

With y = R X + t, R = exp([r]): ∂y/∂t = 1 and ∂y/∂r = -[R X] J_l(r), J_l the left Jacobian of the rotation group
(Barfoot 2017, equation 7.77). The image of y is OpenCV's: pinhole, three radial and two tangential terms.

Lights come as one table and results go as one array: Numba takes and gives that at a fraction of what many cost.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = [
    "ATTITUDE",
    "COST",
    "COVARIANCE",
    "ERROR",
    "PIXEL",
    "RESIDUAL",
    "ROTATION",
    "SEEN",
    "SIGMA",
    "TRANSFORM",
    "TRANSLATION",
    "left_jacobian",
    "refine",
    "rotation_of",
    "solve_from",
    "vector_of",
]

PIXEL, SIGMA, SEEN = 3, 5, 6
"""Columns of a table of lights after X, Y, Z: u and v, σ of either, and 1 or 0 for seen or predicted."""
TRANSLATION, ROTATION, TRANSFORM, COVARIANCE, ATTITUDE, COST, ERROR, RESIDUAL = 3, 6, 15, 31, 67, 68, 69, 70
"""Where a result's parts begin, after the rotation vector."""
_FX, _FY, _CX, _CY, _K1, _K2, _P1, _P2, _K3, _PRIOR_WEIGHT = range(10)
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
        if not _cholesky(factor):
            damping = max(10.0 * damping, 1e-3)
            continue
        for i in range(6):
            step[i] = gradient[i]
        _substitute(factor, step)
        # The expected fall of χ²: the square of the step in units of the pose's standard deviation.
        fall = 0.0
        for i in range(6):
            trial[i] = best[i] - step[i]
            fall += gradient[i] * step[i]
        if fall < decrement and damping <= 1e-9:
            # Undamped, so the factor is that of the normal matrix itself.
            return trial[5] > 0.0, trial, residual, factor, cost
    return _cholesky(normal) and best[5] > 0.0, best, residual, normal, cost


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
    fx, fy, cx, cy = terms[_FX], terms[_FY], terms[_CX], terms[_CY]
    k1, k2, p1, p2, k3 = terms[_K1], terms[_K2], terms[_P1], terms[_P2], terms[_K3]
    turned, by_r, by_y = np.empty(3), np.empty((3, 3)), np.zeros((2, 3))
    for n in range(len(lights)):
        for i in range(3):
            turned[i] = rotation[i, 0] * lights[n, 0] + rotation[i, 1] * lights[n, 1] + rotation[i, 2] * lights[n, 2]
        depth = turned[2] + pose[5]
        per_m = 1.0 / depth if depth != 0.0 else 1.0
        x, y = (turned[0] + pose[3]) * per_m, (turned[1] + pose[4]) * per_m
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        rise = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2)
        image[n, 0] = fx * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + cx
        image[n, 1] = fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + cy
        xx = fx * (radial + 2.0 * x * x * rise + 2.0 * p1 * y + 6.0 * p2 * x) * per_m
        yy = fy * (radial + 2.0 * y * y * rise + 6.0 * p1 * y + 2.0 * p2 * x) * per_m
        cross = (2.0 * x * y * rise + 2.0 * p1 * x + 2.0 * p2 * y) * per_m
        by_y[0, 0], by_y[0, 1] = xx, fx * cross
        by_y[1, 0], by_y[1, 1] = fy * cross, yy
        for axis in range(2):
            by_y[axis, 2] = -by_y[axis, 0] * x - by_y[axis, 1] * y
        # -[R X] J_l, column by column.
        for j in range(3):
            by_r[0, j] = turned[2] * left[1, j] - turned[1] * left[2, j]
            by_r[1, j] = turned[0] * left[2, j] - turned[2] * left[0, j]
            by_r[2, j] = turned[1] * left[0, j] - turned[0] * left[1, j]
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
    x, y, z = pose[3], pose[4], pose[5]
    to = np.zeros((6, 6))
    for j in range(3):
        a, b, c = y * left[2, j] - z * left[1, j], z * left[0, j] - x * left[2, j], x * left[1, j] - y * left[0, j]
        for i in range(3):
            to[i, j] = -(rotation[0, i] * a + rotation[1, i] * b + rotation[2, i] * c)
            to[i, 3 + j] = -rotation[j, i]
            to[3 + i, j] = -left[i, j]
    # With L Lᵀ = JᵀWJ and M = L⁻¹ toᵀ the covariance is Mᵀ M.
    for row in range(6):
        for i in range(6):
            for k in range(i):
                to[row, i] -= factor[i, k] * to[row, k]
            to[row, i] /= factor[i, i]
    for i in range(6):
        for j in range(i + 1):
            value = 0.0
            for k in range(6):
                value += to[i, k] * to[j, k]
            result[COVARIANCE + 6 * i + j] = result[COVARIANCE + 6 * j + i] = value


@compiled
def rotation_of(vector: Array) -> Array:
    """(3, 3) exp([r]) of a rotation vector (3,) (Rodrigues)."""
    x, y, z = vector[0], vector[1], vector[2]
    angle2 = x * x + y * y + z * z
    angle = math.sqrt(angle2)
    if angle < 1e-8:
        sine, rest = 1.0, 0.5
    else:
        sine, rest = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    rotation = np.empty((3, 3))
    rotation[0, 0], rotation[0, 1] = 1.0 - rest * (y * y + z * z), rest * x * y - sine * z
    rotation[0, 2] = rest * x * z + sine * y
    rotation[1, 0], rotation[1, 1] = rest * x * y + sine * z, 1.0 - rest * (x * x + z * z)
    rotation[1, 2] = rest * y * z - sine * x
    rotation[2, 0], rotation[2, 1] = rest * x * z - sine * y, rest * y * z + sine * x
    rotation[2, 2] = 1.0 - rest * (x * x + y * y)
    return rotation


@compiled
def vector_of(rotation: Array) -> Array:
    """(3,) rotation vector of a rotation matrix; at half a turn that whose first component is not negative."""
    vector = np.empty(3)
    vector[0] = 0.5 * (rotation[2, 1] - rotation[1, 2])
    vector[1] = 0.5 * (rotation[0, 2] - rotation[2, 0])
    vector[2] = 0.5 * (rotation[1, 0] - rotation[0, 1])
    sine = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    cosine = 0.5 * (rotation[0, 0] + rotation[1, 1] + rotation[2, 2] - 1.0)
    if sine > 1e-6:
        vector *= math.atan2(sine, cosine) / sine
    elif cosine < 0.0:
        # R = 2 a aᵀ - 1: from the greatest component of the axis a, known best, follow the others.
        k = 0
        for i in range(1, 3):
            if rotation[i, i] > rotation[k, k]:
                k = i
        for i in range(3):
            vector[i] = 0.25 * (rotation[i, k] + rotation[k, i]) + (0.5 if i == k else 0.0)
        size = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
        vector *= (-math.pi if vector[0] < 0.0 else math.pi) / size
    return vector


@compiled
def left_jacobian(vector: Array) -> Array:
    """(3, 3) J_l with exp([r + dr]) = exp([J_l dr]) exp([r]) to first order (Barfoot 2017, equation 7.77)."""
    x, y, z = vector[0], vector[1], vector[2]
    angle = math.sqrt(x * x + y * y + z * z)
    left = np.eye(3)
    if angle < 1e-8:
        return left
    sine = math.sin(angle) / angle
    a, b, c = x / angle, y / angle, z / angle
    k, h = 1.0 - sine, (1.0 - math.cos(angle)) / angle
    left[0, 0], left[0, 1], left[0, 2] = sine + k * a * a, k * a * b - h * c, k * a * c + h * b
    left[1, 0], left[1, 1], left[1, 2] = k * a * b + h * c, sine + k * b * b, k * b * c - h * a
    left[2, 0], left[2, 1], left[2, 2] = k * a * c - h * b, k * b * c + h * a, sine + k * c * c
    return left


@compiled
def _cholesky(matrix: Array) -> bool:
    """Put the lower factor of a symmetric matrix into its lower triangle; False where it is not positive definite."""
    for i in range(len(matrix)):
        for j in range(i + 1):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            if i > j:
                matrix[i, j] = value / matrix[j, j]
            elif value > 0.0:
                matrix[i, i] = math.sqrt(value)
            else:
                return False
    return True


@compiled
def _substitute(factor: Array, right: Array) -> None:
    """Solve L Lᵀ x = b for a lower factor (n, n), in place of b (n,)."""
    size = len(right)
    for i in range(size):
        for k in range(i):
            right[i] -= factor[i, k] * right[k]
        right[i] /= factor[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            right[i] -= factor[k, i] * right[k]
        right[i] /= factor[i, i]
