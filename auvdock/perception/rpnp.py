"""RPnP, the robust non-iterative solution of the perspective-n-point problem, n ≥ 4 (Li, Xu & Xie 2012).

S. Li, C. Xu, M. Xie, "A robust O(n) solution to the perspective-n-point problem", IEEE TPAMI 34(7), 2012; paper C,
section 3.4.2. The longest side P_i0 P_j0 of the points is the rotation axis. With each of the other n - 2 points it
makes a three-point problem in one common unknown x, here the ratio of the depths of P_j0 and P_i0 along their rays (the
authors' unknown differs, the quartics serve the same purpose):

    d² (1 + x² - 2 x cos γ) = |P_i0 P_j0|²,    f_k(x) = a_k x⁴ + b_k x³ + c_k x² + d_k x + e_k = 0.

The minima of F = Σ f_k² are among the real roots of F' = 2 Σ f_k f_k', of seventh degree (eigenvalues of its companion
matrix). Each gives the axis in the camera frame; the angle about it (c = cos α, s = sin α) and the translation t follow
linearly from the 2n image coordinates: A [c, s, t_x, t_y, t_z, 1]ᵀ = 0 by singular value decomposition. The best by
reprojection wins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.perception.solvers import spans

__all__ = ["RpnpPose", "rpnp", "rpnp_poses"]

_IMAGINARY = 1e-3
"""A root of F' whose imaginary part is below this share of it counts as real: a double root of exact data splits into
a pair with an imaginary part of the square root of rounding."""
_POLISH = 5


@dataclass(frozen=True, eq=False)
class RpnpPose:
    """A pose p_camera = R p + t.

    Attributes:
        rotation: (3, 3) R.
        translation_m: (3,) t.
        error: root mean square of the reprojection error in normalised image coordinates.
    """

    rotation: Array
    translation_m: Array
    error: float


def rpnp(points_m: Array, xy: Array, *, polish: bool = True) -> RpnpPose | None:
    """The pose of n ≥ 4 points, None where there is none.

    Three points have up to four poses that all reproject exactly, so the answer for them is None; `rpnp_poses` lists
    the candidates for a caller who can choose. None also for points that coincide or lie on one line, and where every
    pose has points behind the camera.

    Args:
        points_m: (n, 3) points in the object's frame.
        xy: (n, 2) their undistorted normalised image coordinates, x/z and y/z.
        polish: a few Gauss-Newton steps on the reprojection error at the end, which the authors do not take: their
            last steps are linear and weigh near and far points alike.
    """
    if len(points_m) < 4:
        return None
    poses = rpnp_poses(points_m, xy)
    if not poses:
        return None
    if not polish:
        return poses[0]
    # A mirrored pose of a plane may reproject nearly as well.
    return min((_polish(points_m, xy, pose) for pose in poses[:2]), key=lambda pose: pose.error)


def rpnp_poses(points_m: Array, xy: Array) -> list[RpnpPose]:
    """All candidate poses of n ≥ 3 points, best reprojection first; empty for degenerate points.

    Raises:
        ValueError: arrays that do not fit each other.
    """
    n = len(points_m)
    check_shape("points_m", points_m, (n, 3))
    check_shape("xy", xy, (n, 2))
    if not spans(points_m, xy, 3):
        return []
    axis = _rotation_axis(points_m)
    if axis is None:
        return []
    i, j = axis
    rays = np.column_stack([xy, np.ones(n)])
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    poses: list[RpnpPose] = []
    for ratio in _depth_ratios(points_m, rays, i, j):
        pose = _pose(points_m, xy, rays, i, j, ratio)
        if pose is not None and not any(_same(pose, other) for other in poses):
            poses.append(pose)
    poses.sort(key=lambda pose: pose.error)
    return poses


def _rotation_axis(points: Array) -> tuple[int, int] | None:
    """Ends of the longest side; None if the points coincide or lie on one line."""
    offset = points[:, None, :] - points[None, :, :]
    length = (offset * offset).sum(axis=2)
    i, j = divmod(int(length.argmax()), len(points))
    if not length[i, j] > 0.0:
        return None
    along = (points[j] - points[i]) / math.sqrt(float(length[i, j]))
    across = points - points[i]
    across = across - np.outer(across @ along, along)
    return (i, j) if float((across * across).sum(axis=1).max()) > 1e-12 * float(length[i, j]) else None


def _quartics(points: Array, rays: Array, i: int, j: int) -> Array:
    """(n - 2, 5) coefficients of f_k, highest power first.

    With d the depth of P_i0 along its ray, x d that of P_j0 and y d that of P_k, the law of cosines gives
    1 + y² - 2 q y = A S and x² + y² - 2 r x y = B S, S = 1 + x² - 2 p x, A and B the squared sides from P_i0 and P_j0
    to P_k over |P_i0 P_j0|². The difference is linear in y: y = N / D with N = (A - B) S - 1 + x², D = 2 (r x - q);
    inserted into the first, f = D² (1 - A S) + N² - 2 q N D.
    """
    others = [k for k in range(len(points)) if k not in (i, j)]
    side = float(((points[j] - points[i]) ** 2).sum())
    a = ((points[others] - points[i]) ** 2).sum(axis=1) / side
    b = ((points[others] - points[j]) ** 2).sum(axis=1) / side
    p = float(rays[i] @ rays[j])
    q, r = rays[others] @ rays[i], rays[others] @ rays[j]
    zero = np.zeros(len(others))
    s = np.array([1.0, -2.0 * p, 1.0])
    numerator = (a - b)[:, None] * s + np.array([1.0, 0.0, -1.0])
    denominator = np.column_stack([zero, 2.0 * r, -2.0 * q])
    first = _product(_product(denominator, denominator)[:, 2:], np.array([0.0, 0.0, 1.0]) - a[:, None] * s)
    second = _product(numerator, numerator) - 2.0 * q[:, None] * _product(numerator, denominator)
    return first + second


def _product(a: Array, b: Array) -> Array:
    """(n, i + j - 1) products of n pairs of polynomials (n, i) and (n, j)."""
    product = np.zeros((len(a), a.shape[1] + b.shape[1] - 1))
    for power in range(a.shape[1]):
        product[:, power : power + b.shape[1]] += a[:, power : power + 1] * b
    return product


def _depth_ratios(points: Array, rays: Array, i: int, j: int) -> list[float]:
    """Positive x at the minima of F."""
    quartics = _quartics(points, rays, i, j)
    if len(quartics) == 1:
        # With three points the minima of F are the roots of the one quartic, and better found as such.
        return [float(x.real) for x in np.roots(quartics[0]) if x.real > 0.0 and abs(x.imag) <= _IMAGINARY * abs(x)]
    derivative = quartics[:, :4] * np.array([4.0, 3.0, 2.0, 1.0])
    slope = _product(quartics, derivative).sum(axis=0)
    scale = float(np.abs(slope).max())
    if not scale > 0.0:
        return []
    slope = slope / scale
    curvature = np.polyder(slope)
    found: list[float] = []
    for root in np.roots(slope):
        x = float(root.real)
        if abs(root.imag) > _IMAGINARY * max(abs(x), 1e-9) or x <= 0.0:
            continue
        if float(np.polyval(curvature, x)) >= -1e-6:
            found.append(x)
    return found


def _pose(points: Array, xy: Array, rays: Array, i: int, j: int, ratio: float) -> RpnpPose | None:
    """Angle about the axis and translation for one depth ratio."""
    span = points[j] - points[i]
    length = float(np.linalg.norm(span))
    square = 1.0 + ratio * ratio - 2.0 * ratio * float(rays[i] @ rays[j])
    if square <= 1e-15:
        return None
    depth = length / math.sqrt(square)
    seen = depth * (ratio * rays[j] - rays[i])
    frame_object = _frame_along(span / length)
    frame_camera = _frame_along(seen / np.linalg.norm(seen))
    # Coordinates about the middle of the side, axis first: R X = F_c Rot_x(α) F_oᵀ X.
    local = (points - 0.5 * (points[i] + points[j])) @ frame_object
    fixed = np.outer(local[:, 0], frame_camera[:, 0])
    cosine = local[:, 1:2] * frame_camera[:, 1] + local[:, 2:3] * frame_camera[:, 2]
    sine = local[:, 1:2] * frame_camera[:, 2] - local[:, 2:3] * frame_camera[:, 1]
    n = len(points)
    system = np.zeros((2 * n, 6))
    for axis in range(2):
        rows, image = slice(axis, None, 2), xy[:, axis]
        system[rows, 0] = cosine[:, axis] - image * cosine[:, 2]
        system[rows, 1] = sine[:, axis] - image * sine[:, 2]
        system[rows, 2 + axis] = 1.0
        system[rows, 4] = -image
        system[rows, 5] = fixed[:, axis] - image * fixed[:, 2]
    null = np.linalg.svd(system)[2][-1]
    if abs(null[5]) < 1e-12:
        return None
    c, s = (null[:2] / null[5]).tolist()
    norm = math.hypot(c, s)
    if norm < 1e-9:
        return None
    c, s = c / norm, s / norm
    rotation = frame_camera @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]) @ frame_object.T
    return _align(points, xy, rays, rotation, null[2:5] / null[5] - rotation @ (0.5 * (points[i] + points[j])))


def _align(points: Array, xy: Array, rays: Array, rotation: Array, translation: Array) -> RpnpPose | None:
    """The rigid motion onto the points along their rays at the depths found (Li et al., the last step).

    The points at their distances along the observed rays are aligned with the object by orthogonal Procrustes
    analysis.
    """
    pose = _judge(points, xy, rotation, translation)
    camera = points @ rotation.T + translation
    target = np.linalg.norm(camera, axis=1)[:, None] * rays
    middle = target.mean(axis=0)
    u, _, vt = np.linalg.svd((target - middle).T @ (points - points.mean(axis=0)))
    rotation = u @ np.diag([1.0, 1.0, float(np.linalg.det(u @ vt))]) @ vt
    better = _judge(points, xy, rotation, middle - rotation @ points.mean(axis=0))
    return better if better is not None and (pose is None or better.error < pose.error) else pose


def _polish(points: Array, xy: Array, pose: RpnpPose) -> RpnpPose:
    """Gauss-Newton on the reprojection error, as long as it falls."""
    for _ in range(_POLISH):
        q = points @ pose.rotation.T + pose.translation_m
        inverse = 1.0 / q[:, 2]
        u, v = q[:, 0] * inverse, q[:, 1] * inverse
        # dq = dt + dr × R p, with r in the camera frame about the object's origin.
        arm = q - pose.translation_m
        zero = np.zeros(len(q))
        du = np.column_stack([inverse, zero, -u * inverse])
        dv = np.column_stack([zero, inverse, -v * inverse])
        jacobian = np.vstack([np.hstack([np.cross(arm, du), du]), np.hstack([np.cross(arm, dv), dv])])
        residual = np.concatenate([u - xy[:, 0], v - xy[:, 1]])
        step = -np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        turn = np.asarray(cv2.Rodrigues(step[:3])[0], dtype=np.float64)
        better = _judge(points, xy, turn @ pose.rotation, pose.translation_m + step[3:])
        if better is None or better.error >= pose.error:
            break
        small = better.error > 0.999 * pose.error
        pose = better
        if small:
            break
    return pose


def _judge(points: Array, xy: Array, rotation: Array, translation: Array) -> RpnpPose | None:
    camera = points @ rotation.T + translation
    if not (np.isfinite(camera).all() and bool((camera[:, 2] > 1e-9).all())):
        return None
    residual = camera[:, :2] / camera[:, 2:] - xy
    return RpnpPose(rotation, translation, math.sqrt(float((residual * residual).sum(axis=1).mean())))


def _frame_along(axis: Array) -> Array:
    """(3, 3) right-handed frame whose first column is a unit vector."""
    helper = np.zeros(3)
    helper[int(np.abs(axis).argmin())] = 1.0
    second = np.cross(axis, helper)
    second /= np.linalg.norm(second)
    return np.column_stack([axis, second, np.cross(axis, second)])


def _same(a: RpnpPose, b: RpnpPose) -> bool:
    near = 1e-9 * (1.0 + float(np.abs(b.translation_m).max()))
    return float(np.abs(a.rotation - b.rotation).max()) < 1e-9 and bool(
        np.abs(a.translation_m - b.translation_m).max() < near
    )
