"""Kalman tracks of lights in the image: constant velocity, confidence-weighted noise, at most ten predicted frames.

Paper A, section 4.1. All tracks are filtered at once: the axes of one light share their covariance, so a track's 4 × 4
covariance is three numbers and the whole filter a few array operations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.core.compiled import compiled
from auvdock.core.contracts import Detections
from auvdock.core.errors import ConfigError
from auvdock.perception.views import TrackViews

__all__ = ["LightTracker", "TrackerCfg"]

_UNMATCHED_COST = 40.0


@dataclass(frozen=True)
class TrackerCfg:
    """How lights are tracked."""

    pixel_sigma_px: float = 0.5
    """σ of a detection's centre at full confidence; R = σ² / (score + 0.1)."""
    acceleration_px_s2: float = 200.0
    """σ_a, standard deviation of a light's acceleration in the image."""
    initial_speed_px_s: float = 120.0
    """Standard deviation of a new track's unknown velocity."""
    gate_sigmas: float = 5.0
    """A detection farther than this from the prediction is another light."""
    max_predicted_frames: int = 10
    """A confirmed track outlives this many frames without a detection and dies at the next (paper A: 10)."""
    confirm_hits: int = 3
    """Detections after which a track is confirmed."""
    max_tentative_frames: int = 2
    """An unconfirmed track outlives this many frames without a detection."""
    window_frames: int = 6
    """Length of the history that authentication looks back on."""

    def __post_init__(self) -> None:
        """Refuse what no filter can use."""
        for name in ("pixel_sigma_px", "acceleration_px_s2", "initial_speed_px_s", "gate_sigmas"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"tracker.{name}", getattr(self, name), "a value above 0")
        for name in ("confirm_hits", "window_frames"):
            if getattr(self, name) < 1:
                raise ConfigError(f"tracker.{name}", getattr(self, name), "1 or more")
        for name in ("max_predicted_frames", "max_tentative_frames"):
            if getattr(self, name) < 0:
                raise ConfigError(f"tracker.{name}", getattr(self, name), "0 or more")


class LightTracker:
    """Tracks of all lights, one row each.

    State per track x = [u, v, u̇, v̇]; per axis F = [[1, dt], [0, 1]], Q = σ_a² [[dt⁴/4, dt³/2], [dt³/2, dt²]],
    H = [1, 0], R = σ² / (score + 0.1). Detections are assigned to predictions of their own class by the Hungarian
    method at cost d²/S + 2 ln(S/R), gated at d² / S ≤ gate².

    Attributes:
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
        self._dt = 1.0 / rate_hz
        self._limits = (cfg.confirm_hits, cfg.max_predicted_frames, cfg.max_tentative_frames)
        margin = 0.1
        self._low = np.array([-margin * width_px, -margin * height_px])
        self._high = np.array([(1.0 + margin) * width_px, (1.0 + margin) * height_px])
        self.reset()

    def reset(self) -> None:
        """Forget all tracks."""
        self.state: Array = np.zeros((0, 4))
        self.covariance: Array = np.zeros((0, 3))
        self.history: Array = np.zeros((0, self._cfg.window_frames))
        self._labels: IntArray = np.zeros((0, 6), dtype=np.int64)
        self._bind()
        self._next_id = 0
        self._slot = 0

    def __len__(self) -> int:
        """Number of tracks alive."""
        return len(self.state)

    def update(self, detections: Detections) -> None:
        """Advance one frame: predict, assign, correct, start new tracks, end old ones."""
        cfg = self._cfg
        self._slot = (self._slot + 1) % cfg.window_frames
        centre, score = detections.centre_px, detections.score
        variance = cfg.pixel_sigma_px**2 / (score + 0.1)
        if len(self.state):
            _predict(self.state, self.covariance, self._dt, cfg.acceleration_px_s2**2)
            distance = _distances(
                self.state, self.covariance, self.class_id, centre, detections.class_id, variance, cfg.gate_sigmas**2
            )
            matched = self._labels[:, 5]
            if not _only_pairs(distance, matched):
                self._assign(distance, variance, matched)
            _correct(self.state, self.covariance, matched, centre, variance)
            _count(self._labels, self.history, self._slot, score)
            alive = _alive(self._labels, self.state, self._limits, self._low, self._high)
            if not alive.all():
                self._keep(alive)
        free = np.ones(len(score), dtype=np.bool_)
        free[self.detection[self.detection >= 0]] = False
        if free.any():
            self._start(free, detections, variance)

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
        return TrackViews(self.state[:, :2], self._labels[:, :4])

    def _bind(self) -> None:
        self.track_id, self.class_id, self.beacon_id, self.missed, self.hits, self.detection = self._labels.T

    def _assign(self, distance: Array, variance: Array, matched: IntArray) -> None:
        """The Hungarian method, where several could be paired."""
        allowed = np.isfinite(distance)
        spread = self.covariance[:, :1] + variance
        # A stale track has a wide gate: the log term keeps it from taking the detection of a sharp one.
        cost = np.where(allowed, distance + 2.0 * np.log(spread / variance), _UNMATCHED_COST)
        rows, columns = linear_sum_assignment(cost)
        kept = allowed[rows, columns]
        matched.fill(-1)
        matched[rows[kept]] = columns[kept]

    def _keep(self, alive: BoolArray) -> None:
        self.state, self.covariance = self.state.compress(alive, 0), self.covariance.compress(alive, 0)
        self.history, self._labels = self.history.compress(alive, 0), self._labels.compress(alive, 0)
        self._bind()

    def _start(self, free: BoolArray, detections: Detections, variance: Array) -> None:
        index = np.flatnonzero(free)
        count = len(index)
        state = np.zeros((count, 4))
        state[:, :2] = detections.centre_px[index]
        covariance = np.zeros((count, 3))
        covariance[:, 0] = variance[index]
        covariance[:, 2] = self._cfg.initial_speed_px_s**2
        history = np.zeros((count, self._cfg.window_frames))
        history[:, self._slot] = detections.score[index]
        labels = np.zeros((count, 6), dtype=np.int64)
        labels[:, 0] = np.arange(self._next_id, self._next_id + count)
        labels[:, 1] = detections.class_id[index]
        labels[:, 2] = -1
        labels[:, 4] = 1
        labels[:, 5] = index
        self._next_id += count
        self.state = np.concatenate([self.state, state])
        self.covariance = np.concatenate([self.covariance, covariance])
        self.history = np.concatenate([self.history, history])
        self._labels = np.concatenate([self._labels, labels])
        self._bind()


@compiled
def _predict(state: Array, covariance: Array, dt: float, power: float) -> None:
    """F x and F P Fᵀ + Q of all tracks, in place."""
    for i in range(len(state)):
        for axis in range(2):
            state[i, axis] += dt * state[i, 2 + axis]
        p01, p11 = covariance[i, 1], covariance[i, 2]
        covariance[i, 0] += dt * (2.0 * p01 + dt * p11) + 0.25 * dt**4 * power
        covariance[i, 1] += dt * p11 + 0.5 * dt**3 * power
        covariance[i, 2] += dt**2 * power


@compiled
def _distances(
    state: Array,
    covariance: Array,
    class_id: IntArray,
    centre: Array,
    centre_class: IntArray,
    variance: Array,
    gate: float,
) -> Array:
    """(n, m) d² / S of tracks and detections; `inf` beyond the gate and between classes."""
    distance = np.full((len(state), len(centre)), np.inf)
    for i in range(len(state)):
        for j in range(len(centre)):
            if class_id[i] != centre_class[j]:
                continue
            x, y = state[i, 0] - centre[j, 0], state[i, 1] - centre[j, 1]
            value = (x * x + y * y) / (covariance[i, 0] + variance[j])
            if value <= gate:
                distance[i, j] = value
    return distance


@compiled
def _only_pairs(distance: Array, matched: IntArray) -> bool:
    """Put each track's detection, -1 for none, into `matched`; False where several compete for one.

    Where nobody competes the Hungarian method would find the same.
    """
    taken = np.zeros(distance.shape[1], dtype=np.bool_)
    matched[:] = -1
    for i in range(distance.shape[0]):
        for j in range(distance.shape[1]):
            if distance[i, j] == np.inf:
                continue
            if matched[i] >= 0 or taken[j]:
                return False
            matched[i], taken[j] = j, True
    return True


@compiled
def _correct(state: Array, covariance: Array, matched: IntArray, centre: Array, variance: Array) -> None:
    """Kalman correction of the tracks that have a detection, in place."""
    for i in range(len(state)):
        j = matched[i]
        if j < 0:
            continue
        p00, p01 = covariance[i, 0], covariance[i, 1]
        gain_0, gain_1 = p00 / (p00 + variance[j]), p01 / (p00 + variance[j])
        for axis in range(2):
            innovation = centre[j, axis] - state[i, axis]
            state[i, axis] += gain_0 * innovation
            state[i, 2 + axis] += gain_1 * innovation
        covariance[i, 2] -= gain_1 * p01
        covariance[i, 1] *= 1.0 - gain_0
        covariance[i, 0] *= 1.0 - gain_0


@compiled
def _count(labels: IntArray, history: Array, slot: int, score: Array) -> None:
    """Count hits and missed frames, and keep the score."""
    for i in range(len(labels)):
        j = labels[i, 5]
        if j >= 0:
            labels[i, 3] = 0
            labels[i, 4] += 1
            history[i, slot] = score[j]
        else:
            labels[i, 3] += 1
            history[i, slot] = 0.0


@compiled
def _alive(labels: IntArray, state: Array, limits: tuple[int, int, int], low: Array, high: Array) -> BoolArray:
    """(n,) tracks that go on: not missed for longer than allowed, and not far outside the image.

    A track of `limits[0]` detections or more outlives `limits[1]` frames without one, others `limits[2]`.
    """
    alive = np.empty(len(labels), dtype=np.bool_)
    for i in range(len(labels)):
        most = limits[1] if labels[i, 4] >= limits[0] else limits[2]
        alive[i] = labels[i, 3] <= most and low[0] < state[i, 0] < high[0] and low[1] < state[i, 1] < high[1]
    return alive
