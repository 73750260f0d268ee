"""Saddles between the peaks of lights, compiled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["saddles"]

_STEPS_PER_PX = 2.0


@compiled
def saddles(image: NDArray[np.float32], pixels: Array) -> Array:
    """(n, n, 3) the height at which lights at pixels (n, 2) join, per channel of an image (H, W, 3).

    On the diagonal stand the peaks: the brightest pixel of the nine about a light's centre. Between two peaks it is the
    least value on the straight line, or on a way over other peaks whose least value is greater.
    """
    n, height, width = len(pixels), image.shape[0], image.shape[1]
    level = np.zeros((n, n, 3))
    top = np.empty((n, 3, 2))
    for i in range(n):
        x, y = min(max(round(pixels[i, 0]), 0), width - 1), min(max(round(pixels[i, 1]), 0), height - 1)
        for c in range(3):
            best_x, best_y = x, y
            for v in range(max(y - 1, 0), min(y + 2, height)):
                for u in range(max(x - 1, 0), min(x + 2, width)):
                    if image[v, u, c] > image[best_y, best_x, c]:
                        best_x, best_y = u, v
            top[i, c, 0], top[i, c, 1] = best_x, best_y
            level[i, i, c] = image[best_y, best_x, c]
    for i in range(n):
        for j in range(i):
            for c in range(3):
                level[i, j, c] = level[j, i, c] = _least_between(image, top[i, c], top[j, c], c)
    for c in range(3):
        for k in range(n):
            for i in range(n):
                for j in range(n):
                    if i != j:
                        level[i, j, c] = max(level[i, j, c], min(level[i, k, c], level[k, j, c]))
    return level


@compiled
def _least_between(image: NDArray[np.float32], start: Array, end: Array, c: int) -> float:
    """The least value of a channel, linear between pixels, on a straight line between two pixels (2,)."""
    height, width = image.shape[0], image.shape[1]
    across, down = end[0] - start[0], end[1] - start[1]
    steps = max(math.ceil(math.hypot(across, down) * _STEPS_PER_PX), 1)
    least = np.inf
    for step in range(steps + 1):
        x, y = start[0] + across * step / steps, start[1] + down * step / steps
        u, v = min(int(x), max(width - 2, 0)), min(int(y), max(height - 2, 0))
        right, below = x - u, y - v
        upper = image[v, u, c] * (1.0 - right) + image[v, u + 1, c] * right
        lower = image[v + 1, u, c] * (1.0 - right) + image[v + 1, u + 1, c] * right
        least = min(least, upper * (1.0 - below) + lower * below)
    return least
