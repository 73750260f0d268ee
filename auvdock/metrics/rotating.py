"""How well the rotating beacon led: where the episode began, when the beacon was found, how true the azimuths were."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from auvdock.controllers.rotating.modes import ROTATING_MODES
from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import invert
from auvdock.metrics.tick import Tick
from auvdock.sim.truth import Truth

__all__ = ["RotatingMetrics"]

_TRUE_SHARE, _TRUE_M = 0.1, 0.5
"""A first pose counts as one of the station if its error is at most this share of the range and so much more (ours)."""
_REMEMBERED = 150
"""Control periods whose true azimuth is kept: a fix tells of a moment that is past."""


class RotatingMetrics:
    """Compares each azimuth fix with the truth at the time of which it tells."""

    def __init__(self, camera: Camera, T_world_station: Array, beacon: RotatingBeaconCfg | None) -> None:
        """Start empty.

        Args:
            camera: azimuths are the camera's.
            T_world_station: (4, 4).
            beacon: azimuths are about it; about the mouth where there is none.
        """
        self._body_camera = camera.T_body_camera[:, 3].copy()
        self._T_station_world = invert(T_world_station)
        x, y, _ = beacon.position_m if beacon is not None else (0.0, 0.0, 0.0)
        self._beacon_xy_m = (x, y)
        self._true: deque[tuple[float, float]] = deque(maxlen=_REMEMBERED)
        self._start: tuple[float, float] | None = None
        self._fix_s: float | None = None
        self._pose_s: float | None = None
        self._errors: list[float] = []
        self._believed_error: float | None = None
        self._handover_error: float | None = None

    def add(self, tick: Tick) -> None:
        """Take in one control period."""
        place = self._T_station_world @ tick.truth.T_world_body @ self._body_camera
        x, y = float(place[0]) - self._beacon_xy_m[0], float(place[1]) - self._beacon_xy_m[1]
        azimuth = math.atan2(y, x)
        now = tick.truth.time_s
        self._true.append((now, azimuth))
        if self._start is None:
            self._start = azimuth, math.hypot(x, y)
        percept = tick.percept
        if percept is not None:
            if self._pose_s is None and percept.pose is not None and percept.pose.measured:
                gap = float(np.linalg.norm(percept.pose.T_station_camera[:3, 3] - place[:3]))
                # Parts of the beacon's own halo can look like an array for a frame: that is no sight of the station.
                if gap <= _TRUE_SHARE * float(np.linalg.norm(place[:3])) + _TRUE_M:
                    self._pose_s = now
            fix = percept.azimuth
            if fix is not None:
                self._fix_s = now if self._fix_s is None else self._fix_s
                _, true = min(self._true, key=lambda entry: abs(entry[0] - fix.time_s))
                self._errors.append(math.remainder(fix.azimuth_rad - true, math.tau))
        if tick.command.mode not in ROTATING_MODES:
            if self._handover_error is None:
                self._handover_error = self._believed_error
            return
        believed = tick.command.setpoint.get("azimuth_rad")
        if believed is not None:
            self._believed_error = math.remainder(believed - azimuth, math.tau)

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """Named as in `EpisodeResult`."""
        found = [moment for moment in (self._fix_s, self._pose_s) if moment is not None]
        count = len(self._errors)
        return {
            "start_azimuth_rad": self._start[0] if self._start is not None else None,
            "start_range_m": self._start[1] if self._start is not None else None,
            "acquire_s": min(found) if found else None,
            "first_pose_s": self._pose_s,
            "azimuth_fixes": count,
            "azimuth_rms_rad": math.sqrt(sum(error * error for error in self._errors) / count) if count else None,
            "handover_azimuth_error_rad": self._handover_error,
        }
