"""What a detection network says, as candidates in px; the same for a whole network and for one in parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray, check_shape

__all__ = ["Candidates", "decode_cells", "read_candidates"]


class Candidates(NamedTuple):
    """Boxes and keypoints before suppression."""

    xyxy: Array
    """(n, 4) left, top, right, bottom, px."""
    scores: Array
    """(n,) of the likeliest class, 0 to 1."""
    classes: IntArray
    """(n,) which that is."""
    keypoints_px: Array
    """(n, k, 2)."""


def read_candidates(found: Array, classes: int, min_score: float) -> Candidates:
    """The cells of a whole network's output that are sure enough.

    Args:
        found: (4 + classes + 3·k, cells): centre and size of boxes in px, scores, then x, y, visibility of keypoints.
        classes: how many.
        min_score: cells below are left out.
    """
    scores = found[4 : 4 + classes].max(axis=0)
    rows = np.flatnonzero(scores >= min_score)
    chosen = found[:, rows].T
    centre, half = chosen[:, :2], chosen[:, 2:4] / 2.0
    points = chosen[:, 4 + classes :].reshape(len(rows), (len(found) - 4 - classes) // 3, 3)[:, :, :2]
    likeliest = chosen[:, 4 : 4 + classes].argmax(axis=1)
    return Candidates(np.hstack((centre - half, centre + half)), scores[rows], likeliest, points)


def decode_cells(said: Array, cells: IntArray, stride_px: int, bins: int) -> tuple[Array, Array]:
    """Boxes and keypoints of some cells of one level from what the head says of them.

    A side lies as far from the middle of the cell as the mean of its distribution over 0 to bins - 1 strides says
    (Li et al. 2020, arXiv 2006.04388, section 3.2), a keypoint at (2·raw + cell)·stride.

    Args:
        said: (n, 4·bins + 3·k): logarithms of the sides' distributions, then x, y and visibility of keypoints.
        cells: (n, 2) column and row.
        stride_px: of the level.
        bins: of a side's distribution.

    Returns:
        (n, 4) left, top, right, bottom, and (n, k, 2) keypoints, px.
    """
    check_shape("cells", cells, (len(said), 2))
    sides = said[:, : 4 * bins].reshape(-1, 4, bins)
    weights = np.exp(sides - sides.max(axis=2, keepdims=True))
    distance = (weights * np.arange(bins)).sum(axis=2) / weights.sum(axis=2)
    middle = cells + 0.5
    box = np.hstack((middle - distance[:, :2], middle + distance[:, 2:])) * stride_px
    points = said[:, 4 * bins :].reshape(len(said), (said.shape[1] - 4 * bins) // 3, 3)[:, :, :2]
    return box, (2.0 * points + cells[:, None]) * stride_px
