"""Steady lights, their groups and their bearings in one compiled call: the loops of `perception.line_of_sight`."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import BLUE, RED
from auvdock.numeric.lens import FX, pixel_of, tangents_of
from auvdock.numeric.lights import ROTATION, TRANSLATION
from auvdock.numeric.tracks import CLASS_ID, HISTORY, HITS, MISSED, TRACK_ID, window_of

__all__ = ["CENTRE", "ENTRANCE", "FOLLOWED", "LONG_RANGE", "RANGE", "RAY", "SCORE", "find_sights", "sight_terms"]

RAY, CENTRE, SCORE, RANGE = 0, 3, 5, 6
"""Where a bearing's parts begin: unit ray in the camera frame, pixel, confidence, range."""
LONG_RANGE, ENTRANCE, FOLLOWED = 0, 7, 14
"""Where the two bearings begin, and the track that is followed."""
_BLUE_SPREAD, _RED_SPREAD, _CENTRE_X, _CENTRE_Y, _CENTRE_Z = range(9, 14)
_OCCURRENCES, _MOST_MISSED, _GROUP, _LOYALTY = range(14, 18)


def sight_terms(
    camera: Camera, layout: BeaconLayout, min_occurrences: int, max_missed: int, group_size: int, loyalty: float
) -> Array:
    """(18,) camera, spread and place of the lights, and what makes a light steady, as `find_sights` takes them."""
    blue = layout.indices("array") + layout.indices("long_range")
    red = layout.indices("entrance")
    spreads = _spread(layout.positions_m[list(blue)]), _spread(layout.positions_m[list(red)]) if len(red) > 1 else 0.0
    lens = camera.matrix[0, 0], camera.matrix[1, 1], camera.matrix[0, 2], camera.matrix[1, 2]
    centre = layout.array_positions_m.mean(axis=0)
    return np.array(
        [*lens, *camera.distortion, *spreads, *centre, min_occurrences, max_missed, group_size, loyalty],
        dtype=np.float64,
    )


@compiled
def find_sights(numbers: Array, labels: IntArray, pose: Array, terms: Array, followed: int) -> Array:
    """Long-range and entrance bearings of a frame.

    Args:
        numbers: (n, 7 + window) of the tracks, as `LightTracker.numbers`.
        labels: (n, 6) of the tracks, as `LightTracker.labels`.
        pose: (15 or more,) rotation vector, t and R of the station in the camera frame; (0,) for none.
        terms: `sight_terms`.
        followed: track id of the single light that was followed last, -1 for none.

    Returns:
        (15,) the long-range bearing, the entrance's, and the track followed now. A bearing is its unit ray (3,), its
        pixel (2,), confidence and range, m; the confidence is nan where there is no bearing, the range where it carries
        none.
    """
    result = np.full(FOLLOWED + 1, np.nan)
    result[FOLLOWED] = followed
    lights = np.empty((len(labels), 5))
    count = _steady(numbers, labels, RED, terms, lights)
    if count > 0:
        _group(lights, count, terms[_RED_SPREAD], terms, result[ENTRANCE:FOLLOWED])
    long_range = result[LONG_RANGE:ENTRANCE]
    if len(pose) > 0:
        _array_centre(pose, terms, long_range)
        return result
    count = _steady(numbers, labels, BLUE, terms, lights)
    if count >= terms[_GROUP]:
        _group(lights, count, terms[_BLUE_SPREAD], terms, long_range)
    elif count > 0:
        best = _single(lights, count, followed, terms)
        result[FOLLOWED] = lights[best, 3]
        _bearing(lights[best, 0], lights[best, 1], lights[best, 2], np.nan, terms, long_range)
    return result


@compiled
def _steady(numbers: Array, labels: IntArray, class_id: int, terms: Array, lights: Array) -> int:
    """Put u, v, mean score over the window and track id of each steady light of a class into a row; their number."""
    window = numbers.shape[1] - HISTORY
    least, count = terms[_OCCURRENCES], 0
    for i in range(len(labels)):
        if labels[i, CLASS_ID] != class_id or labels[i, HITS] < least:
            continue
        if labels[i, MISSED] > terms[_MOST_MISSED]:
            continue
        occurrences, total = window_of(numbers, i)
        if occurrences >= least:
            lights[count, 0], lights[count, 1], lights[count, 2] = numbers[i, 0], numbers[i, 1], total / window
            lights[count, 3] = labels[i, TRACK_ID]
            count += 1
    return count


@compiled
def _surest(lights: Array, count: int) -> int:
    """The first light of the greatest weight."""
    best = 0
    for i in range(1, count):
        if lights[i, 2] > lights[best, 2]:
            best = i
    return best


@compiled
def _single(lights: Array, count: int, followed: int, terms: Array) -> int:
    """The brightest and steadiest light: greatest sum of scores over the window, with loyalty to the last."""
    best = _surest(lights, count)
    for i in range(count):
        if lights[i, 3] == followed and lights[i, 2] >= terms[_LOYALTY] * lights[best, 2]:
            return i
    return best


@compiled
def _group(lights: Array, count: int, spread_m: float, terms: Array, bearing: Array) -> None:
    """Bearing of the group's centre, strays left out; range = spread of the layout over spread of the angles."""
    n = _without_strays(lights, count)
    u = v = score = 0.0
    for i in range(n):
        u += lights[i, 0]
        v += lights[i, 1]
        score += lights[i, 2]
    u, v, score = u / n, v / n, score / n
    range_m = np.nan
    if n >= 3 and spread_m > 0.0:
        square = 0.0
        for i in range(n):
            square += (lights[i, 0] - u) ** 2 + (lights[i, 1] - v) ** 2
        square /= n
        if square > 1.0:
            range_m = spread_m * terms[FX] / math.sqrt(square)
    _bearing(u, v, score, range_m, terms, bearing)


@compiled
def _without_strays(lights: Array, count: int) -> int:
    """Move lights within three median distances of the component-wise median to the front; their number.

    Of two lights that is the surer one. The last column is for the distances.
    """
    if count < 3:
        _move(lights, _surest(lights, count), 0)
        return 1
    u, v = _upper_median(lights, 0, count), _upper_median(lights, 1, count)
    for i in range(count):
        lights[i, 4] = math.hypot(lights[i, 0] - u, lights[i, 1] - v)
    limit = 3.0 * _upper_median(lights, 4, count) + 2.0
    kept = 0
    for i in range(count):
        if lights[i, 4] <= limit:
            _move(lights, i, kept)
            kept += 1
    return kept


@compiled
def _move(lights: Array, row: int, to: int) -> None:
    """Copy a row into another's place."""
    for k in range(lights.shape[1]):
        lights[to, k] = lights[row, k]


@compiled
def _upper_median(lights: Array, column: int, count: int) -> float:
    """The median of a column's first numbers, of an even number of them the upper one."""
    for i in range(count):
        below = 0
        for k in range(count):
            if lights[k, column] < lights[i, column] or (lights[k, column] == lights[i, column] and k < i):
                below += 1
        if below == count // 2:
            return lights[i, column]
    return np.nan


@compiled
def _array_centre(pose: Array, terms: Array, bearing: Array) -> None:
    """Bearing of the array's centre under a pose."""
    centre = np.empty(3)
    for i in range(3):
        row = ROTATION + 3 * i
        centre[i] = pose[row] * terms[_CENTRE_X] + pose[row + 1] * terms[_CENTRE_Y]
        centre[i] += pose[row + 2] * terms[_CENTRE_Z]
        centre[i] += pose[TRANSLATION + i]
    range_m = math.sqrt(centre[0] * centre[0] + centre[1] * centre[1] + centre[2] * centre[2])
    for i in range(3):
        bearing[RAY + i] = centre[i] / range_m
    bearing[CENTRE], bearing[CENTRE + 1] = pixel_of(centre[0] / centre[2], centre[1] / centre[2], terms)
    bearing[SCORE], bearing[RANGE] = 1.0, range_m


@compiled
def _bearing(u: float, v: float, score: float, range_m: float, terms: Array, bearing: Array) -> None:
    """Bearing of a pixel."""
    x, y = tangents_of(u, v, terms)
    scale = 1.0 / math.sqrt(1.0 + x * x + y * y)
    bearing[RAY], bearing[RAY + 1], bearing[RAY + 2] = x * scale, y * scale, scale
    bearing[CENTRE], bearing[CENTRE + 1] = u, v
    bearing[SCORE], bearing[RANGE] = min(score, 1.0), range_m


def _spread(positions_m: Array) -> float:
    """RMS distance from the centroid, across the approach axis: what the camera sees of it from afar."""
    across = positions_m[:, 1:] - positions_m[:, 1:].mean(axis=0)
    return float(np.sqrt((across**2).sum(axis=1).mean()))
