"""Metrics of an episode, gathered tick by tick. The one place where ground truth and perception meet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Percept
from auvdock.core.station import ConicalStationCfg
from auvdock.core.transforms import invert
from auvdock.sim.truth import Truth

__all__ = ["GuidanceMetrics", "GuidanceSummary"]


@dataclass(frozen=True)
class GuidanceSummary:
    """Precise-guidance metrics of an episode, named as in `EpisodeResult`."""

    distortion_rate: float | None
    precise_frames: int
    invalid_frames: int
    entry_distance_m: float | None
    precise_range_m: float | None
    pose_error_median_m: float | None


class GuidanceMetrics:
    """Counts precise guidance as paper A does (tables 9 and 10), independent of the method under test.

    Precise guidance begins with the first measured pose. From then on every frame counts in which at least four array
    beacons lie geometrically in the camera's field of view; those without a pose measured in that very frame are
    invalid. Poses that are predicted or held do not count as measured. That the beacons lie in view is taken from the
    truth, so a method that loses the array early is charged for it to the end of the approach.
    """

    MIN_IN_VIEW = 4

    def __init__(self, camera: Camera, station: ConicalStationCfg, T_world_station: Array) -> None:
        """Precompute what stays the same."""
        self._camera = camera
        self._T_station_world = invert(T_world_station)
        points = station.layout.array_positions_m
        self._array_station = np.hstack([points, np.ones((len(points), 1))])
        self._precise = 0
        self._invalid = 0
        self._entry_m: float | None = None
        self._last_m: float | None = None
        self._errors_m: list[float] = []

    def add(self, truth: Truth, percept: Percept) -> None:
        """Count one frame."""
        measured = percept.pose is not None and percept.pose.measured
        if self._entry_m is None and not measured:
            return
        T_station_camera = self._T_station_world @ truth.T_world_body @ self._camera.T_body_camera
        if measured and percept.pose is not None:
            distance_m = float(T_station_camera[0, 3])
            self._entry_m = distance_m if self._entry_m is None else self._entry_m
            self._last_m = distance_m
            error = percept.pose.T_station_camera[:3, 3] - T_station_camera[:3, 3]
            self._errors_m.append(math.sqrt(float(error @ error)))
            self._precise += 1
        elif self._array_in_view(T_station_camera):
            self._precise += 1
            self._invalid += 1

    def summary(self) -> GuidanceSummary:
        """The metrics so far."""
        entered = self._entry_m is not None and self._last_m is not None
        return GuidanceSummary(
            distortion_rate=self._invalid / self._precise if self._precise else None,
            precise_frames=self._precise,
            invalid_frames=self._invalid,
            entry_distance_m=self._entry_m,
            precise_range_m=(self._entry_m or 0.0) - (self._last_m or 0.0) if entered else None,
            pose_error_median_m=float(np.median(self._errors_m)) if self._errors_m else None,
        )

    def _array_in_view(self, T_station_camera: Array) -> bool:
        points = (self._array_station @ invert(T_station_camera).T)[:, :3]
        return int(np.count_nonzero(self._camera.in_view(points))) >= self.MIN_IN_VIEW
