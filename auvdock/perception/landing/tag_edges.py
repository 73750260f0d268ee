"""Corners of a tag to a fraction of a pixel: its four sides as straight lines through sub-pixel edge points."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, BoolArray, Image
from auvdock.core.camera import Camera
from auvdock.core.contracts import Frame
from auvdock.numeric.constants import TAG_SQUARE_CELLS

__all__ = ["Lines", "corners_from_lines", "lines_through", "refined_corners"]

_FROM, _TO = 0.08, 0.92
"""Part of each side that is used: blur rounds the corners."""
_STEP_PX = 0.4
_AROUND_PX = 12
_PASSES = 2
_CLOSE_PX = 1.0
"""Corners that moved less need no second pass: the profiles were centred well enough."""
_FLOOR_PX = 0.03
"""Least standard deviation of a corner, ours: interpolation and blur that differs on the two sides of an edge."""


class Lines(NamedTuple):
    """Straight lines in the image plane at unit distance.

    Attributes:
        point: (m, 2) a point of each: the middle of what it was fitted to.
        direction: (m, 2) unit vectors along them.
        sigma: (m,) standard deviation of what they were fitted to, across.
        used: (m,) points that they were fitted to.
    """

    point: Array
    direction: Array
    sigma: Array
    used: Array

    def variance_at_ends(self) -> float:
        """Greatest variance across at a line's end, 4 σ² / N (regression line, points evenly spaced)."""
        return float((4.0 * self.sigma * self.sigma / self.used).max())


def refined_corners(frame: Frame, corners_px: Array, cells: int = TAG_SQUARE_CELLS) -> tuple[Array, float] | None:
    """((4, 2) corners in pixels, standard deviation per axis) from corners good to a cell; None without four edges.

    Across each side the edge is where the centre of the gradient of light lies: codes are made linear first, for in a
    root of it black grows into white by a third of a pixel. The lines are fitted to undistorted
    points, where straight sides are straight, and their intersections projected back. A corner is the end of two lines
    of N points with residual σ, so its standard deviation is 2 σ / √N (the end of a regression line).

    Args:
        frame: the image, black square on white.
        corners_px: (4, 2) rough corners, clockwise in the image.
        cells: along an edge of the black square.
    """
    camera = frame.camera
    patch = _patch_around(frame, corners_px)
    corners, variance = corners_px, 0.0
    for _ in range(_PASSES):
        edges = _edge_points(patch, corners, cells)
        if edges is None:
            return None
        points, good = edges
        lines = lines_through(camera.normalise(points.reshape(-1, 2)).reshape(points.shape), good)
        found = corners_from_lines(lines, camera) if lines is not None else None
        if lines is None or found is None:
            return None
        variance = lines.variance_at_ends()
        moved = float(np.abs(found - corners).max())
        corners = found
        if moved < _CLOSE_PX:
            break
    focal = float(camera.matrix[0, 0])
    return corners, math.hypot(_FLOOR_PX, focal * math.sqrt(variance))


def corners_from_lines(lines: Lines, camera: Camera) -> Array | None:
    """(4, 2) pixels where each of four lines meets the one before it; None for parallels."""
    corners = np.ones((4, 3))
    points: list[list[float]] = lines.point.tolist()
    directions: list[list[float]] = lines.direction.tolist()
    for side in range(4):
        (px, py), (ux, uy) = points[side - 1], directions[side - 1]
        (qx, qy), (vx, vy) = points[side], directions[side]
        cross = ux * vy - uy * vx
        if abs(cross) < 0.1:
            return None
        share = ((qx - px) * vy - (qy - py) * vx) / cross
        corners[side, 0], corners[side, 1] = px + ux * share, py + uy * share
    return camera.project(corners)


def lines_through(points: Array, good: BoolArray) -> Lines | None:
    """Lines through m sets of points by total least squares; None where a set has fewer than four good ones.

    A line runs through the mean of its points, along the direction at ½ atan2(2 s_xy, s_xx − s_yy) that their second
    moments s have most of. What lies beyond three robust deviations is left out once.

    Args:
        points: (m, n, 2) in the image plane at unit distance.
        good: (m, n) which of them count.
    """
    weight = good.astype(np.float64)
    x, y = points[:, :, 0], points[:, :, 1]
    for last in (False, True):
        count = weight.sum(axis=1)
        if count.min() < 4.0:
            return None
        centre_x, centre_y = (np.einsum("mn,mn->m", weight, axis) / count for axis in (x, y))
        dx, dy = x - centre_x[:, None], y - centre_y[:, None]
        along_x = weight * dx
        xy = np.einsum("mn,mn->m", along_x, dy)
        xx, yy = np.einsum("mn,mn->m", along_x, dx), np.einsum("mn,mn,mn->m", weight, dy, dy)
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        cosine, sine = np.cos(angle), np.sin(angle)
        across = cosine[:, None] * dy - sine[:, None] * dx
        if last:
            square = np.einsum("mn,mn,mn->m", weight, across, across)
            point, direction = np.column_stack([centre_x, centre_y]), np.column_stack([cosine, sine])
            return Lines(point, direction, np.sqrt(square / (count - 2.0)), count)
        away = np.abs(across)
        middle = np.array([_median(row[kept]) for row, kept in zip(away, weight > 0.0, strict=True)])
        weight *= away <= 3.0 * 1.4826 * middle[:, None] + 1e-12
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


def _edge_points(patch: _Patch, corners: Array, cells: int) -> tuple[Array, BoolArray] | None:
    """(4, n, 2) sub-pixel points of the edges from black to white along the sides, and which count; None without."""
    side = np.concatenate([corners[1:], corners[:1]]) - corners
    length = np.hypot(side[:, 0], side[:, 1])
    shortest, longest = float(length.min()), float(length.max())
    if shortest < 8.0:
        return None
    along = side / length[:, None]
    # Clockwise in an image whose y points down: outwards is to the left of the way.
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    reach = min(max(0.7 * shortest / cells, 1.5), 8.0)
    share = np.linspace(_FROM, _TO, int(min(max(longest / 1.5, 8.0), 60.0)))
    base = corners[:, None] + share[:, None] * side[:, None]
    offset = np.arange(-reach, reach + 0.5 * _STEP_PX, _STEP_PX)
    place = base - patch.origin
    profile = np.empty((4, len(share), len(offset)))
    for row in range(4):
        x, y = (place[row, :, k, None] + offset * outward[row, k] for k in range(2))
        if not _read_profiles(patch, x, y, profile[row]):
            return None
    slope = profile[:, :, 1:] - profile[:, :, :-1]
    middle = 0.5 * (offset[1:] + offset[:-1])
    # Against the noise: only what rises by a good part of the steepest rise belongs to the edge.
    steepest = slope.max(axis=2)
    slope -= 0.3 * steepest[:, :, None]
    weight = np.maximum(slope, 0.0, out=slope)
    total = weight.sum(axis=2)
    typical = np.array([_median(row) for row in steepest])
    good = (steepest > 0.0) & (total > 0.0)
    good &= steepest > 0.3 * typical[:, None]
    shift = (weight @ middle) / np.where(good, total, 1.0)
    return base + shift[:, :, None] * outward[:, None], good


def _read_profiles(patch: _Patch, x: Array, y: Array, out: Array) -> bool:
    """Write linear light at columns and rows (n, k) of a patch to `out` (n, k); False where the grid leaves it."""
    # A grid that is a parallelogram has its extremes at its corners.
    corners = ([0, 0, -1, -1], [0, -1, 0, -1])
    across, down = x[corners], y[corners]
    height, width = patch.codes.shape
    left, top, right, bottom = float(across.min()), float(down.min()), float(across.max()), float(down.max())
    if left < 0.0 or top < 0.0 or right > width - 1 or bottom > height - 1:
        return False
    # Only the part around this side is made linear. Whole pixels are taken off after rounding, which is exact.
    x0, y0, x1, y1 = int(left), int(top), int(right) + 3, int(bottom) + 3
    light = cv2.LUT(np.ascontiguousarray(patch.codes[y0:y1, x0:x1]), patch.light)
    map_x, map_y = x.astype(np.float32), y.astype(np.float32)
    map_x -= np.float32(x0)
    map_y -= np.float32(y0)
    out[:] = cv2.remap(light, map_x, map_y, cv2.INTER_LINEAR)
    return True


def _median(values: Array) -> float:
    """Median of (n,) finite values, without the care for all else that makes NumPy's slow."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    low, high = np.partition(values, (half - 1, half))[half - 1 : half + 1].tolist()
    return 0.5 * (low + high)
