"""Which candidates may be which beacons, in one compiled call each: the loops of `perception.authentication`."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import BLUE
from auvdock.numeric.records import Records
from auvdock.numeric.tracks import Track, window_of

__all__ = ["propose", "surest_lights"]

_LEAST_DEPTH_M = 0.1
_LEAST_SPREAD = 1e-12


@compiled
def surest_lights(
    tracks: Records[Track], scores: Array, min_occurrences: int, min_confidence: float, most: int
) -> IntArray:
    """Rows (c,) of the blue tracks that are seen now, often and surely enough, surest first, at most `most`.

    Args:
        tracks: (n,) tracks.
        scores: (n, window) their scores in the last frames.
        min_occurrences: least number of detections within the window.
        min_confidence: their least mean score.
        most: only so many.
    """
    rows, confidence = np.empty(len(tracks), dtype=np.int64), np.empty(len(tracks))
    count = 0
    for i in range(len(tracks)):
        if tracks[i].class_id != BLUE or tracks[i].detection < 0:
            continue
        occurrences, total = window_of(scores[i])
        mean = total / max(occurrences, 1)
        if occurrences < min_occurrences or mean < min_confidence:
            continue
        place = count
        while place > 0 and confidence[place - 1] < mean:
            rows[place], confidence[place] = rows[place - 1], confidence[place - 1]
            place -= 1
        rows[place], confidence[place] = i, mean
        count += 1
    return rows[: min(count, most)]


@compiled
def propose(
    xy: Array,
    rotation: Array,
    points: Array,
    pairs: IntArray,
    min_cosine: float,
    tolerance_m: float,
    tolerance: float,
    min_beacons: int,
    most: int,
) -> IntArray:
    """Possible identities, best first.

    Two candidates in the direction of a pair of beacons fix, with the rotation known, where all other beacons must be.
    Badness = Σ over beacons of distance / tolerance to the nearest candidate, 1 where none is within the tolerance.

    Args:
        xy: (n, 2) undistorted normalised image coordinates of the candidates.
        rotation: (3, 3) R_camera_station of the vehicle's own attitude.
        points: (k, 3) array beacons in the station frame.
        pairs: (p, 2) beacons that candidates may be taken for.
        min_cosine: of the angle between the direction of two candidates and that of a pair.
        tolerance_m: how far off a candidate may be, seen at the array's distance, and
        tolerance: added to it in normalised coordinates.
        min_beacons: that a proposal must find.
        most: proposals wanted.

    Returns:
        (m, k) for each proposal and beacon the index of its candidate, -1 where it is not seen.
    """
    count, size = 0, len(points)
    proposals, badnesses = np.empty((most, size), dtype=np.int64), np.empty(most)
    identity, distance = np.empty(size, dtype=np.int64), np.empty(size)
    q, translation = np.empty((size, 3)), np.empty(3)
    for i in range(size):
        for j in range(3):
            q[i, j] = points[i, 0] * rotation[j, 0] + points[i, 1] * rotation[j, 1] + points[i, 2] * rotation[j, 2]
    for a in range(len(xy)):
        for b in range(len(xy)):
            if a == b:
                continue
            for pair in range(len(pairs)):
                low, high = pairs[pair, 0], pairs[pair, 1]
                if not _cosine(xy, a, b, q, low, high) >= min_cosine:
                    continue
                if not _translate(xy, a, b, q, low, high, translation):
                    continue
                reach = tolerance_m / translation[2] + tolerance
                badness = _name(xy, q, translation, reach, identity, distance)
                if _count(identity) < min_beacons:
                    continue
                _leave_one_each(identity, distance)
                if _count(identity) < min_beacons:
                    continue
                count = _enter(identity, badness, proposals, badnesses, count)
    return proposals[:count]


@compiled
def _cosine(xy: Array, a: int, b: int, q: Array, low: int, high: int) -> float:
    """Of the angle in the image between two candidates' direction and two beacons'."""
    x, y = xy[b, 0] - xy[a, 0], xy[b, 1] - xy[a, 1]
    u, v = q[high, 0] - q[low, 0], q[high, 1] - q[low, 1]
    return (x * u + y * v) / (math.sqrt(x * x + y * y) * math.sqrt(u * u + v * v) + 1e-12)


@compiled
def _translate(xy: Array, a: int, b: int, q: Array, low: int, high: int, translation: Array) -> bool:
    """Put the least-squares translation (3,) of two images, rotation known, in place; False where it means nothing.

    All beacons must lie in front of the camera.
    """
    spread = along = 0.0
    for axis in range(2):
        e_a = xy[a, axis] * q[low, 2] - q[low, axis]
        e_b = xy[b, axis] * q[high, 2] - q[high, axis]
        mean = (xy[a, axis] + xy[b, axis]) / 2.0
        off_a, off_b = xy[a, axis] - mean, xy[b, axis] - mean
        spread += off_a * off_a + off_b * off_b
        along += off_a * e_a + off_b * e_b
    if spread <= _LEAST_SPREAD:
        return False
    depth = -along / spread
    if not depth > _LEAST_DEPTH_M:
        return False
    for axis in range(2):
        mean_e = (xy[a, axis] * q[low, 2] - q[low, axis] + xy[b, axis] * q[high, 2] - q[high, axis]) / 2.0
        translation[axis] = mean_e + (xy[a, axis] + xy[b, axis]) / 2.0 * depth
    translation[2] = depth
    for i in range(len(q)):
        if not q[i, 2] + depth > _LEAST_DEPTH_M:
            return False
    return True


@compiled
def _name(xy: Array, q: Array, translation: Array, reach: float, identity: IntArray, distance: Array) -> float:
    """Put each beacon's nearest candidate, -1 beyond reach, and its distance (k,) in place; the badness."""
    badness = 0.0
    for i in range(len(q)):
        depth = q[i, 2] + translation[2]
        x, y = (q[i, 0] + translation[0]) / depth, (q[i, 1] + translation[1]) / depth
        nearest, distance[i] = -1, np.inf
        for j in range(len(xy)):
            gap = math.sqrt((x - xy[j, 0]) ** 2 + (y - xy[j, 1]) ** 2)
            if gap < distance[i]:
                nearest, distance[i] = j, gap
        identity[i] = nearest if distance[i] <= reach else -1
        badness += distance[i] / reach if distance[i] <= reach else 1.0
    return badness


@compiled
def _count(identity: IntArray) -> int:
    """Number of beacons that have a candidate."""
    count = 0
    for i in range(len(identity)):
        if identity[i] >= 0:
            count += 1
    return count


@compiled
def _leave_one_each(identity: IntArray, distance: Array) -> None:
    """Leave each candidate to the nearest beacon that claims it; the first of those equally near."""
    for i in range(len(identity)):
        for k in range(i + 1, len(identity)):
            if identity[i] < 0 or identity[k] != identity[i]:
                continue
            if distance[k] < distance[i]:
                identity[i] = -1
            else:
                identity[k] = -1


@compiled
def _enter(identity: IntArray, badness: float, proposals: IntArray, badnesses: Array, count: int) -> int:
    """Enter a proposal in the list of the best, each identity once at its best; the list's new length."""
    end = count
    for i in range(count):
        same = True
        for k in range(len(identity)):
            same &= proposals[i, k] == identity[k]
        if same:
            if badnesses[i] <= badness:
                return count
            end = i
    if end == count:
        if count < len(badnesses):
            count += 1
        elif badnesses[count - 1] <= badness:
            return count
        end = count - 1
    # Those that are worse move down, over the place of the same identity or the last.
    while end > 0 and badnesses[end - 1] > badness:
        badnesses[end] = badnesses[end - 1]
        for k in range(len(identity)):
            proposals[end, k] = proposals[end - 1, k]
        end -= 1
    badnesses[end] = badness
    for k in range(len(identity)):
        proposals[end, k] = identity[k]
    return count
