"""Corners of a tag to a fraction of a pixel: its four sides as straight lines through sub-pixel edge points."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
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
    patch = _patch_around(frame, corners_px)
    corners, variance = corners_px, 0.0
    for _ in range(_PASSES):
        lines: list[tuple[Array, Array]] = []
        variance = 0.0
        for side in range(4):
            points = _edge_points(patch, corners[side], corners[(side + 1) % 4])
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
        away = np.abs(across)
        points = points[away <= 3.0 * 1.4826 * _median(away) + 1e-12]
    return None


class _Patch(NamedTuple):
    """The part of an image around a tag.

    Attributes:
        codes: (h, w) view of the brightest channel.
        origin: (2,) the patch's first column and row.
        light: (256,) linear light of each code.
    """

    codes: Image
    origin: Array
    light: NDArray[np.float32]


def _patch_around(frame: Frame, corners_px: Array) -> _Patch:
    """The patch around the corners."""
    height, width = frame.image.shape[:2]
    x0, y0 = np.maximum(np.floor(corners_px.min(axis=0)).astype(int) - _AROUND_PX, 0).tolist()
    x1, y1 = (np.ceil(corners_px.max(axis=0)).astype(int) + _AROUND_PX + 1).tolist()
    patch = frame.image[y0 : min(y1, height), x0 : min(x1, width)]
    channel = int(np.argmax(patch[::8, ::8].reshape(-1, 3).sum(axis=0, dtype=np.int64)))
    light = frame.response.electrons(frame.gain).astype(np.float32)
    return _Patch(patch[:, :, channel], np.array([float(x0), float(y0)]), light)


def _edge_points(patch: _Patch, start: Array, end: Array) -> Array | None:
    """(n, 2) sub-pixel points of the edge from black to white along one side; None where there is none."""
    side = end - start
    length = math.sqrt(float(side @ side))
    if length < 8.0:
        return None
    along = side / length
    # Clockwise in an image whose y points down: outwards is to the left of the way.
    outward = np.array([along[1], -along[0]])
    reach = min(max(0.7 * length / _CELLS, 1.5), 8.0)
    base = start + np.linspace(_FROM, _TO, int(min(max(length / 1.5, 8.0), 60.0)))[:, None] * side
    offset = np.arange(-reach, reach + 0.5 * _STEP_PX, _STEP_PX)
    x, y = (base[:, k : k + 1] + offset * outward[k] - patch.origin[k] for k in range(2))
    profile = _profiles(patch, x, y)
    if profile is None:
        return None
    slope = profile[:, 1:] - profile[:, :-1]
    middle = 0.5 * (offset[1:] + offset[:-1])
    # Against the noise: only what rises by a good part of the steepest rise belongs to the edge.
    steepest = slope.max(axis=1)
    weight = np.maximum(slope - 0.3 * steepest[:, None], 0.0)
    total = weight.sum(axis=1)
    good = (steepest > 0.0) & (total > 0.0)
    good &= steepest > 0.3 * _median(steepest)
    if not good.all():
        if int(good.sum()) < 4:
            return None
        base, weight, total = base[good], weight[good], total[good]
    shift = (weight @ middle) / total
    return base + shift[:, None] * outward


def _profiles(patch: _Patch, x: Array, y: Array) -> Array | None:
    """(n, k) linear light at columns and rows (n, k) of a patch; None where the grid leaves the patch."""
    # A grid that is a parallelogram has its extremes at its corners.
    corners = ([0, 0, -1, -1], [0, -1, 0, -1])
    across, down = x[corners], y[corners]
    height, width = patch.codes.shape
    left, top, right, bottom = float(across.min()), float(down.min()), float(across.max()), float(down.max())
    if left < 0.0 or top < 0.0 or right > width - 1 or bottom > height - 1:
        return None
    # Only the part around this side is made linear. Whole pixels are taken off after rounding, which is exact.
    x0, y0, x1, y1 = int(left), int(top), int(right) + 3, int(bottom) + 3
    light = cv2.LUT(np.ascontiguousarray(patch.codes[y0:y1, x0:x1]), patch.light)
    map_x, map_y = x.astype(np.float32), y.astype(np.float32)
    map_x -= np.float32(x0)
    map_y -= np.float32(y0)
    return np.asarray(cv2.remap(light, map_x, map_y, cv2.INTER_LINEAR), dtype=np.float64)


def _median(values: Array) -> float:
    """Median of (n,) finite values, without the care for all else that makes NumPy's slow."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    low, high = np.partition(values, (half - 1, half))[half - 1 : half + 1].tolist()
    return 0.5 * (low + high)
