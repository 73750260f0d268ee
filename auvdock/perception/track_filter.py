"""One frame of all tracks in one compiled call: predict, pair, correct, count, end and start; loops of the tracker.

A track is a row of two tables, its numbers and its labels (`numeric.tracks`). The tables have room for more rows than
there are tracks, so tracks end and start in place. The filter's settings come as one array, `filter_terms`: Numba takes
that at the price of a single number.
"""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.tracks import (
    BEACON_ID,
    CLASS_ID,
    COVARIANCE,
    DETECTION,
    HISTORY,
    HITS,
    LABELS,
    MISSED,
    TRACK_ID,
)

__all__ = ["advance", "distances", "filter_terms", "settle"]

_DT, _POWER, _GATE, _PIXEL, _SPEED, _LEFT, _TOP, _RIGHT, _BOTTOM, _CONFIRM, _LASTING, _TENTATIVE = range(12)


def filter_terms(
    dt_s: float,
    acceleration_px_s2: float,
    gate_sigmas: float,
    pixel_sigma_px: float,
    initial_speed_px_s: float,
    border_px: tuple[float, float, float, float],
    limits: tuple[int, int, int],
) -> Array:
    """(12,) the filter's settings.

    Args:
        dt_s: time of a frame.
        acceleration_px_s2: σ_a.
        gate_sigmas: gate on a detection's distance.
        pixel_sigma_px: σ of a detection at full confidence.
        initial_speed_px_s: σ of a new track's velocity.
        border_px: left, top, right, bottom beyond which a track ends.
        limits: a track of the first number of detections or more outlives the second number of frames without one,
            others the third.
    """
    squares = acceleration_px_s2**2, gate_sigmas**2, pixel_sigma_px**2, initial_speed_px_s**2
    return np.array([dt_s, *squares, *border_px, *limits])


@compiled
def advance(
    numbers: Array,
    labels: IntArray,
    count: int,
    centre: Array,
    score: Array,
    class_id: IntArray,
    terms: Array,
    slot: int,
    next_id: int,
) -> tuple[int, int]:
    """Advance all tracks by one frame, in place.

    Args:
        numbers: (most, 7 + window) table with room for `count` tracks and as many as there are detections.
        labels: (most, 6) table.
        count: tracks so far.
        centre: (m, 2) detections, px.
        score: (m,) their confidence.
        class_id: (m,) their class.
        terms: `filter_terms`.
        slot: this frame's place in the window.
        next_id: of the next new track.

    Returns:
        The tracks after this frame and the next id. The first is -1 where detections compete: then the tracks are only
        predicted, `distances` tells what may be paired, and `settle` does the rest.
    """
    _predict(numbers, count, terms)
    if not _pair(numbers, labels, count, centre, score, class_id, terms):
        return -1, next_id
    return settle(numbers, labels, count, centre, score, class_id, terms, slot, next_id)


@compiled
def settle(
    numbers: Array,
    labels: IntArray,
    count: int,
    centre: Array,
    score: Array,
    class_id: IntArray,
    terms: Array,
    slot: int,
    next_id: int,
) -> tuple[int, int]:
    """Correct the predicted tracks by their paired detections, end old ones and start new ones; as `advance`.

    A track goes on if it was not missed for longer than allowed and does not lie far outside the image. A detection
    that no such track holds starts a new one.
    """
    taken = np.zeros(len(score), dtype=np.bool_)
    kept = 0
    for i in range(count):
        j = labels[i, DETECTION]
        if j >= 0:
            _correct(numbers, i, centre, j, _variance(score, j, terms))
            labels[i, MISSED] = 0
            labels[i, HITS] += 1
            numbers[i, HISTORY + slot] = score[j]
        else:
            labels[i, MISSED] += 1
            numbers[i, HISTORY + slot] = 0.0
        u, v = numbers[i, 0], numbers[i, 1]
        most = terms[_LASTING] if labels[i, HITS] >= terms[_CONFIRM] else terms[_TENTATIVE]
        inside = terms[_LEFT] < u < terms[_RIGHT] and terms[_TOP] < v < terms[_BOTTOM]
        if labels[i, MISSED] > most or not inside:
            continue
        if j >= 0:
            taken[j] = True
        if kept < i:
            for k in range(numbers.shape[1]):
                numbers[kept, k] = numbers[i, k]
            for k in range(LABELS):
                labels[kept, k] = labels[i, k]
        kept += 1
    for j in range(len(score)):
        if taken[j]:
            continue
        for k in range(numbers.shape[1]):
            numbers[kept, k] = 0.0
        numbers[kept, 0], numbers[kept, 1] = centre[j, 0], centre[j, 1]
        numbers[kept, COVARIANCE], numbers[kept, COVARIANCE + 2] = _variance(score, j, terms), terms[_SPEED]
        numbers[kept, HISTORY + slot] = score[j]
        labels[kept, TRACK_ID], labels[kept, CLASS_ID], labels[kept, BEACON_ID] = next_id, class_id[j], -1
        labels[kept, MISSED], labels[kept, HITS], labels[kept, DETECTION] = 0, 1, j
        next_id += 1
        kept += 1
    return kept, next_id


@compiled
def distances(
    numbers: Array, labels: IntArray, count: int, centre: Array, score: Array, class_id: IntArray, terms: Array
) -> Array:
    """(n, m) d² / S of predicted tracks and detections; `inf` beyond the gate and between classes."""
    distance = np.empty((count, len(score)))
    for j in range(len(score)):
        variance = _variance(score, j, terms)
        for i in range(count):
            distance[i, j] = _distance(numbers, labels, i, centre, class_id, j, variance, terms)
    return distance


@compiled
def _variance(score: Array, j: int, terms: Array) -> float:
    """R = σ² / (score + 0.1) of detection j."""
    return terms[_PIXEL] / (score[j] + 0.1)


@compiled
def _predict(numbers: Array, count: int, terms: Array) -> None:
    """F x and F P Fᵀ + Q of all tracks, in place."""
    dt, power = terms[_DT], terms[_POWER]
    for i in range(count):
        for axis in range(2):
            numbers[i, axis] += dt * numbers[i, 2 + axis]
        p01, p11 = numbers[i, COVARIANCE + 1], numbers[i, COVARIANCE + 2]
        numbers[i, COVARIANCE] += dt * (2.0 * p01 + dt * p11) + 0.25 * dt**4 * power
        numbers[i, COVARIANCE + 1] += dt * p11 + 0.5 * dt**3 * power
        numbers[i, COVARIANCE + 2] += dt**2 * power


@compiled
def _distance(
    numbers: Array,
    labels: IntArray,
    i: int,
    centre: Array,
    class_id: IntArray,
    j: int,
    variance: float,
    terms: Array,
) -> float:
    """d² / S of track i and detection j, `inf` where they cannot be the same light."""
    if labels[i, CLASS_ID] != class_id[j]:
        return np.inf
    x, y = numbers[i, 0] - centre[j, 0], numbers[i, 1] - centre[j, 1]
    value = (x * x + y * y) / (numbers[i, COVARIANCE] + variance)
    return value if value <= terms[_GATE] else np.inf


@compiled
def _pair(
    numbers: Array, labels: IntArray, count: int, centre: Array, score: Array, class_id: IntArray, terms: Array
) -> bool:
    """Label each track with its detection, -1 for none; False where several compete for one.

    Where nobody competes the Hungarian method would find the same.
    """
    for i in range(count):
        labels[i, DETECTION] = -1
    for j in range(len(score)):
        variance = _variance(score, j, terms)
        taken = False
        for i in range(count):
            if _distance(numbers, labels, i, centre, class_id, j, variance, terms) == np.inf:
                continue
            if taken or labels[i, DETECTION] >= 0:
                return False
            labels[i, DETECTION], taken = j, True
    return True


@compiled
def _correct(numbers: Array, i: int, centre: Array, j: int, variance: float) -> None:
    """Kalman correction of track i by detection j, in place."""
    p00, p01 = numbers[i, COVARIANCE], numbers[i, COVARIANCE + 1]
    gain_0, gain_1 = p00 / (p00 + variance), p01 / (p00 + variance)
    for axis in range(2):
        innovation = centre[j, axis] - numbers[i, axis]
        numbers[i, axis] += gain_0 * innovation
        numbers[i, 2 + axis] += gain_1 * innovation
    numbers[i, COVARIANCE + 2] -= gain_1 * p01
    numbers[i, COVARIANCE + 1] *= 1.0 - gain_0
    numbers[i, COVARIANCE] *= 1.0 - gain_0
