"""OpenCV's geometric solvers behind one door: finite numbers or None, whatever goes in.

OpenCV answers input that determines no pose in many ways: an exception (SQPnP for points that nearly coincide, every
solver for too few), NaN called a success, or a pose at any distance. Here all of that is "no pose". Whether a pose that
does come out is a believable one is for its caller, who knows the noise: see its covariance and reprojection error.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, IntArray

__all__ = ["Solved", "homography", "project", "ransac", "solve_pnp", "solve_square", "spans"]

_UPRIGHT = np.eye(3)
_MAX_TANGENT = 1e3
"""A ray 0.06° or less from the image plane is none that a lens sees."""
_MAX_SIZE_M = 1e6
_THIN = 1e-9
"""Points whose spread across is below this share of that along lie on one line, rounding apart."""


class Solved(NamedTuple):
    """A pose p_camera = R p + t of finite numbers.

    Attributes:
        rotation_vector: (3,) Rodrigues vector of R.
        translation_m: (3,) t.
    """

    rotation_vector: Array
    translation_m: Array


def spans(points_m: Array, xy: Array, least_n: int) -> bool:
    """Whether correspondences may determine a pose at all: finite, enough of them, on one line in neither space.

    Args:
        points_m: (n, 3) points of the object.
        xy: (n, 2) their images in normalised coordinates.
        least_n: the fewest that the solver takes.
    """
    if len(points_m) != len(xy) or len(points_m) < max(least_n, 3):
        return False
    # Not `>` the other way round: a NaN fails both.
    if not (np.abs(points_m).max() < _MAX_SIZE_M and np.abs(xy).max() < _MAX_TANGENT):
        return False
    return _is_wide(points_m) and _is_wide(xy)


def solve_pnp(points_m: Array, xy: Array, flags: int, least_n: int) -> Solved | None:
    """`cv2.solvePnP` on normalised coordinates; None where it finds no pose. Arguments as those of `spans`.

    Args:
        points_m: (n, 3) points of the object.
        xy: (n, 2) their images.
        flags: the solver, `cv2.SOLVEPNP_...`.
        least_n: the fewest points that it takes.
    """
    if not spans(points_m, xy, least_n):
        return None
    try:
        ok, rotation, translation = cv2.solvePnP(points_m, xy, _UPRIGHT, None, flags=flags)
    except cv2.error:
        return None
    return _finite(rotation, translation) if ok else None


def solve_square(square_m: Array, xy: Array) -> list[Solved]:
    """The up to two poses of a square by IPPE (Collins & Bartoli 2014), those in front of the camera.

    Args:
        square_m: (4, 3) corners in the order of `cv2.SOLVEPNP_IPPE_SQUARE`.
        xy: (4, 2) their images in normalised coordinates.
    """
    if not spans(square_m, xy, 4):
        return []
    try:
        count, rotations, translations, _ = cv2.solvePnPGeneric(
            square_m, xy, _UPRIGHT, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    found = [_finite(rotations[index], translations[index]) for index in range(count)]
    return [pose for pose in found if pose is not None and pose.translation_m[2] > 0.0]


def ransac(points_m: Array, xy: Array, *, iterations: int, error: float) -> IntArray | None:
    """(k,) indices, in order, of the correspondences on which `cv2.solvePnPRansac` with P3P agrees; None for no pose.

    Args:
        points_m: (n, 3) points of the object, n ≥ 4.
        xy: (n, 2) their images in normalised coordinates.
        iterations: how many samples are drawn at most.
        error: greatest reprojection error of one that agrees, in normalised coordinates.
    """
    if not spans(points_m, xy, 4):
        return None
    try:
        ok, rotation, translation, inliers = cv2.solvePnPRansac(
            points_m,
            xy,
            _UPRIGHT,
            None,
            iterationsCount=iterations,
            reprojectionError=error,
            flags=cv2.SOLVEPNP_P3P,
        )
    except cv2.error:
        return None
    # Stubs do not say that there may be no inliers.
    kept: Any = inliers
    if not ok or kept is None or _finite(rotation, translation) is None:
        return None
    return np.sort(np.asarray(kept, dtype=np.int64).ravel())


def project(
    points_m: Array, rotation_vector: Array, translation_m: Array, matrix: Array, distortion: Array
) -> tuple[Array, Array]:
    """`cv2.projectPoints`, of no points too: pixels (n, 2) and OpenCV's Jacobian (2 n, 10 or more).

    Args:
        points_m: (n, 3).
        rotation_vector: (3,) of the pose.
        translation_m: (3,) of the pose.
        matrix: (3, 3) of the camera.
        distortion: (5,) of the camera.
    """
    if len(points_m) == 0:
        return np.zeros((0, 2)), np.zeros((0, 10 + len(distortion)))
    pixels, jacobian = cv2.projectPoints(points_m, rotation_vector, translation_m, matrix, distortion)
    return np.asarray(pixels, dtype=np.float64).reshape(-1, 2), np.asarray(jacobian, dtype=np.float64)


def homography(quad: Array, target: Array) -> Array | None:
    """(3, 3) perspective map of four points (4, 2) onto four others; None where one of either lies on others' line."""
    for corners in (quad, target):
        if not np.abs(corners).max() < _MAX_SIZE_M:
            return None
        around = np.concatenate([corners, corners[:2]])
        a, b = around[1:5] - around[:4], around[2:] - around[1:5]
        size = float((a * a).sum())
        if not np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).min() > _THIN * size:
            return None
    try:
        warp = cv2.getPerspectiveTransform(quad.astype(np.float32), target.astype(np.float32))
    except cv2.error:
        return None
    warp = np.asarray(warp, dtype=np.float64)
    return warp if np.isfinite(warp).all() else None


def _is_wide(points: Array) -> bool:
    """Whether points (n, d) spread in two directions."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[0] > 1e-12 and spread[1] > _THIN * spread[0])


def _finite(rotation: NDArray[Any], translation: NDArray[Any]) -> Solved | None:
    pose = Solved(
        np.asarray(rotation, dtype=np.float64).ravel(),
        np.asarray(translation, dtype=np.float64).ravel(),
    )
    return pose if np.isfinite(pose.rotation_vector).all() and np.isfinite(pose.translation_m).all() else None
