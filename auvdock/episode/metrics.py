"""Metrics of an episode, gathered tick by tick. The one place where ground truth and perception meet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.station import ConicalStationCfg
from auvdock.core.transforms import invert
from auvdock.episode.false_poses import FalsePoses
from auvdock.episode.trace import Tick
from auvdock.sim.truth import Truth

__all__ = ["GuidanceMetrics"]


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
        self._array_m = station.layout.array_positions_m
        self._camera_body = camera.T_body_camera[:, 3].copy()
        # Kept as they are and judged in one go at the end: a frame is cheap, its judgement is not.
        self._true_m: list[Array] = []
        self._measured_m: list[Array] = []
        self._unmeasured: list[Array] = []

    def add(self, tick: Tick) -> None:
        """Count one control period; those without a frame count nothing."""
        truth, percept = tick.truth, tick.percept
        if percept is None:
            return
        measured = percept.pose is not None and percept.pose.measured
        if not self._true_m and not measured:
            return
        if measured and percept.pose is not None:
            self._true_m.append(truth.T_world_body.dot(self._camera_body))
            self._measured_m.append(percept.pose.T_station_camera[:3, 3])
        else:
            self._unmeasured.append(truth.T_world_body)

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """Guidance so far and how the nose passed the throat, named as in `EpisodeResult`."""
        entry_m = last_m = error_m = None
        poses = FalsePoses.count((), ())
        if self._true_m:
            camera_m = np.array(self._true_m) @ self._T_station_world[:3].T
            entry_m, last_m = float(camera_m[0, 0]), float(camera_m[-1, 0])
            errors_m = np.linalg.norm(np.array(self._measured_m) - camera_m, axis=1)
            error_m = float(np.median(errors_m))
            poses = FalsePoses.count(errors_m, np.linalg.norm(camera_m, axis=1))
        invalid = self._invalid_frames()
        precise = len(self._true_m) + invalid
        return {
            "distortion_rate": invalid / precise if precise else None,
            "precise_frames": precise,
            "invalid_frames": invalid,
            "entry_distance_m": entry_m,
            "precise_range_m": None if entry_m is None or last_m is None else entry_m - last_m,
            "pose_error_median_m": error_m,
            **vars(poses),
            "lateral_error_m": truth.entry_lateral_m,
            "vertical_error_m": truth.entry_vertical_m,
            "heading_error_rad": truth.entry_angle_rad,
            "entry_speed_m_s": truth.entry_speed_m_s,
        }

    def _invalid_frames(self) -> int:
        """Frames without a measured pose in which enough of the array lies in view."""
        if not self._unmeasured:
            return 0
        T_station_camera = self._T_station_world @ np.array(self._unmeasured) @ self._camera.T_body_camera
        points = (self._array_m - T_station_camera[:, None, :3, 3]) @ T_station_camera[:, :3, :3]
        in_view = self._camera.in_view(points.reshape(-1, 3)).reshape(len(points), -1)
        return int(np.count_nonzero(np.count_nonzero(in_view, axis=1) >= self.MIN_IN_VIEW))
