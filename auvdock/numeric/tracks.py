"""The tracks' two tables, as the tracker keeps them and all that reads them does: columns, and sums over the window.

A track is a row of each: its numbers, (n, 7 + window) floats, and its labels, (n, 6) integers.
"""

from __future__ import annotations

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = [
    "BEACON_ID",
    "CLASS_ID",
    "COVARIANCE",
    "DETECTION",
    "HISTORY",
    "HITS",
    "LABELS",
    "MISSED",
    "STATE",
    "TRACK_ID",
    "window_of",
]

STATE, COVARIANCE, HISTORY = 0, 4, 7
"""First columns of the numbers: u, v, u̇, v̇ in px and px/s; P₀₀, P₀₁, P₁₁ of one axis; the window's scores, one for
each of the last frames, 0 where the track was not seen."""
TRACK_ID, CLASS_ID, BEACON_ID, MISSED, HITS, DETECTION = range(6)
"""Columns of the labels: number of the track; `constants.BLUE` or `RED`; the beacon that it was authenticated as, -1
for none; frames in a row without a detection; detections in all; this frame's detection, -1 for none."""
LABELS = 6
"""Number of them."""


@compiled
def window_of(numbers: Array, row: int) -> tuple[int, float]:
    """In how many frames of the window a track was seen, and the sum of its scores there."""
    occurrences, total = 0, 0.0
    for k in range(HISTORY, numbers.shape[1]):
        total += numbers[row, k]
        if numbers[row, k] != 0.0:
            occurrences += 1
    return occurrences, total
