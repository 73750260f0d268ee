"""Levenberg–Marquardt on the reprojection error, and all that follows from its result: the loops of `perception.pnp`.

With y = R X + t, R = exp([r]): ∂y/∂t = 1 and ∂y/∂r = -[R X] J_l(r), J_l the left Jacobian of the rotation group
(Barfoot 2017, equation 7.77). The image of y is OpenCV's: pinhole, three radial and two tangential terms.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.cholesky import factorise, forward, solve
from auvdock.numeric.compiled import compiled
from auvdock.numeric.lens import FX, FY, pixel_of, slopes
from auvdock.numeric.lights import Light, Pose, Solution
from auvdock.numeric.records import Records
from auvdock.numeric.rotations import left_jacobian, rotation_of, vector_of
from auvdock.numeric.scalars import cross

__all__ = ["Refined", "image_lights", "refine", "solve_from"]

_MAX_ITERATIONS = 20


class Refined(NamedTuple):
    """What `refine` finds.

    Attributes:
        good: whether it ended well.
        pose: (6,) r and t.
        residual: (n, 2) of the last pose that was evaluated, px.
        factor: (6, 6) lower Cholesky factor of JᵀWJ, prior included.
        cost: χ².
    """

    good: bool
    pose: Array
    residual: Array
    factor: Array
    cost: float


@compiled
def solve_from(
    start: Records[Pose],
    lights: Records[Light],
    prior: Array,
    lens: Array,
    tilt_weight: float,
    heading_weight: float,
    decrement: float,
    solution: Records[Solution],
) -> None:
    """Refine a pose and tell all that is asked about it.

    The cost of an attitude other than the prior's is (r - r₀)ᵀ J_lᵀ W J_l (r - r₀), with W = w of a small rotation
    about any axis, or w_h about the station's upright one.

    Args:
        start: (1,) pose to start from.
        lights: (n,) lights.
        prior: (3, 3) R of the vehicle's own attitude.
        lens: (9,) of the camera, as `numeric.lens` names it.
        tilt_weight: w, 0 for no prior.
        heading_weight: w_h, at most w.
        decrement: expected fall of χ² at which to stop.
        solution: (1,) where the solution goes, its cost nan where it does not end well: where the lights coincide or
            lie on one line, their noise considered, or where a number is not finite.
    """
    found = solution[0]
    found.cost = np.nan
    if not _is_wide(lights):
        return
    first, expected, weight = np.empty(6), np.zeros(3), np.zeros((3, 3))
    for i in range(3):
        first[i], first[3 + i] = start[0].rotation_vector[i], start[0].translation_m[i]
    if tilt_weight > 0.0:
        for i in range(3):
            weight[i, i] = tilt_weight
            for j in range(3):
                weight[i, j] += (heading_weight - tilt_weight) * (prior[i, 2] * prior[j, 2])
        expected = vector_of(prior)
        left = left_jacobian(expected)
        weight = left.T @ weight @ left
    refined = refine(first, lights, lens, expected, weight, decrement)
    if not refined.good:
        return
    seen, error, error_seen, found.lights_cost = 0, 0.0, 0.0, 0.0
    for i in range(len(lights)):
        distance_px = math.hypot(refined.residual[i, 0], refined.residual[i, 1])
        found.lights_cost += (distance_px / lights[i].sigma_px) ** 2
        error += distance_px
        if lights[i].is_seen:
            seen += 1
            error_seen += distance_px
    found.error_px = error_seen / seen if seen > 0 else error / len(lights)
    if math.isfinite(error) and _describe(refined, prior, found):
        found.cost = refined.cost


@compiled
def _describe(refined: Refined, prior: Array, solution: Solution) -> bool:
    """Put the pose, what it means for the camera, its covariance and its angle to the prior in; whether all is finite.

    With Σ = (JᵀWJ)⁻¹ over (r, t), δ = J_l(r) dr a small rotation of the camera axes: d(position) =
    -Rᵀ (dt + t × δ), and the camera turns by -δ.
    """
    r, t = refined.pose[:3], refined.pose[3:]
    rotation, left, to = rotation_of(r), left_jacobian(r), np.zeros((6, 6))
    trace = 0.0
    for i in range(3):
        solution.pose.rotation_vector[i], solution.pose.translation_m[i] = r[i], t[i]
        for j in range(3):
            solution.rotation[i, j], solution.T_station_camera[i, j] = rotation[i, j], rotation[j, i]
            trace += rotation[i, j] * prior[i, j]
        solution.T_station_camera[i, -1] = -(rotation[0, i] * t[0] + rotation[1, i] * t[1] + rotation[2, i] * t[2])
    solution.T_station_camera[-1, -1] = 1.0
    solution.attitude_error_rad = math.acos(max(-1.0, min(1.0, (trace - 1.0) / 2.0)))
    for j in range(3):
        a, b, c = cross(t[0], t[1], t[2], left[0, j], left[1, j], left[2, j])
        for i in range(3):
            to[i, j] = -(rotation[0, i] * a + rotation[1, i] * b + rotation[2, i] * c)
            to[i, 3 + j] = -rotation[j, i]
            to[3 + i, j] = -left[i, j]
    # With L Lᵀ = JᵀWJ and M = L⁻¹ toᵀ the covariance is Mᵀ M.
    for row in range(6):
        forward(refined.factor, to[row])
    total = 0.0
    for i in range(6):
        total += refined.pose[i]
        for j in range(i + 1):
            value = 0.0
            for k in range(6):
                value += to[i, k] * to[j, k]
            solution.covariance[i, j] = solution.covariance[j, i] = value
            total += value
    return math.isfinite(total)


@compiled
def _is_wide(lights: Records[Light]) -> bool:
    """Whether the images of lights (n,) spread by more than their noise along the direction of least spread.

    The smaller eigenvalue of the scatter Σ (u - ū)(u - ū)ᵀ is above Σ σ², which noise alone gives.
    """
    n = len(lights)
    if n < 3:
        return False
    mean_u = mean_v = uu = uv = vv = noise = 0.0
    for i in range(n):
        mean_u += lights[i].centre_px[0]
        mean_v += lights[i].centre_px[1]
    mean_u, mean_v = mean_u / n, mean_v / n
    for i in range(n):
        u, v = lights[i].centre_px[0] - mean_u, lights[i].centre_px[1] - mean_v
        uu += u * u
        uv += u * v
        vv += v * v
        noise += lights[i].sigma_px ** 2
    # The product of both eigenvalues is the determinant; a difference would lose the small one beside the large one.
    larger = 0.5 * (uu + vv) + math.sqrt((0.5 * (uu - vv)) ** 2 + uv * uv)
    return larger > noise and uu * vv - uv * uv > noise * larger


@compiled
def refine(
    start: Array, lights: Records[Light], lens: Array, prior: Array, prior_weight: Array, decrement: float
) -> Refined:
    """Refine a pose (r, t) (6,) on the weighted reprojection error and a prior of r.

    Args:
        start: (6,) pose to start from.
        lights: (n,) lights.
        lens: (9,) as in `solve_from`.
        prior: (3,) rotation vector.
        prior_weight: (3, 3) W of its cost (r - prior)ᵀ W (r - prior), zeros for none.
        decrement: expected fall of χ² at which to stop.
    """
    count = len(lights)
    best, trial = start.copy(), start.copy()
    residual, difference = np.zeros((count, 2)), np.zeros((count, 2))
    jacobian = np.zeros((count, 2, 6))
    normal, gradient, factor, step = np.zeros((6, 6)), np.zeros(6), np.zeros((6, 6)), np.zeros(6)
    damping, cost = 0.0, math.inf
    for _ in range(_MAX_ITERATIONS):
        image_lights(trial, lights, lens, difference, jacobian)
        trial_cost = 0.0
        for i in range(count):
            for axis in range(2):
                difference[i, axis] -= lights[i].centre_px[axis]
                trial_cost += (difference[i, axis] / lights[i].sigma_px) ** 2
        for i in range(3):
            for j in range(3):
                trial_cost += (trial[i] - prior[i]) * prior_weight[i, j] * (trial[j] - prior[j])
        if not math.isfinite(trial_cost):
            return Refined(False, best, residual, factor, cost)
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
            return Refined(trial[-1] > 0.0, trial, residual, factor, cost)
    return Refined(factorise(normal) and best[-1] > 0.0, best, residual, normal, cost)


@compiled
def _normal_equations(
    jacobian: Array,
    difference: Array,
    lights: Records[Light],
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
        weight = 1.0 / lights[k].sigma_px ** 2
        for axis in range(2):
            for i in range(6):
                gradient[i] += weight * jacobian[k, axis, i] * difference[k, axis]
                for j in range(i + 1):
                    normal[i, j] += weight * jacobian[k, axis, i] * jacobian[k, axis, j]
    for i in range(6):
        for j in range(i):
            normal[j, i] = normal[i, j]


@compiled
def image_lights(pose: Array, lights: Records[Light], lens: Array, image: Array, jacobian: Array) -> None:
    """Put the pixels (n, 2) of lights under a pose (6,) into `image`, their derivatives by it into (n, 2, 6)."""
    r, t = pose[:3], pose[3:]
    rotation, left = rotation_of(r), left_jacobian(r)
    fx, fy = lens[FX], lens[FY]
    turned, by_r, by_y = np.empty(3), np.empty((3, 3)), np.zeros((2, 3))
    for n in range(len(lights)):
        place = lights[n].place_m
        for i in range(3):
            turned[i] = rotation[i, 0] * place[0] + rotation[i, 1] * place[1] + rotation[i, 2] * place[2]
        depth = turned[2] + t[2]
        per_m = 1.0 / depth if depth != 0.0 else 1.0
        x, y = (turned[0] + t[0]) * per_m, (turned[1] + t[1]) * per_m
        image[n, 0], image[n, 1] = pixel_of(x, y, lens)
        xx, yy, xy = slopes(x, y, lens)
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
