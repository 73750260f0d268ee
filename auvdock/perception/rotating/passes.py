"""Passes of a beam in a candidate's brightness, and whether they come from a beacon that turns at the known rate."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.perception.rotating.candidates import Candidate, Pass
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.motion import CameraMotion
from auvdock.perception.rotating.pass_fit import fit_pass
from auvdock.perception.rotating.profile import pass_profile

__all__ = ["PassFinder", "chained"]

_COVERED = 0.5
"""Share of the frames of a turn in which the light must have been in view for its steady light to be known."""
_LEAST_STEADY = 5
_FAINT = 0.25
_CHAIN = 8
_FLANK = 0.8
"""A pass is dimmer than this share of its brightest frame on both sides (ours)."""
_SHARPEST = math.log(0.02)


class PassFinder:
    """Finds passes in a candidate's samples."""

    def __init__(self, cfg: ForwardBeaconCfg, rate_rev_s: float, beam_sigma_rad: float, frame_rate_hz: float) -> None:
        """Precompute times from angles.

        Args:
            cfg: thresholds.
            rate_rev_s: s of the beacon.
            beam_sigma_rad: σ_b of its beam.
            frame_rate_hz: f of the camera.
        """
        self._cfg, self._beam_sigma_rad = cfg, beam_sigma_rad
        self._omega = math.tau * rate_rev_s
        self._turn_s = 1.0 / rate_rev_s
        self._window_s = math.radians(cfg.window_deg) / self._omega
        self._settle_s = math.radians(cfg.settle_deg) / self._omega
        self._frame_rad = self._omega / frame_rate_hz
        self._frames = frame_rate_hz * (self._turn_s - 2.0 * self._window_s)

    def judge(self, candidate: Candidate, now_s: float, motion: CameraMotion) -> Pass | None:
        """A pass that has just ended, if there is one.

        Args:
            candidate: the light.
            now_s: time of this frame.
            motion: the camera's motion.
        """
        recent = self._recent(candidate, now_s)
        if recent is None:
            return None
        first, peak = recent
        times, flux = np.array(candidate.times_s[first:]), np.array(candidate.flux[first:])
        seen = np.array(candidate.seen[first:])
        steady, scatter, covered = self._steady(candidate, times[peak])
        height = float(flux[peak]) - steady
        if height <= max(self._cfg.modulation * steady, self._cfg.noise_ratio * scatter):
            # Nothing after this sample is brighter, until something is.
            candidate.judged_s = float(times[peak])
            return None
        since = now_s - float(times[peak])
        if since < self._window_s and float(flux[-1]) - steady > _FAINT * height:
            return None  # still bright: the pass goes on
        candidate.judged_s = float(times[peak]) + self._window_s
        return self._fit(candidate, first, times, flux - steady, seen, peak, scatter, covered, motion)

    def _recent(self, candidate: Candidate, now_s: float) -> tuple[int, int] | None:
        """First sample of the window and the brightest one in it, once that is old enough to be judged."""
        times = candidate.times_s
        start = max(now_s - self._settle_s - 2.0 * self._window_s, candidate.judged_s)
        first = len(times)
        while first > 0 and times[first - 1] > start:
            first -= 1
        flux = candidate.flux[first:]
        if not flux or not any(candidate.seen[first:]):
            return None
        peak = max(range(len(flux)), key=flux.__getitem__)
        since = now_s - times[first + peak]
        # Beyond the window it would have been judged already.
        return (first, peak) if self._settle_s <= since else None

    def _steady(self, candidate: Candidate, peak_s: float) -> tuple[float, float, bool]:
        """Median and scatter of the light outside the pass, and whether it was in view for long enough to tell."""
        times = np.array(candidate.times_s)
        outside = (np.abs(times - peak_s) > self._window_s) & (times > peak_s - self._turn_s + self._window_s)
        flux = np.array(candidate.flux)[outside]
        if len(flux) < _LEAST_STEADY:
            return 0.0, 0.0, False
        steady = float(np.median(flux))
        scatter = 1.4826 * float(np.median(np.abs(flux - steady)))
        # Flashes outside the pass: a light that flickers has them, a beacon has not.
        scatter = max(scatter, 0.5 * (float(flux.max()) - steady))
        return steady, scatter, len(flux) >= _COVERED * self._frames

    def _gap_rad(self, times: Array, peak_s: float) -> float:
        """Beam angle beside the brightest frame of which no frame tells, up to the window's edge; 0 without a gap."""
        before, after = times[times < peak_s], times[times > peak_s]
        left = peak_s - float(before[-1]) if len(before) else self._window_s
        right = float(after[0]) - peak_s if len(after) else self._window_s
        gap = self._omega * max(left, right) - self._frame_rad
        return gap if gap > 0.5 * self._frame_rad else 0.0

    def _fit(
        self,
        candidate: Candidate,
        first: int,
        times: Array,
        excess: Array,
        seen: BoolArray,
        peak: int,
        scatter: float,
        covered: bool,
        motion: CameraMotion,
    ) -> Pass | None:
        cfg = self._cfg
        near = np.abs(times - times[peak]) <= self._window_s
        lost = ~seen & ~_outside(seen)
        near &= ~lost & ((excess > 0.0) | ~seen)
        rows = np.flatnonzero(near)
        gap_rad = self._gap_rad(times[rows], float(times[peak]))
        excess, seen = excess[rows], seen[rows]
        if int(seen.sum()) < cfg.min_frames:
            return None
        height = float(excess.max())
        least = float(excess[seen].min())
        data = np.where(seen, excess, least)
        dimmer = np.flatnonzero(~seen | (excess < _FLANK * height))
        if len(dimmer) == 0 or not dimmer[0] < int(excess.argmax()) < dimmer[-1]:
            return None  # it may have been brighter before or after
        sigma = np.sqrt((cfg.flux_share * data) ** 2 + (cfg.flux_floor * height) ** 2 + scatter**2)
        prior = (math.log(0.25), 1.0)
        if candidate.chain:
            excesses = sorted(entry.widening - 1.0 for entry in candidate.chain[-5:])
            prior = (max(math.log(max(excesses[len(excesses) // 2], 1e-3)), _SHARPEST), 0.5)
        origin = float(times[peak])
        angle = self._omega * (times[rows] - origin)
        fit = fit_pass(angle, data, sigma, seen, self._beam_sigma_rad, prior)
        if fit is None:
            return None
        sigma_rad = fit.sigma_rad
        # A frame that glare took, that was dropped or in which the light was out of view may have been the brightest.
        sigma_rad = math.hypot(sigma_rad, gap_rad / math.sqrt(12.0))
        if sigma_rad > math.radians(cfg.max_sigma_deg):
            return None
        if fit.widening > cfg.max_widening or abs(fit.offset_rad) > math.radians(cfg.settle_deg):
            return None
        model = fit.amplitude * pass_profile(angle - fit.offset_rad, self._beam_sigma_rad, fit.widening)
        misfit = np.where(seen, data - model, np.maximum(model - data, 0.0))
        if float(misfit @ misfit) > cfg.max_misfit * float(data[seen] @ data[seen]):
            return None
        time_s = origin + fit.offset_rad / self._omega
        weight = np.where(seen, np.maximum(excess, 0.0) ** 2, 0.0)
        ray = np.zeros(3)
        score = 0.0
        for row, w in zip(rows.tolist(), weight.tolist(), strict=True):
            direction = candidate.rays[first + row]
            if direction is not None and w > 0.0:
                ray += w * direction
                score += w * candidate.scores[first + row]
        norm = float(np.linalg.norm(ray))
        if norm == 0.0:
            return None
        return Pass(
            time_s=time_s,
            sigma_rad=sigma_rad,
            amplitude=fit.amplitude,
            widening=fit.widening,
            ray_compass=ray / norm,
            place_m=motion.at(time_s).place_m,
            covered=covered,
            score=score / float(weight.sum()),
        )


def _outside(seen: BoolArray) -> BoolArray:
    """(n,) samples before the first and after the last in which the light was seen.

    A frame between them without the light was not dark: the detector lost it in its own glare.
    """
    rows = np.flatnonzero(seen)
    outside = np.ones(len(seen), dtype=np.bool_)
    outside[rows[0] : rows[-1] + 1] = False
    return outside


def chained(chain: list[Pass], new: Pass, rate_rev_s: float, cfg: ForwardBeaconCfg) -> list[Pass]:
    """The chain of coherent passes with a new one: continued, or begun anew from it.

    Passes are coherent when they lie a whole number of turns apart, up to a change of azimuth that the vehicle's motion
    explains, and are alike in brightness and width. A flash now and then is not: it meets the window by chance only.
    """
    if not chain:
        return [new]
    last = chain[-1]
    turns = (new.time_s - last.time_s) * rate_rev_s
    whole = round(turns)
    drift = (turns - whole) * math.tau
    if not 1 <= whole <= (1 if new.covered else 3):
        return [new]  # a turn left out in full view is no beacon's
    ratio = new.amplitude / max(last.amplitude, 1e-300)
    if not 1.0 / cfg.amplitude_ratio <= ratio <= cfg.amplitude_ratio:
        return [new]
    if not 0.5 <= new.widening / last.widening <= 2.0:
        return [new]
    moved = float(np.hypot(*(new.place_m - last.place_m))) / cfg.nearest_m
    limit = math.radians(cfg.coherence_deg) + 3.0 * math.hypot(new.sigma_rad, last.sigma_rad)
    if abs(drift) > limit + moved:
        return [new]
    if len(chain) > 1:
        before = chain[-2]
        turns_before = (last.time_s - before.time_s) * rate_rev_s
        per_turn = math.remainder(turns_before * math.tau, math.tau) / max(round(turns_before), 1)
        if abs(drift - per_turn * whole) > limit + 0.5 * moved:
            return [new]
    return [*chain, new][-_CHAIN:]
