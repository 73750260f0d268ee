"""The lights that carry an identity, gathered from the tracks in one compiled call."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.lights import Light
from auvdock.numeric.records import Record, Records
from auvdock.numeric.tracks import Track

__all__ = ["Owner", "gather_lights"]

_MIN_SEEN = 4
"""From this many beacons on, those seen in this frame stand alone."""


@dataclass
class Owner(Record):
    """Where a light's identity comes from."""

    track: int
    """Row of its track."""
    beacon: int
    """The array's beacon."""


@compiled
def gather_lights(
    tracks: Records[Track],
    centre_px: Array,
    xyxy: Array,
    size_px: tuple[int, int],
    array_m: Array,
    sigma_px: float,
    lights: Records[Light],
    owners: Records[Owner],
) -> tuple[int, int]:
    """The array beacons among the tracks, in the order of their ids.

    Those that were seen in this frame if they are four or more; else predicted ones as well, at their track's place and
    with their track's σ on top of a detection's. Of a light that the picture's edge cuts, the centre is that of the
    part that is left: off by up to half of the box.

    Args:
        tracks: (n,) tracks, each beacon carried by one at most.
        centre_px: (m, 2) this frame's detections.
        xyxy: (m, 4) their boxes, px.
        size_px: width and height of the picture.
        array_m: (k, 3) array beacons in the station frame.
        sigma_px: σ of a detection.
        lights: (k,) the first rows take the lights, as `PnpSolver.solve_lights` takes them.
        owners: (k,) the first rows take whose they are.

    Returns:
        How many lights there are, and how many were seen.
    """
    seen = 0
    for i in range(len(tracks)):
        if tracks[i].beacon_id >= 0 and tracks[i].detection >= 0:
            seen += 1
    row = 0
    for beacon in range(len(array_m)):
        for i in range(len(tracks)):
            track, j = tracks[i], tracks[i].detection
            if track.beacon_id != beacon or (seen >= _MIN_SEEN and j < 0) or row == len(lights):
                continue
            owners[row].track, owners[row].beacon = i, beacon
            light = lights[row]
            for k in range(3):
                light.place_m[k] = array_m[beacon, k]
            light.is_seen = j >= 0
            for axis in range(2):
                light.centre_px[axis] = centre_px[j, axis] if j >= 0 else track.centre_px[axis]
            light.sigma_px = sigma_px
            if j < 0:
                light.sigma_px += math.sqrt(track.p00_px2)
            else:
                left, top, right, bottom = xyxy[j, 0], xyxy[j, 1], xyxy[j, 2], xyxy[j, 3]
                if left <= 0.0 or top <= 0.0 or right >= size_px[0] - 1 or bottom >= size_px[1] - 1:
                    light.sigma_px += 0.5 * max(right - left, bottom - top)
            row += 1
    return row, seen
