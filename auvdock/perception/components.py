"""Connected components of what stands above a threshold: few pixels of a dark image.

Rows without such a pixel are told by their brightest, so that the cost is about that of reading the image once. In the
others the pixels form runs; runs that touch those of the row above, corners included, are joined (union-find).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Image, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records, new_rows

__all__ = ["Component", "Peak", "components", "components_and_peaks"]


@dataclass
class Component(Record):
    """Box and size of a component, in px."""

    left: int
    top: int
    width: int
    height: int
    area: int


@dataclass
class Peak(Record):
    """The brightest pixel of a component, of equals the first row by row, and what else is asked of its pixels."""

    code: int
    column: int
    row: int
    marks: int
    """How many of the marked pixels it holds."""


@dataclass
class _Run(Record):
    """Pixels side by side in one row that all stand above the threshold."""

    first: int
    """Column."""
    end: int
    """One column past the last."""
    row: int
    earlier: int
    """A run of the same component that is not after this one; the component's first is its own."""
    component: int


_COMPONENT, _PEAK, _RUN = Component.dtype(), Peak.dtype(), _Run.dtype()


@compiled
def components(image: Image, threshold: float) -> Records[Component]:
    """(k,) components of `image` (h, w) above a threshold.

    Pixels that touch at a side or a corner belong together. The order is that of the components' first pixels, row by
    row from the top, each from the left.
    """
    runs = _runs(image, int(np.floor(threshold)))
    return _boxes(runs, _number(runs))


@compiled
def components_and_peaks(image: Image, threshold: float, marks: IntArray) -> tuple[Records[Component], Records[Peak]]:
    """`components` and their peaks (k,), with how many of the pixels `marks` (m, 2), column and row, each holds."""
    runs = _runs(image, int(np.floor(threshold)))
    count = _number(runs)
    peaks: Records[Peak] = new_rows(count, dtype=_PEAK)
    for run in runs:
        peak = peaks[run.component]
        for x in range(run.first, run.end):
            if image[run.row, x] > peak.code:
                peak.code, peak.column, peak.row = image[run.row, x], x, run.row
        for m in range(len(marks)):
            if marks[m, 1] == run.row and run.first <= marks[m, 0] < run.end:
                peak.marks += 1
    return _boxes(runs, count), peaks


@compiled
def _runs(image: Image, level: int) -> Records[_Run]:
    """(n,) runs above a level, those that touch joined."""
    height, width = image.shape
    runs: Records[_Run] = new_rows(_count_runs(image, level), dtype=_RUN)
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
            run = runs[count]
            run.first, run.end, run.row, run.earlier = start, x, y, count
            while above < row_start and runs[above].end < start:
                above += 1
            other = above
            while other < row_start and runs[other].first <= x:
                one, two = _root(runs, other), _root(runs, count)
                runs[max(one, two)].earlier = min(one, two)
                other += 1
            count += 1
    return runs


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
def _root(runs: Records[_Run], index: int) -> int:
    """The component's first run; halves the path to it."""
    while runs[index].earlier != index:
        runs[index].earlier = runs[runs[index].earlier].earlier
        index = runs[index].earlier
    return index


@compiled
def _number(runs: Records[_Run]) -> int:
    """Number the components by their first runs and tell each run its component's; how many there are."""
    count = 0
    for k in range(len(runs)):
        root = _root(runs, k)
        if root == k:
            runs[k].component = count
            count += 1
        else:
            runs[k].component = runs[root].component
    return count


@compiled
def _boxes(runs: Records[_Run], count: int) -> Records[Component]:
    """`components` of joined runs."""
    found: Records[Component] = new_rows(count, dtype=_COMPONENT)
    for run in runs:
        box = found[run.component]
        right = max(box.left + box.width, run.end)
        if box.area == 0:
            box.left, box.top, right = run.first, run.row, run.end
        box.left = min(box.left, run.first)
        box.width, box.height = right - box.left, run.row + 1 - box.top
        box.area += run.end - run.first
    return found
