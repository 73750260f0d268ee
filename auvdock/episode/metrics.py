"""Metrics of an episode, gathered tick by tick. The one place where ground truth and perception meet."""

from __future__ import annotations

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
        self._camera_body = camera.T_body_camera[:, 3]
        self._true_m: list[Array] = []
        self._measured_m: list[Array] = []

    def add(self, truth: Truth, percept: Percept) -> None:
        """Count one frame."""
        measured = percept.pose is not None and percept.pose.measured
        if not self._true_m and not measured:
            return
        if measured and percept.pose is not None:
            # Kept as they are and compared in one go at the end: this runs in every frame.
            self._true_m.append(truth.T_world_body @ self._camera_body)
            self._measured_m.append(percept.pose.T_station_camera[:3, 3])
            self._precise += 1
        elif self._array_in_view(self._T_station_world @ truth.T_world_body @ self._camera.T_body_camera):
            self._precise += 1
            self._invalid += 1

    def summary(self) -> GuidanceSummary:
        """The metrics so far."""
        entry_m = last_m = error_m = None
        if self._true_m:
            camera_m = np.array(self._true_m) @ self._T_station_world[:3].T
            entry_m, last_m = float(camera_m[0, 0]), float(camera_m[-1, 0])
            error_m = float(np.median(np.linalg.norm(np.array(self._measured_m) - camera_m, axis=1)))
        return GuidanceSummary(
            distortion_rate=self._invalid / self._precise if self._precise else None,
            precise_frames=self._precise,
            invalid_frames=self._invalid,
            entry_distance_m=entry_m,
            precise_range_m=None if entry_m is None or last_m is None else entry_m - last_m,
            pose_error_median_m=error_m,
        )

    def _array_in_view(self, T_station_camera: Array) -> bool:
        points = (self._array_station @ invert(T_station_camera).T)[:, :3]
        return int(np.count_nonzero(self._camera.in_view(points))) >= self.MIN_IN_VIEW
