"""Kalman tracks of lights in the image: constant velocity, confidence-weighted noise, at most ten predicted frames.

Paper A, section 4.1. All tracks are filtered at once: the axes of one light share their covariance, so a track's 4 × 4
covariance is three numbers and the whole filter a few array operations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array, BoolArray, IntArray, constant
from auvdock.core.contracts import Detections
from auvdock.core.errors import ConfigError
from auvdock.perception.views import TrackViews

__all__ = ["LightTracker", "TrackerCfg"]

_UNMATCHED_COST = 40.0
_NONE = np.zeros(0, dtype=np.int64)
_LEAST_SCORE, _ONE, _TWO = constant(0.1), constant(1.0), constant(2.0)


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
        dt, power = 1.0 / rate_hz, cfg.acceleration_px_s2**2
        self._dt = constant(dt)
        self._q = constant(0.25 * dt**4 * power), constant(0.5 * dt**3 * power), constant(dt**2 * power)
        self._gate = constant(cfg.gate_sigmas**2)
        self._variance = constant(cfg.pixel_sigma_px**2)
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
        n, m = len(self.state), len(detections)
        variance = self._variance / (detections.score + _LEAST_SCORE)
        paired: IntArray = _NONE
        if n:
            self._predict()
            matched = self.detection
            matched.fill(-1)
            if m:
                rows, paired = self._assign(detections, variance)
                matched[rows] = paired
            if len(paired) == n:
                self._correct(matched, None, detections, variance)
                self.hits += 1
                self.missed.fill(0)
                self.history[:, self._slot] = detections.score[matched]
            else:
                hit = matched >= 0
                if m:
                    self._correct(matched, hit, detections, variance)
                self.hits += hit
                self.missed += 1
                self.missed[hit] = 0
                self.history[:, self._slot] = np.where(hit, detections.score[matched], 0.0) if m else 0.0
                self._bury()
        if len(paired) < m:
            free = np.ones(m, dtype=np.bool_)
            free[paired] = False
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

    def _predict(self) -> None:
        dt, (q00, q01, q11) = self._dt, self._q
        p00, p01, p11 = self.covariance.T
        place = self.state[:, :2]
        place += dt * self.state[:, 2:]
        moved = dt * p11
        spread = _TWO * p01
        spread += moved
        spread *= dt
        spread += q00
        p00 += spread
        moved += q01
        p01 += moved
        p11 += q11

    def _assign(self, detections: Detections, variance: Array) -> tuple[IntArray, IntArray]:
        gap = self.state[:, None, :2] - detections.centre_px
        spread = self.covariance[:, :1] + variance
        gap *= gap
        distance = gap[:, :, 0] + gap[:, :, 1]
        distance /= spread
        allowed = self.class_id[:, None] == detections.class_id
        allowed &= distance <= self._gate
        rows, columns = allowed.nonzero()
        if len(set(columns.tolist())) == len(rows) == len(set(rows.tolist())):
            return rows, columns  # nobody competes: the Hungarian method would find the same
        # A stale track has a wide gate: the log term keeps it from taking the detection of a sharp one.
        cost = np.where(allowed, distance + 2.0 * np.log(spread / variance), _UNMATCHED_COST)
        rows, columns = linear_sum_assignment(cost)
        kept = allowed[rows, columns]
        return rows[kept], columns[kept]

    def _correct(self, matched: IntArray, hit: BoolArray | None, detections: Detections, variance: Array) -> None:
        """Kalman correction of the tracks `hit`, all if None."""
        p00, p01, p11 = self.covariance.T
        spread = variance[matched]
        spread += p00
        inverse = np.divide(_ONE if hit is None else hit, spread, out=spread)
        gain_0, gain_1 = p00 * inverse, p01 * inverse
        place, speed = self.state[:, :2], self.state[:, 2:]
        innovation = detections.centre_px.take(matched, 0)
        innovation -= place
        place += gain_0[:, None] * innovation
        speed += gain_1[:, None] * innovation
        p11 -= gain_1 * p01
        rest = np.subtract(_ONE, gain_0, out=gain_0)
        p01 *= rest
        p00 *= rest

    def _bury(self) -> None:
        cfg = self._cfg
        limit = np.where(self.hits >= cfg.confirm_hits, cfg.max_predicted_frames, cfg.max_tentative_frames)
        centre = self.state[:, :2]
        alive = (self.missed <= limit) & ((centre > self._low) & (centre < self._high)).all(axis=1)
        if not alive.all():
            self._keep(alive)

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
