"""Kalman tracks of lights in the image: constant velocity, confidence-weighted noise, at most ten predicted frames.

Paper A, section 4.1. All tracks are filtered at once (`perception.track_filter`): the axes of one light share their
covariance, so a track's 4 × 4 covariance is three numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array, IntArray
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections
from auvdock.core.limits import Count, Positive, at_least, between
from auvdock.numeric.records import Records
from auvdock.numeric.tracks import Track
from auvdock.perception.track_filter import TrackLaw, advance, distances, settle
from auvdock.perception.views import TrackViews

__all__ = ["LightTracker", "TrackerCfg"]

_UNMATCHED_COST = 40.0
_ROOM = 32
"""Tracks that there is room for at first."""
_MARGIN = 0.1
"""Share of the image by which a track may lie outside it."""


@dataclass(frozen=True)
class TrackerCfg(Checked):
    """How lights are tracked."""

    pixel_sigma_px: Positive = 0.5
    """σ of a detection's centre at full confidence; R = σ² / (score + 0.1)."""
    acceleration_px_s2: Positive = 200.0
    """σ_a, standard deviation of a light's acceleration in the image."""
    initial_speed_px_s: Positive = 120.0
    """Standard deviation of a new track's unknown velocity."""
    gate_sigmas: Positive = 5.0
    """A detection farther than this from the prediction is another light."""
    max_predicted_frames: Annotated[int, at_least(0)] = 10
    """A confirmed track outlives this many frames without a detection and dies at the next (paper A: 10)."""
    confirm_hits: Count = 3
    """Detections after which a track is confirmed."""
    max_tentative_frames: Annotated[int, at_least(0)] = 2
    """An unconfirmed track outlives this many frames without a detection."""
    window_frames: Annotated[int, between(1, 1000)] = 6
    """Length of the history that authentication looks back on."""


class LightTracker:
    """Tracks of all lights, one row each.

    State per track x = [u, v, u̇, v̇]; per axis F = [[1, dt], [0, 1]], Q = σ_a² [[dt⁴/4, dt³/2], [dt³/2, dt²]],
    H = [1, 0], R = σ² / (score + 0.1). Detections are assigned to predictions of their own class by the Hungarian
    method at cost d²/S + 2 ln(S/R), gated at d² / S ≤ gate².

    All arrays that it shows are views of two tables that the next frame goes on in.
    """

    def __init__(self, cfg: TrackerCfg, rate_hz: float, width_px: int, height_px: int) -> None:
        """Precompute the filter's constants for a camera's rate and size."""
        self._cfg = cfg
        self._law = TrackLaw(
            dt_s=1.0 / rate_hz,
            acceleration2_px2_s4=cfg.acceleration_px_s2**2,
            gate2=cfg.gate_sigmas**2,
            centre_variance_px2=cfg.pixel_sigma_px**2,
            speed_variance_px2_s2=cfg.initial_speed_px_s**2,
            left_px=-_MARGIN * width_px,
            top_px=-_MARGIN * height_px,
            right_px=(1.0 + _MARGIN) * width_px,
            bottom_px=(1.0 + _MARGIN) * height_px,
            confirm_hits=cfg.confirm_hits,
            max_predicted_frames=cfg.max_predicted_frames,
            max_tentative_frames=cfg.max_tentative_frames,
        ).packed()
        self.reset()

    def reset(self) -> None:
        """Forget all tracks."""
        self._table = Track.zeros(_ROOM)
        self._scores = np.zeros((_ROOM, self._cfg.window_frames))
        self._count = 0
        self._next_id = 0
        self._slot = 0

    def __len__(self) -> int:
        """Number of tracks alive."""
        return self._count

    @property
    def table(self) -> Records[Track]:
        """(n,) all that is known of the tracks but their scores."""
        return self._table[: self._count]

    @property
    def scores(self) -> Array:
        """(n, window) scores in the last frames in no particular order, 0 where there was no detection."""
        return self._scores[: self._count]

    @property
    def centre_px(self) -> Array:
        """(n, 2) u, v."""
        return self.table["centre_px"]

    @property
    def track_id(self) -> IntArray:
        """(n,) unique since the last reset."""
        return self.table["track_id"]

    @property
    def class_id(self) -> IntArray:
        """(n,) class of the light."""
        return self.table["class_id"]

    @property
    def beacon_id(self) -> IntArray:
        """(n,) authenticated beacon, -1 for none; the association writes it."""
        return self.table["beacon_id"]

    @property
    def missed(self) -> IntArray:
        """(n,) consecutive frames without a detection."""
        return self.table["missed"]

    @property
    def hits(self) -> IntArray:
        """(n,) detections so far."""
        return self.table["hits"]

    @property
    def detection(self) -> IntArray:
        """(n,) index of this frame's detection, -1 for none."""
        return self.table["detection"]

    def update(self, detections: Detections) -> None:
        """Advance one frame: predict, assign, correct, start new tracks, end old ones."""
        self._slot = (self._slot + 1) % self._cfg.window_frames
        centre, score, class_id = detections.centre_px, detections.score, detections.class_id
        before, law = self._count, self._law
        if before + len(score) > len(self._table):
            self._make_room(before + len(score))
        table, scores = self._table, self._scores
        count, next_id = advance(table, scores, before, centre, score, class_id, law, self._slot, self._next_id)
        if count < 0:
            self._assign(distances(self.table, centre, score, class_id, law), score)
            count, next_id = settle(table, scores, before, centre, score, class_id, law, self._slot, self._next_id)
        self._count, self._next_id = count, next_id

    def mean_confidence(self) -> Array:
        """(n,) mean score of the detections within the window, 0 where there is none."""
        return self.scores.sum(axis=1) / np.maximum(np.count_nonzero(self.scores, axis=1), 1)

    def views(self) -> TrackViews:
        """The tracks as they are now, for recordings."""
        return TrackViews(self.table)

    def _make_room(self, least: int) -> None:
        """For as many tracks and more."""
        table, scores = Track.zeros(2 * least), np.zeros((2 * least, self._cfg.window_frames))
        table[: self._count], scores[: self._count] = self.table, self.scores
        self._table, self._scores = table, scores

    def _assign(self, distance: Array, score: Array) -> None:
        """The Hungarian method, where several could be paired."""
        variance = self._cfg.pixel_sigma_px**2 / (score + 0.1)
        allowed = np.isfinite(distance)
        spread = self.table["p00_px2"][:, None] + variance
        # A stale track has a wide gate: the log term keeps it from taking the detection of a sharp one.
        cost = np.where(allowed, distance + 2.0 * np.log(spread / variance), _UNMATCHED_COST)
        rows, columns = linear_sum_assignment(cost)
        kept = allowed[rows, columns]
        self.detection.fill(-1)
        self.detection[rows[kept]] = columns[kept]
