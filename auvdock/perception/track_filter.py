"""One frame of all tracks in one compiled call: predict, pair, correct, count, end and start; loops of the tracker.

A track is a row of two tables, `Track` and its scores in the last frames. The tables have room for more rows than there
are tracks, so tracks end and start in place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.numeric.tracks import Track

__all__ = ["TrackLaw", "advance", "distances", "settle"]


@dataclass(frozen=True)
class TrackLaw(Record):
    """The filter's settings, squared where the filter takes squares."""

    dt_s: float
    """Time of a frame."""
    acceleration2_px2_s4: float
    """σ_a²."""
    gate2: float
    """Greatest d² / S of a detection."""
    centre_variance_px2: float
    """σ² of a detection at full confidence."""
    speed_variance_px2_s2: float
    """Of a new track's unknown velocity, per axis."""
    left_px: float
    """A track ends left of this, above `top_px`, right of `right_px` or below `bottom_px`."""
    top_px: float
    right_px: float
    bottom_px: float
    confirm_hits: int
    """A track of so many detections outlives `max_predicted_frames` without one, others `max_tentative_frames`."""
    max_predicted_frames: int
    max_tentative_frames: int


@compiled
def advance(
    tracks: Records[Track],
    scores: Array,
    count: int,
    centre: Array,
    score: Array,
    class_id: IntArray,
    law: Records[TrackLaw],
    slot: int,
    next_id: int,
) -> tuple[int, int]:
    """Advance all tracks by one frame, in place.

    Args:
        tracks: (most,) table with room for `count` tracks and as many as there are detections.
        scores: (most, window) scores of the tracks' detections in the last frames, 0 for none.
        count: tracks so far.
        centre: (m, 2) detections, px.
        score: (m,) their confidence.
        class_id: (m,) their class.
        law: the settings.
        slot: this frame's place in the window.
        next_id: of the next new track.

    Returns:
        The tracks after this frame and the next id. The first is -1 where detections compete: then the tracks are only
        predicted, `distances` tells what may be paired, and `settle` does the rest.
    """
    _predict(tracks[:count], law[0])
    if not _pair(tracks[:count], centre, score, class_id, law[0]):
        return -1, next_id
    return settle(tracks, scores, count, centre, score, class_id, law, slot, next_id)


@compiled
def settle(
    tracks: Records[Track],
    scores: Array,
    count: int,
    centre: Array,
    score: Array,
    class_id: IntArray,
    law: Records[TrackLaw],
    slot: int,
    next_id: int,
) -> tuple[int, int]:
    """Correct the predicted tracks by their paired detections, end old ones and start new ones; as `advance`.

    A track goes on if it was not missed for longer than allowed and does not lie far outside the image. A detection
    that no such track holds starts a new one.
    """
    held = np.zeros(len(score), dtype=np.bool_)
    kept = 0
    for i in range(count):
        j = tracks[i].detection
        if j >= 0:
            _correct(tracks[i], centre[j], _variance(score[j], law[0]))
        else:
            tracks[i].missed += 1
        scores[i, slot] = score[j] if j >= 0 else 0.0
        if not _goes_on(tracks[i], law[0]):
            continue
        if j >= 0:
            held[j] = True
        if kept < i:
            tracks[kept] = tracks[i]
            scores[kept] = scores[i]
        kept += 1
    for j in range(len(score)):
        if not held[j]:
            _start(tracks[kept], centre[j], _variance(score[j], law[0]), law[0])
            tracks[kept].track_id, tracks[kept].class_id, tracks[kept].detection = next_id, class_id[j], j
            scores[kept] = 0.0
            scores[kept, slot] = score[j]
            next_id += 1
            kept += 1
    return kept, next_id


@compiled
def distances(tracks: Records[Track], centre: Array, score: Array, class_id: IntArray, law: Records[TrackLaw]) -> Array:
    """(n, m) d² / S of predicted tracks and detections; `inf` beyond the gate and between classes."""
    distance = np.empty((len(tracks), len(score)))
    for j in range(len(score)):
        variance = _variance(score[j], law[0])
        for i in range(len(tracks)):
            distance[i, j] = _distance(tracks[i], centre[j], class_id[j], variance, law[0])
    return distance


@compiled
def _variance(score: float, law: TrackLaw) -> float:
    """R = σ² / (score + 0.1) of a detection."""
    return law.centre_variance_px2 / (score + 0.1)


@compiled
def _predict(tracks: Records[Track], law: TrackLaw) -> None:
    """F x and F P Fᵀ + Q of all tracks, in place."""
    dt, power = law.dt_s, law.acceleration2_px2_s4
    for i in range(len(tracks)):
        track = tracks[i]
        for axis in range(2):
            track.centre_px[axis] += dt * track.velocity_px_s[axis]
        p01, p11 = track.p01_px2_s, track.p11_px2_s2
        track.p00_px2 += dt * (2.0 * p01 + dt * p11) + 0.25 * dt**4 * power
        track.p01_px2_s += dt * p11 + 0.5 * dt**3 * power
        track.p11_px2_s2 += dt**2 * power


@compiled
def _distance(track: Track, centre: Array, class_id: int, variance: float, law: TrackLaw) -> float:
    """d² / S of a track and a detection, `inf` where they cannot be the same light."""
    if track.class_id != class_id:
        return np.inf
    x, y = track.centre_px[0] - centre[0], track.centre_px[1] - centre[1]
    value = (x * x + y * y) / (track.p00_px2 + variance)
    return value if value <= law.gate2 else np.inf


@compiled
def _pair(tracks: Records[Track], centre: Array, score: Array, class_id: IntArray, law: TrackLaw) -> bool:
    """Give each track its detection, -1 for none; False where several compete for one.

    Where nobody competes the Hungarian method would find the same.
    """
    for i in range(len(tracks)):
        tracks[i].detection = -1
    for j in range(len(score)):
        variance = _variance(score[j], law)
        held = False
        for i in range(len(tracks)):
            if _distance(tracks[i], centre[j], class_id[j], variance, law) == np.inf:
                continue
            if held or tracks[i].detection >= 0:
                return False
            tracks[i].detection, held = j, True
    return True


@compiled
def _correct(track: Track, centre: Array, variance: float) -> None:
    """Kalman correction of a track by its detection, in place."""
    p00, p01 = track.p00_px2, track.p01_px2_s
    gain_0, gain_1 = p00 / (p00 + variance), p01 / (p00 + variance)
    for axis in range(2):
        innovation = centre[axis] - track.centre_px[axis]
        track.centre_px[axis] += gain_0 * innovation
        track.velocity_px_s[axis] += gain_1 * innovation
    track.p11_px2_s2 -= gain_1 * p01
    track.p01_px2_s *= 1.0 - gain_0
    track.p00_px2 *= 1.0 - gain_0
    track.missed = 0
    track.hits += 1


@compiled
def _goes_on(track: Track, law: TrackLaw) -> bool:
    """Whether a track was not missed for longer than allowed and does not lie far outside the image."""
    u, v = track.centre_px[0], track.centre_px[1]
    most = law.max_predicted_frames if track.hits >= law.confirm_hits else law.max_tentative_frames
    return track.missed <= most and law.left_px < u < law.right_px and law.top_px < v < law.bottom_px


@compiled
def _start(track: Track, centre: Array, variance: float, law: TrackLaw) -> None:
    """Make a row the new track of a detection."""
    for axis in range(2):
        track.centre_px[axis], track.velocity_px_s[axis] = centre[axis], 0.0
    track.p00_px2, track.p01_px2_s, track.p11_px2_s2 = variance, 0.0, law.speed_variance_px2_s2
    track.beacon_id, track.missed, track.hits = -1, 0, 1
