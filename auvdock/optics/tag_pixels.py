"""The tag's pattern at every pixel, in closed form, with what it hides and the veil before it.

The cells' edges are straight and the point spread function is a Gaussian, so the blurred pattern at (u, v) in the tag's
plane is Σ B_rc (Φ_r - Φ_r+1) (Φ_c - Φ_c+1) with Φ_k = Φ((u - k) / σ) or Φ((v - k) / σ), Φ the normal distribution
function and B the cells. Most pixels are farther than 4.5 σ from all edges: there it is the cell's own reflectance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import TAG_CELLS

__all__ = ["TagLight", "add_tag"]

_REACH_SIGMAS = 4.5
_PER_SIGMA = 256
_NORMAL = ndtr(np.arange(-_REACH_SIGMAS, _REACH_SIGMAS + 2.0 / _PER_SIGMA, 1.0 / _PER_SIGMA)).astype(np.float32)


class TagLight(NamedTuple):
    """Light on a region of the image that shows the tag, and what the tag hides; electrons.

    Attributes:
        unit: (k, w, 3) per unit of reflectance, at rows in the middle of each of k parts of the region.
        veil: (k, w, 3) of the veil, or of no rows.
        below: (m, n, 3) of what the tag hides, or of no rows.
        below_step: its rows per row of the image.
        below_row: its row at the region's first row.
        below_column: its first column that belongs to the region.
    """

    unit: NDArray[np.float32]
    veil: NDArray[np.float32]
    below: NDArray[np.float32]
    below_step: float
    below_row: float
    below_column: int


@compiled
def add_tag(
    image: NDArray[np.float32],
    region: tuple[int, int, int, int],
    tangents: NDArray[np.float32],
    homography: NDArray[np.float32],
    cells: NDArray[np.float32],
    sigma: tuple[float, float],
    light: TagLight,
) -> None:
    """Add unit × reflectance + (veil - below) × coverage to a region of an image (H, W, 3), electrons.

    Args:
        image: red, green, blue.
        region: columns x0 and rows y0 up to x1 and y1.
        tangents: (2, H, W) of the pixels' rays, to the right and down.
        homography: (3, 3) tangents to u and v, in cells.
        cells: (12, 12) reflectances with a frame of zeros.
        sigma: standard deviations of the blur along u and v, in cells.
        light: on the region.
    """
    unit, veil, below = light.unit, light.veil, light.below
    x0, y0, x1, y1 = region
    width = x1 - x0
    u, v = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.float32)
    paint, cover = np.empty(3 * width, dtype=np.float32), np.empty(3 * width, dtype=np.float32)
    line = np.empty(3 * width, dtype=np.float32)
    for y in range(y0, y1):
        right, ahead = tangents[0, y][x0:x1], tangents[1, y][x0:x1]
        for i in range(width):
            a, b = right[i], ahead[i]
            scale = np.float32(1.0) / (homography[2, 0] * a + homography[2, 1] * b + homography[2, 2])
            u[i] = (homography[0, 0] * a + homography[0, 1] * b + homography[0, 2]) * scale
            v[i] = (homography[1, 0] * a + homography[1, 1] * b + homography[1, 2]) * scale
        _reflect(paint, cover, u, v, cells, np.float32(sigma[0]), np.float32(sigma[1]))
        part = (y - y0 + 0.5) * len(unit) / (y1 - y0) - 0.5
        # Along flat rows, since only such loops become vector instructions.
        out = image[y].ravel()[3 * x0 : 3 * x1]
        _between(line, unit, part, 0)
        for i in range(len(out)):
            out[i] += line[i] * paint[i]
        if len(veil) > 0:
            _between(line, veil, part, 0)
            for i in range(len(out)):
                out[i] += line[i] * cover[i]
        if len(below) > 0:
            _between(line, below, light.below_row + (y - y0) * light.below_step, light.below_column)
            for i in range(len(out)):
                out[i] -= line[i] * cover[i]


@compiled
def _reflect(
    light: NDArray[np.float32],
    cover: NDArray[np.float32],
    u: NDArray[np.float32],
    v: NDArray[np.float32],
    cells: NDArray[np.float32],
    sigma_u: np.float32,
    sigma_v: np.float32,
) -> None:
    """Reflectance × coverage and coverage (3 n,) at places (n,) in cells, each thrice for red, green and blue."""
    left, last = _within(u, np.float32(_REACH_SIGMAS) * sigma_u)
    top, bottom = _within(v, np.float32(_REACH_SIGMAS) * sigma_v)
    per_u, per_v = np.float32(1.0) / sigma_u, np.float32(1.0) / sigma_v
    across = np.empty(TAG_CELLS + 2, dtype=np.float32)
    for i in range(len(u)):
        row, column = top[i], left[i]
        value = cells[row, column]
        share = np.float32(1.0) if value > 0.0 else np.float32(0.0)
        if column != last[i] or row != bottom[i]:
            for k in range(column, last[i]):
                across[k] = _normal((u[i] - np.float32(k)) * per_u)
            above = value = np.float32(0.0)
            for j in range(row, bottom[i] + 1):
                here = cells[j, column]
                for k in range(column, last[i]):
                    here += (cells[j, k + 1] - cells[j, k]) * across[k]
                value += here if j == row else (here - above) * _normal((v[i] - np.float32(j - 1)) * per_v)
                above = here
            share = np.float32(1.0)
            if column == 0 or last[i] > TAG_CELLS or row == 0 or bottom[i] > TAG_CELLS:
                end = np.float32(TAG_CELLS)
                share = _normal(u[i] * per_u) - _normal((u[i] - end) * per_u)
                share *= _normal(v[i] * per_v) - _normal((v[i] - end) * per_v)
        light[3 * i] = light[3 * i + 1] = light[3 * i + 2] = value
        cover[3 * i] = cover[3 * i + 1] = cover[3 * i + 2] = share


@compiled
def _within(place: NDArray[np.float32], reach: np.float32) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last cell (n,) within reach of places (n,): from 0, the frame's, to TAG_CELLS + 1."""
    first, last = np.empty(len(place), dtype=np.int32), np.empty(len(place), dtype=np.int32)
    low, high, one = np.float32(0.0), np.float32(TAG_CELLS + 1), np.float32(1.0)
    for i in range(len(place)):
        # Truncation is the floor, since what is truncated is not below 0.
        first[i] = np.int32(min(max(place[i] - reach + one, low), high))
        last[i] = np.int32(min(max(place[i] + reach + one, low), high))
    return first, last


@compiled
def _normal(x: np.float32) -> np.float32:
    """Φ(x), linear between tabulated places."""
    place = (x + np.float32(_REACH_SIGMAS)) * np.float32(_PER_SIGMA)
    place = min(max(place, np.float32(0.0)), np.float32(len(_NORMAL) - 2))
    entry = int(place)
    return _NORMAL[entry] + (place - np.float32(entry)) * (_NORMAL[entry + 1] - _NORMAL[entry])


@compiled
def _between(line: NDArray[np.float32], image: NDArray[np.float32], row: float, first: int) -> None:
    """Put what an image (h, w, 3) has at a row, between its rows, into a line (3 n,) from a first column on.

    Beyond its rows it is that of its border.
    """
    row = min(max(row, 0.0), len(image) - 1.0)
    upper = min(int(row), max(len(image) - 2, 0))
    share = np.float32(row - upper)
    begin, end = 3 * first, 3 * first + len(line)
    one, other = image[upper].ravel()[begin:end], image[min(upper + 1, len(image) - 1)].ravel()[begin:end]
    for i in range(len(line)):
        line[i] = one[i] + share * (other[i] - one[i])
