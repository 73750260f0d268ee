"""Connected components of what stands above a threshold: few pixels of a dark image.

Rows without such a pixel are told by their brightest, so that the cost is about that of reading the image once. In the
others the pixels form runs; runs that touch those of the row above, corners included, are joined (union-find).
"""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Image, IntArray
from auvdock.numeric.compiled import compiled

__all__ = ["components", "peaked_components"]


@compiled
def components(image: Image, threshold: float) -> IntArray:
    """(k, 5) left, top, width, height and area of the components of `image` (h, w) above a threshold.

    Pixels that touch at a side or a corner belong together. The order is that of the components' first pixels, row by
    row from the top, each from the left.
    """
    run = _joined(image, int(np.floor(threshold)))
    place, count = _places(run)
    return _boxes(run, place, count)


@compiled
def peaked_components(image: Image, threshold: float, taken: IntArray) -> IntArray:
    """(k, 9) `components`, with each one's brightest pixel and what it holds of the pixels `taken` (m, 2), column, row.

    After the five numbers of `components` come the peak's code, column and row, of equals the first, and how many of
    the pixels that were taken it holds.
    """
    run = _joined(image, int(np.floor(threshold)))
    place, count = _places(run)
    found = np.zeros((count, 9), dtype=np.int64)
    found[:, :5] = _boxes(run, place, count)
    for k in range(len(run)):
        first, last, row = run[k, 0], run[k, 1], run[k, 2]
        entry = found[place[k]]
        for x in range(first, last):
            if image[row, x] > entry[5]:
                entry[5], entry[6], entry[7] = image[row, x], x, row
        for column, line in taken:
            if line == row and first <= column < last:
                entry[8] += 1
    return found


@compiled
def _joined(image: Image, level: int) -> IntArray:
    """(n, 4) runs above a level: first column, one past the last, row, and a run of the component not after this."""
    height, width = image.shape
    run = np.empty((_count_runs(image, level), 4), dtype=np.int64)
    count = above = row_start = 0
    for y in range(height):
        above, row_start = row_start, count
        line = image[y]
        if line.max() <= level:
            continue
        x = 0
        while x < width:
            if line[x] <= level:
                x += 1
                continue
            start = x
            while x < width and line[x] > level:
                x += 1
            run[count, 0], run[count, 1], run[count, 2], run[count, 3] = start, x, y, count
            while above < row_start and run[above, 1] < start:
                above += 1
            other = above
            while other < row_start and run[other, 0] <= x:
                one, two = _root(run, other), _root(run, count)
                run[max(one, two), 3] = min(one, two)
                other += 1
            count += 1
    return run


@compiled
def _count_runs(image: Image, level: int) -> int:
    count = 0
    for y in range(image.shape[0]):
        line = image[y]
        if line.max() <= level:
            continue
        inside = False
        for x in range(len(line)):
            lit = line[x] > level
            if lit and not inside:
                count += 1
            inside = lit
    return count


@compiled
def _root(run: IntArray, index: int) -> int:
    """The component's first run; halves the path to it."""
    while run[index, 3] != index:
        run[index, 3] = run[run[index, 3], 3]
        index = run[index, 3]
    return index


@compiled
def _places(run: IntArray) -> tuple[IntArray, int]:
    """(n,) the component of each run, and how many there are."""
    place = np.empty(len(run), dtype=np.int64)
    count = 0
    for k in range(len(run)):
        root = _root(run, k)
        if root == k:
            place[k] = count
            count += 1
        else:
            place[k] = place[root]
    return place, count


@compiled
def _boxes(run: IntArray, place: IntArray, count: int) -> IntArray:
    """`components` of joined runs."""
    found = np.zeros((count, 5), dtype=np.int64)
    for k in range(len(run)):
        first, last, row = run[k, 0], run[k, 1], run[k, 2]
        box = found[place[k]]
        if box[4] == 0:
            box[0], box[1], box[2] = first, row, last
        # Until the end, columns 2 and 3 hold where the box ends.
        box[0], box[2], box[3] = min(box[0], first), max(box[2], last), row + 1
        box[4] += last - first
    for box in found:
        box[2] -= box[0]
        box[3] -= box[1]
    return found
