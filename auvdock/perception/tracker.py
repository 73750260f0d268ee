"""Kalman tracks of lights in the image: constant velocity, confidence-weighted noise, at most ten predicted frames.

Paper A, section 4.1. All tracks are filtered at once (`perception.track_filter`): the axes of one light share their
covariance, so a track's 4 × 4 covariance is three numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array, IntArray
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections
from auvdock.core.limits import Count, Positive, at_least, between
from auvdock.numeric.tracks import COVARIANCE, DETECTION, HISTORY, LABELS, STATE
from auvdock.perception.track_filter import advance, distances, filter_terms, settle
from auvdock.perception.views import TrackViews

__all__ = ["LightTracker", "TrackerCfg"]

_UNMATCHED_COST = 40.0
_ROOM = 32
"""Tracks that there is room for at first."""
_MARGIN = 0.1
"""Share of the image by which a track may lie outside it."""
_LABEL_VIEWS = ("track_id", "class_id", "beacon_id", "missed", "hits", "detection")
_VIEWS = ("numbers", "labels", "state", "covariance", "history", *_LABEL_VIEWS)


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

    All arrays are views of two tables that the next frame goes on in.

    Attributes:
        numbers: (n, 7 + window) state, covariance and history side by side.
        labels: (n, 6) track id, class, beacon, missed, hits and detection side by side.
        state: (n, 4) u, v in px and u̇, v̇ in px/s.
        covariance: (n, 3) per-axis P₀₀ in px², P₀₁ in px²/s, P₁₁ in px²/s².
        track_id: (n,) unique since the last reset.
        class_id: (n,) class of the light.
        missed: (n,) consecutive frames without a detection.
        hits: (n,) detections so far.
        beacon_id: (n,) authenticated beacon, -1 for none; the association writes it.
        detection: (n,) index of this frame's detection, -1 for none.
        history: (n, window) scores in the last frames in no particular order, 0 where there was no detection.
    """

    def __init__(self, cfg: TrackerCfg, rate_hz: float, width_px: int, height_px: int) -> None:
        """Precompute the filter's constants for a camera's rate and size."""
        self._cfg = cfg
        self._terms = filter_terms(
            1.0 / rate_hz,
            cfg.acceleration_px_s2,
            cfg.gate_sigmas,
            cfg.pixel_sigma_px,
            cfg.initial_speed_px_s,
            (-_MARGIN * width_px, -_MARGIN * height_px, (1.0 + _MARGIN) * width_px, (1.0 + _MARGIN) * height_px),
            (cfg.confirm_hits, cfg.max_predicted_frames, cfg.max_tentative_frames),
        )
        self.reset()

    def reset(self) -> None:
        """Forget all tracks."""
        self._all_numbers = np.zeros((_ROOM, HISTORY + self._cfg.window_frames))
        self._all_labels = np.zeros((_ROOM, LABELS), dtype=np.int64)
        self._bind(0)
        self._next_id = 0
        self._slot = 0

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the views: a copy of a view no longer follows its table."""
        return {name: value for name, value in self.__dict__.items() if name not in _VIEWS}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the views anew, of the copied tables."""
        self.__dict__.update(state)
        self._bind(self._count)

    def __len__(self) -> int:
        """Number of tracks alive."""
        return self._count

    def update(self, detections: Detections) -> None:
        """Advance one frame: predict, assign, correct, start new tracks, end old ones."""
        self._slot = (self._slot + 1) % self._cfg.window_frames
        centre, score, class_id = detections.centre_px, detections.score, detections.class_id
        before, terms = self._count, self._terms
        if before + len(score) > len(self._all_labels):
            self._make_room(before + len(score))
        numbers, labels = self._all_numbers, self._all_labels
        count, next_id = advance(numbers, labels, before, centre, score, class_id, terms, self._slot, self._next_id)
        if count < 0:
            self._assign(distances(numbers, labels, before, centre, score, class_id, terms), score)
            count, next_id = settle(numbers, labels, before, centre, score, class_id, terms, self._slot, self._next_id)
        self._next_id = next_id
        if count != before:
            self._bind(count)

    def position_sigma_px(self) -> Array:
        """(n,) standard deviation of each track's position, per axis."""
        return np.sqrt(self.covariance[:, 0])

    def occurrences(self) -> IntArray:
        """(n,) detections within the window."""
        return np.count_nonzero(self.history, axis=1)

    def mean_confidence(self) -> Array:
        """(n,) mean score of the detections within the window, 0 where there is none."""
        return self.history.sum(axis=1) / np.maximum(self.occurrences(), 1)

    def views(self) -> TrackViews:
        """The tracks as they are now, for recordings."""
        return TrackViews(self.numbers, self.labels)

    def _bind(self, count: int) -> None:
        self._count = count
        self.numbers: Array = self._all_numbers[:count]
        self.labels: IntArray = self._all_labels[:count]
        self.state: Array = self.numbers[:, STATE:COVARIANCE]
        self.covariance: Array = self.numbers[:, COVARIANCE:HISTORY]
        self.history: Array = self.numbers[:, HISTORY:]
        self.track_id, self.class_id, self.beacon_id, self.missed, self.hits, self.detection = self.labels.T

    def _make_room(self, least: int) -> None:
        """For as many tracks and more."""
        numbers, labels = self.numbers, self.labels
        self._all_numbers = np.zeros((2 * least, numbers.shape[1]))
        self._all_labels = np.zeros((2 * least, LABELS), dtype=np.int64)
        self._all_numbers[: self._count], self._all_labels[: self._count] = numbers, labels
        self._bind(self._count)

    def _assign(self, distance: Array, score: Array) -> None:
        """The Hungarian method, where several could be paired."""
        variance = self._cfg.pixel_sigma_px**2 / (score + 0.1)
        allowed = np.isfinite(distance)
        spread = self.covariance[:, :1] + variance
        # A stale track has a wide gate: the log term keeps it from taking the detection of a sharp one.
        cost = np.where(allowed, distance + 2.0 * np.log(spread / variance), _UNMATCHED_COST)
        rows, columns = linear_sum_assignment(cost)
        kept = allowed[rows, columns]
        matched = self.labels[:, DETECTION]
        matched.fill(-1)
        matched[rows[kept]] = columns[kept]
