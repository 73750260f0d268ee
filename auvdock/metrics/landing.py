"""Metrics of a landing, gathered tick by tick; like all metrics they may see the truth."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.transforms import invert
from auvdock.core.vehicle import VehicleCfg
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.metrics.guidance import GuidanceMetrics
from auvdock.metrics.tick import Tick
from auvdock.sim.truth import Truth

__all__ = ["ALIGNED_MODES", "LandingMetrics", "estimate_error"]

ALIGNED_MODES = ("descend", "touchdown")
"""Modes after alignment: the pilot has found itself aligned and goes down."""

_PAPER_M, _PAPER_RAD = 0.020, math.radians(3.0)
_TARGET_M, _TARGET_RAD = 0.010, math.radians(1.0)


class LandingMetrics(GuidanceMetrics):
    """Errors ξ, η, ζ, ψ between vehicle and station, and those of the estimate, after alignment.

    "After alignment" is the last unbroken stretch of `ALIGNED_MODES` before the latch closed or the episode ended: a
    retreat begins it anew. In it the vehicle's errors are the true ones of its seat (`LandingTruth`); the estimate's
    are those of the filtered pose less the truth, of all frames with a pose, measured or held. Every frame from the
    entry on counts as precise guidance, by what it rested on.
    """

    def __init__(self, camera: Camera, vehicle: VehicleCfg, T_world_station: Array) -> None:
        """Start empty."""
        super().__init__(camera, T_world_station)
        self._T_camera_body = invert(camera.T_body_camera)
        self._seat_body = np.append(vehicle.seat_body_m, 1.0)
        self._levels: list[str] = []
        self._aligned = False
        self._flown: list[tuple[float, float]] = []
        self._estimated: list[tuple[float, float]] = []

    def add(self, tick: Tick) -> None:
        """Take in one control period."""
        super().add(tick)
        truth, percept = tick.truth, tick.percept
        landing = truth.landing
        if landing is None:
            return
        aligned = tick.command.mode in ALIGNED_MODES
        if aligned and not self._aligned and not truth.latched:
            self._flown.clear()
            self._estimated.clear()
        self._aligned = aligned
        counts = aligned and not truth.latched
        if counts:
            along, across, _ = landing.seat_error_m.tolist()
            self._flown.append((math.hypot(along, across), abs(landing.heading_error_rad)))
        if percept is None or truth.latched:
            return
        pose = percept.pose
        measured = pose is not None and pose.measured
        self._levels.append(percept.level if isinstance(percept, LandingPercept) and measured else "none")
        if pose is not None and counts:
            true = self._T_station_world @ truth.T_world_body
            error = estimate_error(pose.T_station_camera @ self._T_camera_body, true, self._seat_body)
            self._estimated.append((float(np.abs(error[:3]).max()), abs(float(error[3]))))

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """Guidance, alignment and touchdown, named as in `EpisodeResult`."""
        landing, entry = truth.landing, self.entry
        levels = Counter(self._levels[entry:]) if entry is not None else Counter[str]()
        frames = levels.total()
        shares = {
            f"{name}_share": levels[level] / frames if frames else None
            for name, level in (("lights", "lights"), ("tag", "tag"), ("fused", "fused"), ("blind", "none"))
        }
        flown = np.array(self._flown).reshape(-1, 2)
        guess = np.array(self._estimated).reshape(-1, 2)
        return {
            **super().fields(truth),
            "touchdown_speed_m_s": None if landing is None else landing.touchdown_speed_m_s,
            "touchdown_force_n": None if landing is None else landing.touchdown_force_n,
            "final_position_error_m": float(flown[-1, 0]) if len(flown) else None,
            "max_position_error_m": float(flown[:, 0].max()) if len(flown) else None,
            "final_heading_error_rad": float(flown[-1, 1]) if len(flown) else None,
            "max_heading_error_rad": float(flown[:, 1].max()) if len(flown) else None,
            "aligned_frames": len(guess),
            "estimate_position_p95_m": float(np.percentile(guess[:, 0], 95.0)) if len(guess) else None,
            "estimate_heading_p95_rad": float(np.percentile(guess[:, 1], 95.0)) if len(guess) else None,
            "estimate_within_20mm_3deg": _share_within(guess, _PAPER_M, _PAPER_RAD),
            "estimate_within_10mm_1deg": _share_within(guess, _TARGET_M, _TARGET_RAD),
            **shares,
        }


def estimate_error(T_station_body: Array, T_true: Array, seat_body: Array) -> Array:
    """(4,) errors of an estimated body pose: ξ, η, ζ of the seat in m and ψ in rad, estimate less truth.

    Args:
        T_station_body: (4, 4) estimate.
        T_true: (4, 4) truth.
        seat_body: (4,) homogeneous, the seat in the body frame.
    """
    offset = (T_station_body @ seat_body - T_true @ seat_body)[:3]
    estimated = math.atan2(T_station_body[1, 0], T_station_body[0, 0])
    true = math.atan2(T_true[1, 0], T_true[0, 0])
    return np.append(offset, math.remainder(estimated - true, math.tau))


def _share_within(errors: Array, position_m: float, heading_rad: float) -> float | None:
    if not len(errors):
        return None
    return float(np.mean((errors[:, 0] <= position_m) & (errors[:, 1] <= heading_rad)))
