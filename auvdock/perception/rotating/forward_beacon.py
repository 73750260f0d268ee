"""The rotating beacon found among all lights, and the vehicle's azimuth from the time at which its beam passes."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.camera import Camera
from auvdock.core.contracts import AzimuthFix, Bearing, Detections, Proprioception
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import wrap_angle
from auvdock.perception.rotating.candidates import Candidate, Candidates, Pass, merge_spots
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.fusion import BeaconEstimate, Sweep, fuse
from auvdock.perception.rotating.motion import CameraMotion
from auvdock.perception.rotating.passes import PassFinder, chained
from auvdock.perception.rotating.profile import beam_sigma_rad

__all__ = ["ForwardBeacon"]

_LIT_BEAMS = 4.5
"""The beacon counts as lit while its beam is within so many fitted widths of the vehicle (ours)."""
_DIMMING_M = 1.5
"""Way on which water may take 1 - 1/e of the beacon's light: turbid water's (ours)."""
_STRANGE = 3
"""So many passes in a row that contradict the fused estimate end it."""


class ForwardBeacon:
    """Follows lights in compass bearing, names the one that flashes at the beacon's rate, and times its passes.

    A light is the beacon after `min_turns` coherent passes (`passes.chained`); steady lights, flickering ones and
    single flashes have none. Each further pass gives an `AzimuthFix` from that pass alone; its range, and `estimate`,
    rest on all passes. All times are the vehicle's: an error of its clock is an azimuth error of 360° s per second.
    """

    def __init__(self, cfg: ForwardBeaconCfg, camera: Camera, beacon: RotatingBeaconCfg) -> None:
        """Build the parts for one camera and one beacon."""
        self._cfg, self._camera, self._beacon = cfg, camera, beacon
        self._sigma_beam = beam_sigma_rad(beacon.divergence_deg)
        self._motion = CameraMotion(camera)
        self._candidates = Candidates(cfg, camera, 1.0 / beacon.rate_rev_s)
        self._finder = PassFinder(cfg, beacon.rate_rev_s, self._sigma_beam, camera.rate_hz)
        self.reset()

    def reset(self) -> None:
        """Forget everything; call at the start of an episode."""
        self._motion.reset()
        self._candidates.reset()
        self._own: Candidate | None = None
        self._sweeps: list[Sweep] = []
        self._last: Pass | None = None
        self._strange = 0
        self._widening = 1.25
        self._estimate: BeaconEstimate | None = None
        self._mask: BoolArray = np.zeros(0, dtype=np.bool_)

    @property
    def estimate(self) -> BeaconEstimate | None:
        """Beacon and station from all passes, None before the beacon is known."""
        return self._estimate

    @property
    def passes(self) -> tuple[Pass, ...]:
        """The beacon's last passes, at most eight; empty before the beacon is known."""
        return tuple(self._own.chain) if self._own is not None else ()

    @property
    def mask(self) -> BoolArray:
        """(n,) which of the last frame's detections are the beacon's."""
        return self._mask

    def update(self, detections: Detections, proprioception: Proprioception) -> AzimuthFix | None:
        """One frame's detections with the vehicle's own sensors of that instant; an azimuth when a pass has ended."""
        place = self._motion.update(proprioception)
        if self._own is not None and self._estimate is not None:
            self._carry(self._own, self._estimate, place.place_m)
        spots = merge_spots(detections, self._camera, self._cfg)
        lit = self._lit(place.time_s)
        owner, parts = self._candidates.update(spots, place, self._own, lit)
        fix: AzimuthFix | None = None
        for candidate in self._candidates.all:
            new = self._finder.judge(candidate, place.time_s, self._motion)
            if new is not None and (found := self._take(candidate, new)) is not None:
                fix = found
        self._mask = np.zeros(len(detections), dtype=np.bool_)
        if lit:
            for index in [*parts, *(index for index, candidate in owner.items() if candidate is self._own)]:
                self._mask[list(spots[index].rows)] = True
        return fix

    def _take(self, candidate: Candidate, new: Pass) -> AzimuthFix | None:
        """A pass of a candidate: the beacon's, or one more for its chain."""
        cfg, rate = self._cfg, self._beacon.rate_rev_s
        candidate.ray_compass = new.ray_compass
        if candidate is self._own or self._is_own(candidate, new):
            return self._own_pass(candidate, new)
        candidate.chain = chained(candidate.chain, new, rate, cfg)
        chain = candidate.chain
        if len(chain) < cfg.min_turns or sum(entry.covered for entry in chain) < cfg.min_turns - 1:
            return None
        if self._own is not None and new.amplitude < cfg.amplitude_ratio * self._own_amplitude():
            return None  # light of the beacon on another lamp or a mirror image of it: dimmer
        self._own, self._strange = candidate, 0
        self._sweeps = [self._sweep(entry) for entry in chain]
        return self._fix(candidate, new)

    def _is_own(self, candidate: Candidate, new: Pass) -> bool:
        """Whether a pass of another candidate is the beacon's after all; the beacon then goes by that candidate."""
        own, estimate = self._own, self._estimate
        if own is None or estimate is None:
            return False
        if float(new.ray_compass @ own.ray_compass) < math.cos(math.radians(self._cfg.max_gate_deg)):
            return False
        ratio = new.amplitude / max(self._own_amplitude(), 1e-300)
        gap = abs(wrap_angle(self._beacon.azimuth_rad(new.time_s) - self._expected_azimuth(estimate, new.place_m)))
        since = (new.time_s - self._sweeps[-1].time_s) * self._beacon.rate_rev_s
        if since < 0.5 or ratio < 1.0 / self._cfg.amplitude_ratio or gap > math.radians(self._cfg.coherence_deg):
            return False
        candidate.chain = own.chain
        self._own = candidate
        return True

    def _own_pass(self, candidate: Candidate, new: Pass) -> AzimuthFix | None:
        sweep = self._sweep(new)
        if self._estimate is not None:
            expected = self._expected_azimuth(self._estimate, sweep.place_m)
            gap = abs(wrap_angle(sweep.azimuth_rad - expected))
            since = (new.time_s - self._sweeps[-1].time_s) * self._beacon.rate_rev_s
            limit = 1.5 * math.radians(self._cfg.coherence_deg) * max(1.0, math.sqrt(since))
            strange = gap > limit + 4.0 * math.hypot(sweep.sigma_rad, self._estimate.sigma_azimuth_rad)
            if strange or self._too_dim(new, self._estimate):
                self._strange += 1
                candidate.chain = chained(candidate.chain, new, self._beacon.rate_rev_s, self._cfg)
                if self._strange >= _STRANGE:
                    self._own, self._estimate, self._sweeps, self._last = None, None, [], None
                return None
        self._strange = 0
        candidate.chain = [*candidate.chain, new][-8:]
        self._sweeps = [*self._sweeps, sweep][-self._cfg.fusion_turns :]
        return self._fix(candidate, new)

    def _too_dim(self, new: Pass, estimate: BeaconEstimate) -> bool:
        """Whether the beacon was much brighter from as far or farther away: then this is another light, or a part."""
        last = self._last
        if last is None:
            return False
        before, now = (float(np.hypot(*(estimate.beacon_m - entry.place_m))) for entry in (last, new))
        allowed = self._cfg.amplitude_ratio * math.exp(max(now - before, 0.0) / _DIMMING_M)
        return new.amplitude * allowed < last.amplitude

    def _fix(self, candidate: Candidate, new: Pass) -> AzimuthFix:
        self._last = new
        self._estimate = estimate = fuse(self._sweeps, self._cfg)
        self._widening = float(np.median([entry.widening for entry in candidate.chain]))
        sweep = self._sweeps[-1]
        ray = self._motion.at(new.time_s).R_compass_camera.T @ new.ray_compass
        known = estimate.sigma_range_m <= self._cfg.range_share * estimate.range_m
        level = math.hypot(float(new.ray_compass[0]), float(new.ray_compass[1]))
        pixel = self._camera.project(ray[None])[0] if ray[2] > 1e-3 else np.array([np.nan, np.nan])
        clock_rad = math.tau * self._beacon.rate_rev_s * self._cfg.clock_sigma_s
        return AzimuthFix(
            time_s=new.time_s,
            azimuth_rad=sweep.azimuth_rad,
            sigma_rad=math.hypot(sweep.sigma_rad, clock_rad),
            bearing=Bearing(ray, pixel, new.score, estimate.range_m / max(level, 0.1) if known else None),
            turns=len(self._sweeps),
        )

    def _sweep(self, entry: Pass) -> Sweep:
        bearing = math.atan2(float(entry.ray_compass[1]), float(entry.ray_compass[0]))
        azimuth = self._beacon.azimuth_rad(entry.time_s)
        return Sweep(entry.time_s, azimuth, entry.sigma_rad, bearing, entry.place_m)

    def _own_amplitude(self) -> float:
        return self._own.chain[-1].amplitude if self._own is not None and self._own.chain else 0.0

    def _expected_azimuth(self, estimate: BeaconEstimate, place_m: Array) -> float:
        east, north = (estimate.beacon_m - place_m).tolist()
        return wrap_angle(math.atan2(north, east) + math.pi - estimate.axis_yaw_rad)

    def _lit(self, time_s: float) -> bool:
        """Whether the beam is on the vehicle or near it."""
        if self._estimate is None:
            return False
        beam = self._beacon.azimuth_rad(time_s)
        expected = self._expected_azimuth(self._estimate, self._motion.now.place_m)
        return abs(wrap_angle(beam - expected)) <= _LIT_BEAMS * self._widening * self._sigma_beam

    def _carry(self, own: Candidate, estimate: BeaconEstimate, place_m: Array) -> None:
        """Turn the beacon's direction as the vehicle's own motion turns it, between passes."""
        if estimate.sigma_range_m > self._cfg.range_share * estimate.range_m:
            return
        east, north = (estimate.beacon_m - place_m).tolist()
        distance = math.hypot(east, north)
        if distance < 1.0:
            return
        level = math.hypot(float(own.ray_compass[0]), float(own.ray_compass[1]))
        own.ray_compass = np.array([east / distance * level, north / distance * level, float(own.ray_compass[2])])
