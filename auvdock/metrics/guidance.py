"""Precise guidance as paper A counts it (tables 9 and 10), the same for every kind of station.

Guidance begins with the entry: the first measured pose that is right and that others follow, `CONFIRM` right ones in
all within `WITHIN` frames. A lonely or a false pose is no guidance and sets no entry distance. From then on every frame
counts in which the station could be measured; which these are is taken from the truth (`Guidance.counts`), so that a
method that loses the station early is charged for it to the end.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.camera import Camera
from auvdock.core.station import ConicalStationCfg
from auvdock.core.transforms import invert
from auvdock.metrics.false_poses import FalsePoses, is_false
from auvdock.metrics.tick import Tick
from auvdock.sim.truth import Truth

__all__ = ["CONFIRM", "WITHIN", "ConicalMetrics", "GuidanceMetrics"]

CONFIRM, WITHIN = 3, 10
"""Right poses that make an entry, and frames within which they must come, the first one's included (ours)."""

_RETREAT = "abort"
"""Mode of a pilot that goes around."""


class _Frame(NamedTuple):
    """A frame, kept to be judged at the end: a frame is cheap, its judgement is not."""

    T_world_body: Array
    position_m: Array | None
    """Of the camera in the station frame as perception has it, None without a pose."""
    measured: bool
    distance_m: float
    """`Truth.to_go_m`."""
    retreats: bool
    solver: str | None


class GuidanceMetrics:
    """Counts precise guidance, until the latch closes."""

    def __init__(
        self, camera: Camera, T_world_station: Array, counts: Callable[[Array], BoolArray] | None = None
    ) -> None:
        """Start empty.

        Args:
            camera: whose pose is measured.
            T_world_station: (4, 4).
            counts: of true camera poses T_station_camera (n, 4, 4), in which of them (n,) a frame without a measured
                pose counts as invalid; all of them without it.
        """
        self._camera_body = camera.T_body_camera
        self._T_station_world = invert(T_world_station)
        self._counts = counts
        self._frames: list[_Frame] = []

    def add(self, tick: Tick) -> None:
        """Count one control period; those without a frame, and those after the latch has closed, count nothing."""
        truth, percept = tick.truth, tick.percept
        if percept is None or truth.latched:
            return
        pose = percept.pose
        position_m = None if pose is None else pose.T_station_camera[:3, 3].copy()
        measured = pose is not None and pose.measured
        solver = pose.solver if pose is not None and measured else None
        retreats = tick.command.mode == _RETREAT
        self._frames.append(_Frame(truth.T_world_body, position_m, measured, truth.to_go_m, retreats, solver))

    @property
    def entry(self) -> int | None:
        """Number of the frame with which precise guidance begins, None without; frames count as `add` took them."""
        return _entry(np.array([frame.measured for frame in self._frames], dtype=bool), ~self._judge()[1])

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """Guidance so far, named as in `EpisodeResult`."""
        frames = self._frames
        error_m, false, range_m = self._judge()
        measured = np.array([frame.measured for frame in frames], dtype=bool)
        entry = _entry(measured, ~false)
        found = {
            **vars(FalsePoses.count(error_m[measured], range_m[measured])),
            "poses_by_solver": dict(sorted(Counter(frame.solver for frame in frames if frame.solver).items())),
        }
        nothing = dict.fromkeys(
            ("distortion_rate", "distortion_available", "entry_distance_m", "precise_range_m", "pose_error_median_m")
        )
        if entry is None:
            return {**found, **nothing, "precise_frames": 0, "invalid_frames": 0, "unavailable_frames": 0}
        within = np.arange(len(frames)) >= entry
        bare = within & ~measured
        bare[bare] = self._could_be_measured(bare)
        available = np.array([frame.position_m is not None for frame in frames])
        invalid, unavailable = int(bare.sum()), int((bare & ~available).sum())
        precise = int((within & measured).sum()) + invalid
        guided = within & measured
        first = guided & ~false & ~_gone_around(frames, entry)
        distance_m = np.array([frame.distance_m for frame in frames])
        return {
            **found,
            "distortion_rate": invalid / precise,
            "distortion_available": unavailable / precise,
            "precise_frames": precise,
            "invalid_frames": invalid,
            "unavailable_frames": unavailable,
            "entry_distance_m": float(distance_m[entry]),
            "precise_range_m": float(distance_m[entry] - distance_m[np.flatnonzero(first)[-1]]),
            "pose_error_median_m": float(np.median(error_m[guided])),
        }

    def _judge(self) -> tuple[Array, BoolArray, Array]:
        """(n,) error of each frame's pose in m, NaN without one, whether it is false, and the true range."""
        true_m = self._true_poses(np.ones(len(self._frames), dtype=bool))[:, :3, 3]
        nowhere = np.full(3, np.nan)
        seen_m = [nowhere if frame.position_m is None else frame.position_m for frame in self._frames]
        error_m = np.linalg.norm(np.array(seen_m).reshape(-1, 3) - true_m, axis=1)
        range_m = np.linalg.norm(true_m, axis=1)
        return error_m, is_false(error_m, range_m), range_m

    def _true_poses(self, chosen: BoolArray) -> Array:
        """(m, 4, 4) true T_station_camera of the chosen frames (n,)."""
        bodies = np.array([self._frames[k].T_world_body for k in np.flatnonzero(chosen)]).reshape(-1, 4, 4)
        return self._T_station_world @ bodies @ self._camera_body

    def _could_be_measured(self, chosen: BoolArray) -> BoolArray:
        """(m,) whether a frame without a measured pose counts, of the chosen frames (n,)."""
        poses = self._true_poses(chosen)
        return np.ones(len(poses), dtype=bool) if self._counts is None else self._counts(poses)


class ConicalMetrics(GuidanceMetrics):
    """Guidance into a funnel, and how the nose passed the throat.

    A frame counts while at least four array beacons lie geometrically in the camera's field of view.
    """

    MIN_IN_VIEW = 4

    def __init__(self, camera: Camera, station: ConicalStationCfg, T_world_station: Array) -> None:
        """Start empty."""
        super().__init__(camera, T_world_station, self._array_in_view)
        self._camera, self._array_m = camera, station.layout.array_positions_m.copy()

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """Named as in `EpisodeResult`."""
        return {
            **super().fields(truth),
            "lateral_error_m": truth.entry_lateral_m,
            "vertical_error_m": truth.entry_vertical_m,
            "heading_error_rad": truth.entry_angle_rad,
            "entry_speed_m_s": truth.entry_speed_m_s,
        }

    def _array_in_view(self, T_station_camera: Array) -> BoolArray:
        points = (self._array_m - T_station_camera[:, None, :3, 3]) @ T_station_camera[:, :3, :3]
        in_view = self._camera.in_view(points.reshape(-1, 3)).reshape(points.shape[:2])
        return np.count_nonzero(in_view, axis=1) >= self.MIN_IN_VIEW


def _entry(measured: BoolArray, right: BoolArray) -> int | None:
    """The first frame (n,) whose pose is measured and right and has as many of them within reach as an entry needs."""
    good = measured & right
    so_far = np.concatenate([[0], np.cumsum(good)])
    until = np.minimum(np.arange(len(good)) + WITHIN, len(good))
    entries = np.flatnonzero(good & (so_far[until] - so_far[:-1] >= CONFIRM))
    return int(entries[0]) if len(entries) else None


def _gone_around(frames: list[_Frame], entry: int) -> BoolArray:
    """(n,) whether a frame comes after the first retreat since the entry."""
    retreats = np.array([frame.retreats for frame in frames], dtype=bool)
    retreats[:entry] = False
    return np.logical_or.accumulate(retreats)
