"""Corners of a tag to a fraction of a pixel: its four sides as straight lines through sub-pixel edge points."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Frame

__all__ = ["corners_from_lines", "line_through", "refined_corners"]

_CELLS = 8
"""Cells along a side of the black square: six of code and a border at each end."""
_FROM, _TO = 0.08, 0.92
"""Part of each side that is used: blur rounds the corners."""
_STEP_PX = 0.4
_AROUND_PX = 12
_PASSES = 2
_CLOSE_PX = 1.0
"""Corners that moved less need no second pass: the profiles were centred well enough."""
_FLOOR_PX = 0.03
"""Least standard deviation of a corner, ours: interpolation and blur that differs on the two sides of an edge."""


def refined_corners(frame: Frame, corners_px: Array) -> tuple[Array, float] | None:
    """((4, 2) corners in pixels, standard deviation per axis) from corners good to a cell; None without four edges.

    Across each side the edge is where the centre of the gradient of light lies: codes are made linear first, for in a
    root of it black grows into white by a third of a pixel. The lines are fitted to undistorted
    points, where straight sides are straight, and their intersections projected back. A corner is the end of two lines
    of N points with residual σ, so its standard deviation is 2 σ / √N (the end of a regression line).

    Args:
        frame: the image, black square on white.
        corners_px: (4, 2) rough corners, clockwise in the image.
    """
    camera = frame.camera
    light, origin = _light_around(frame, corners_px)
    corners, variance = corners_px, 0.0
    for _ in range(_PASSES):
        lines: list[tuple[Array, Array]] = []
        variance = 0.0
        for side in range(4):
            points = _edge_points(light, origin, corners[side], corners[(side + 1) % 4])
            if points is None:
                return None
            fitted = line_through(camera.normalise(points))
            if fitted is None:
                return None
            point, direction, sigma, count = fitted
            lines.append((point, direction))
            variance = max(variance, 4.0 * sigma * sigma / count)
        found = corners_from_lines(lines, camera)
        if found is None:
            return None
        moved = float(np.abs(found - corners).max())
        corners = found
        if moved < _CLOSE_PX:
            break
    focal = float(camera.matrix[0, 0])
    return corners, math.hypot(_FLOOR_PX, focal * math.sqrt(variance))


def corners_from_lines(lines: list[tuple[Array, Array]], camera: Camera) -> Array | None:
    """(4, 2) pixels where each line (point, direction), normalised, meets the one before it; None for parallels."""
    corners = np.ones((4, 3))
    for side in range(4):
        (p, u), (q, v) = lines[side - 1], lines[side]
        cross = float(u[0] * v[1] - u[1] * v[0])
        if abs(cross) < 0.1:
            return None
        gap = q - p
        corners[side, :2] = p + u * (float(gap[0] * v[1] - gap[1] * v[0]) / cross)
    return camera.project(corners)


def line_through(points: Array) -> tuple[Array, Array, float, int] | None:
    """(point, unit direction, residual's σ, points used) of the line through (n, 2) points; None below four points.

    Total least squares, with what lies beyond three robust deviations left out once.
    """
    for last in (False, True):
        if len(points) < 4:
            return None
        centre = points.mean(axis=0)
        _, _, axes = np.linalg.svd(points - centre, full_matrices=False)
        direction = axes[0]
        across = (points - centre) @ axes[1]
        if last:
            return centre, direction, math.sqrt(float(across @ across) / (len(points) - 2)), len(points)
        spread = 1.4826 * float(np.median(np.abs(across)))
        points = points[np.abs(across) <= 3.0 * spread + 1e-12]
    return None


def _light_around(frame: Frame, corners_px: Array) -> tuple[NDArray[np.float32], Array]:
    """(linear light (h, w) of the brightest channel around the corners, (2,) the patch's first column and row)."""
    height, width = frame.image.shape[:2]
    x0, y0 = np.maximum(np.floor(corners_px.min(axis=0)).astype(int) - _AROUND_PX, 0).tolist()
    x1, y1 = (np.ceil(corners_px.max(axis=0)).astype(int) + _AROUND_PX + 1).tolist()
    patch = frame.image[y0 : min(y1, height), x0 : min(x1, width)]
    channel = int(np.argmax(patch[::8, ::8].reshape(-1, 3).sum(axis=0, dtype=np.int64)))
    codes = np.ascontiguousarray(patch[:, :, channel])
    light = cv2.LUT(codes, frame.response.electrons(frame.gain).astype(np.float32))
    return np.asarray(light, dtype=np.float32), np.array([float(x0), float(y0)])


def _edge_points(light: NDArray[np.float32], origin: Array, start: Array, end: Array) -> Array | None:
    """(n, 2) sub-pixel points of the edge from black to white along one side; None where there is none."""
    side = end - start
    length = float(np.linalg.norm(side))
    if length < 8.0:
        return None
    along = side / length
    # Clockwise in an image whose y points down: outwards is to the left of the way.
    outward = np.array([along[1], -along[0]])
    reach = min(max(0.7 * length / _CELLS, 1.5), 8.0)
    count = int(min(max(length / 1.5, 8.0), 60.0))
    base = start + np.linspace(_FROM, _TO, count)[:, None] * side
    offset = np.arange(-reach, reach + 0.5 * _STEP_PX, _STEP_PX)
    where = base[:, None, :] + offset[:, None] * outward - origin
    ends = where[[0, 0, -1, -1], [0, -1, 0, -1]]
    if ends.min() < 0.0 or ends[:, 0].max() > light.shape[1] - 1 or ends[:, 1].max() > light.shape[0] - 1:
        return None
    at = where.astype(np.float32)
    profile = cv2.remap(light, at[:, :, 0], at[:, :, 1], cv2.INTER_LINEAR)
    slope = np.diff(np.asarray(profile, dtype=np.float64), axis=1)
    middle = 0.5 * (offset[1:] + offset[:-1])
    # Against the noise: only what rises by a good part of the steepest rise belongs to the edge.
    steepest = slope.max(axis=1)
    weight = np.clip(slope - 0.3 * steepest[:, None], 0.0, None)
    total = weight.sum(axis=1)
    good = (steepest > 0.0) & (total > 0.0)
    typical = float(np.median(steepest))
    good &= steepest > 0.3 * typical
    if int(good.sum()) < 4:
        return None
    shift = (weight[good] @ middle) / total[good]
    return base[good] + shift[:, None] * outward
