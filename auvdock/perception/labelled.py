"""The lights that carry an identity, gathered from the tracks in one compiled call."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.lights import PIXEL, SEEN, SIGMA
from auvdock.numeric.tracks import BEACON_ID, COVARIANCE, DETECTION

__all__ = ["labelled_lights"]

_MIN_SEEN = 4
"""From this many beacons on, those seen in this frame stand alone."""


@compiled
def labelled_lights(
    numbers: Array,
    labels: IntArray,
    centre_px: Array,
    xyxy: Array,
    size_px: tuple[int, int],
    array_m: Array,
    sigma_px: float,
) -> tuple[Array, IntArray, int]:
    """The array beacons among the tracks, in the order of their ids.

    Those that were seen in this frame if they are four or more; else predicted ones as well, at their track's place and
    with their track's σ on top of a detection's. Of a light that the picture's edge cuts, the centre is that of the
    part that is left: off by up to half of the box.

    Args:
        numbers: (n, 7 or more) of the tracks, as `LightTracker.numbers`.
        labels: (n, 6) of the tracks, as `LightTracker.labels`.
        centre_px: (m, 2) this frame's detections.
        xyxy: (m, 4) their boxes, px.
        size_px: width and height of the picture.
        array_m: (k, 3) array beacons in the station frame.
        sigma_px: σ of a detection.

    Returns:
        Table (l, 7) of lights as `PnpSolver.solve_lights` takes it; their tracks and beacons (l, 2); how many were
        seen.
    """
    seen = carried = 0
    for i in range(len(labels)):
        if labels[i, BEACON_ID] >= 0:
            carried += 1
            if labels[i, DETECTION] >= 0:
                seen += 1
    count = seen if seen >= _MIN_SEEN else carried
    lights, owners = np.empty((count, 7)), np.empty((count, 2), dtype=np.int64)
    row = 0
    for beacon in range(len(array_m)):
        for i in range(len(labels)):
            j = labels[i, DETECTION]
            if labels[i, BEACON_ID] != beacon or (seen >= _MIN_SEEN and j < 0):
                continue
            owners[row, 0], owners[row, 1] = i, beacon
            for k in range(3):
                lights[row, k] = array_m[beacon, k]
            if j >= 0:
                lights[row, PIXEL], lights[row, PIXEL + 1] = centre_px[j, 0], centre_px[j, 1]
                lights[row, SIGMA], lights[row, SEEN] = sigma_px, 1.0
                left, top, right, bottom = xyxy[j, 0], xyxy[j, 1], xyxy[j, 2], xyxy[j, 3]
                if left <= 0.0 or top <= 0.0 or right >= size_px[0] - 1 or bottom >= size_px[1] - 1:
                    lights[row, SIGMA] += 0.5 * max(right - left, bottom - top)
            else:
                lights[row, PIXEL], lights[row, PIXEL + 1] = numbers[i, 0], numbers[i, 1]
                lights[row, SIGMA], lights[row, SEEN] = sigma_px + math.sqrt(numbers[i, COVARIANCE]), 0.0
            row += 1
    return lights, owners, seen
