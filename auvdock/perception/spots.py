"""What the classical detectors share: background, noise, and the colour of a light."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from auvdock.core.arrays import Array, Image, IntArray
from auvdock.core.contracts import BLUE, RED, Detections, RegionOfInterest
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import SATURATED_CODE

__all__ = [
    "CELL_PX",
    "background",
    "brightest_channel",
    "crop_of",
    "inside",
    "light_class",
    "mean_channel",
    "noise_sigma",
]

CELL_PX = 8
"""Side of a cell of the low-resolution background."""
_MARGIN_PX = 64


def brightest_channel(image: Image) -> Image:
    """(H, W) maximum over the channels, lightly smoothed against pixel noise (a Gaussian of 0.8 px, 3 × 3)."""
    return _smooth(np.ascontiguousarray(image).reshape(len(image), -1), False)


def mean_channel(image: Image) -> Image:
    """(H, W) mean over the channels, smoothed in the same way."""
    return _smooth(np.ascontiguousarray(image).reshape(len(image), -1), True)


def background(level: Image, size_px: int) -> Image:
    """(H, W) what is broader than `size_px`: grey opening of the image at an eighth of its resolution.

    Haze, daylight and the wide halos of turbid water stay in it; cores and the peaks of halos do not.
    """
    height, width = level.shape
    small = cv2.resize(level, (-(-width // CELL_PX), -(-height // CELL_PX)), interpolation=cv2.INTER_AREA)
    side = max(3, 2 * round(size_px / CELL_PX / 2) + 1)
    kernel = np.ones((side, side), dtype=np.uint8)
    opened = cv2.blur(cv2.morphologyEx(small, cv2.MORPH_OPEN, kernel, borderType=cv2.BORDER_REPLICATE), (3, 3))
    return np.asarray(cv2.resize(opened, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.uint8)


def noise_sigma(level: Image) -> float:
    """Robust σ of the pixel noise in grey levels: the median of |difference of pixels four apart| over 0.6745 √2.

    At least 0.5, the rounding of eight bits included.
    """
    total = np.cumsum(_differences(level))
    # A histogram of integers: the median is interpolated within its bin.
    half = 0.5 * total[-1]
    index = int(np.searchsorted(total, half))
    before = total[index - 1] if index else 0
    median = index - 0.5 + (half - before) / max(total[index] - before, 1)
    return max(0.5, max(float(median), 0.0) / (0.6745 * np.sqrt(2.0)))


def light_class(image: Image, left: int, top: int, right: int, bottom: int) -> int:
    """`RED` or `BLUE` of the light in a box (upper bounds excluded).

    A light's core saturates in all channels to white: the colour is read from the unsaturated pixels of the box and its
    neighbourhood, against the colour of the neighbourhood's rim.
    """
    height, width = image.shape[:2]
    pad = 3
    patch = image[max(top - pad, 0) : min(bottom + pad, height), max(left - pad, 0) : min(right + pad, width)]
    usable = cv2.inRange(patch, (0, 0, 0), (SATURATED_CODE - 1,) * 3)
    red, _, blue, _ = cv2.mean(patch, usable) if cv2.countNonZero(usable) else cv2.mean(patch)
    # A low quantile: another light may stand on part of the rim.
    rim = np.sort(np.concatenate([patch[0], patch[-1], patch[:, 0], patch[:, -1]]), axis=0)
    low_red, _, low_blue = rim[len(rim) // 5].tolist()
    return RED if red - low_red > blue - low_blue else BLUE


def crop_of(region: RegionOfInterest, height: int, width: int) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) of the part of the image that decides about a region.

    A margin as wide as the background's window is added and the grid of the background is kept, so that a light is
    found at the same place with and without regions.
    """
    left = max((region.x0 - _MARGIN_PX) // CELL_PX * CELL_PX, 0)
    top = max((region.y0 - _MARGIN_PX) // CELL_PX * CELL_PX, 0)
    right = min(-(-(region.x1 + _MARGIN_PX) // CELL_PX) * CELL_PX, width)
    bottom = min(-(-(region.y1 + _MARGIN_PX) // CELL_PX) * CELL_PX, height)
    return left, top, max(right, left), max(bottom, top)


def inside(detections: Detections, regions: Sequence[RegionOfInterest]) -> Detections:
    """Detections whose centre lies in a region, each once."""
    if len(detections) == 0:
        return detections
    u, v = detections.centre_px[:, 0], detections.centre_px[:, 1]
    keep = np.zeros(len(detections), dtype=np.bool_)
    for region in regions:
        keep |= (u >= region.x0) & (u < region.x1) & (v >= region.y0) & (v < region.y1)
    kept = detections.select(keep)
    if len(kept) == 0:
        return kept
    # Overlapping regions see a light twice, at the same centre up to rounding.
    keys: Array = np.round(kept.centre_px)
    _, first = np.unique(keys, axis=0, return_index=True)
    order: IntArray = np.sort(first)
    return kept.select(order)


@compiled
def _smooth(image: Image, mean: bool) -> Image:
    """Mean or maximum over the channels of rows (h, 3 w), smoothed; mirrored about the outermost pixels' centres."""
    height, width = image.shape[0], image.shape[1] // 3
    # The Gaussian in 256ths.
    side, middle = np.uint32(61), np.uint32(134)
    across = np.empty((height, width), dtype=np.uint16)
    line = np.empty(width + 2, dtype=np.uint8)
    for y in range(height):
        row = image[y]
        if mean:
            for x in range(width):
                total = np.uint32(row[3 * x]) + np.uint32(row[3 * x + 1]) + np.uint32(row[3 * x + 2])
                # A third in 65536ths, rounded: exact up to 3 × 255.
                line[x + 1] = (total * np.uint32(21846) + np.uint32(32768)) >> np.uint32(16)
        else:
            for x in range(width):
                line[x + 1] = max(row[3 * x], max(row[3 * x + 1], row[3 * x + 2]))
        line[0], line[width + 1] = line[min(2, width)], line[max(width - 1, 1)]
        out = across[y]
        for x in range(width):
            out[x] = side * (np.uint32(line[x]) + np.uint32(line[x + 2])) + middle * np.uint32(line[x + 1])
    level = np.empty((height, width), dtype=np.uint8)
    for y in range(height):
        # Mirrored at the upper and the lower border.
        above, here, below = across[abs(y - 1)], across[y], across[min(y + 1, height - 1)]
        if y == 0:
            above = across[min(1, height - 1)]
        if y == height - 1:
            below = across[max(height - 2, 0)]
        out = level[y]
        for x in range(width):
            total = side * (np.uint32(above[x]) + np.uint32(below[x])) + middle * np.uint32(here[x])
            out[x] = (total + np.uint32(1 << 15)) >> np.uint32(16)
    return level


@compiled
def _differences(level: Image) -> IntArray:
    """(256,) how often each absolute difference of neighbours occurs on every fourth row and column."""
    counts = np.zeros(256, dtype=np.int64)
    for y in range(0, level.shape[0], 4):
        for x in range(4, level.shape[1], 4):
            counts[abs(np.int64(level[y, x]) - np.int64(level[y, x - 4]))] += 1
    return counts
