"""A batch of control periods turned into Rerun's columns: one call per entity instead of one per entity and period."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from auvdock.core.arrays import Array
from auvdock.recording import paths
from auvdock.recording.batch import Batch
from auvdock.recording.lights import write_images, write_lights
from auvdock.recording.modes import ModeFollower
from auvdock.recording.pose_error import camera_in_station, pose_errors

if TYPE_CHECKING:
    from auvdock.core.contracts import Percept, PoseEstimate
    from auvdock.episode.trace import EpisodeSetup
    from auvdock.metrics.tick import Tick
    from auvdock.recording.part import StationPart

__all__ = ["ColumnWriter", "Row"]

_ARROW_M_PER_M_S = 4.0
"""Length of the current's arrow: at 0.25 m/s it is a metre long."""


@dataclass(frozen=True, eq=False)
class Row:
    """One control period as it waits for its batch.

    Attributes:
        frame: number of the control period.
        tick: the period, without its image.
        jpeg: the encoded image, None if none is to be recorded.
    """

    frame: int
    tick: Tick
    jpeg: bytes | None


class ColumnWriter:
    """Writes batches of rows to a stream."""

    def __init__(self, stream: rr.RecordingStream, setup: EpisodeSetup, part: StationPart) -> None:
        """Begin an episode."""
        self._stream = stream
        self._setup = setup
        self._part = part
        self._modes = ModeFollower(part.place)
        self._last_camera_world_m: Array | None = None

    def write(self, rows: Sequence[Row]) -> None:
        """Write rows (at least one) in their order."""
        frames = np.array([row.frame for row in rows], dtype=np.int64)
        times_s = np.array([row.tick.truth.time_s for row in rows])
        T_world_body = np.array([row.tick.truth.T_world_body for row in rows])
        batch = Batch(self._stream, frames, times_s)
        self._write_motion(batch, rows, T_world_body)
        T_body_camera = self._setup.camera.T_body_camera
        T_station_camera = camera_in_station(self._setup.T_world_station, T_world_body, T_body_camera)
        self._write_pose(batch, rows, T_station_camera)
        self._part.write(batch, [row.tick for row in rows], T_station_camera)
        _write_lights(batch, rows)
        self._write_modes(batch, rows)
        write_images(batch, [row.jpeg for row in rows])

    def _write_motion(self, batch: Batch, rows: Sequence[Row], T_world_body: Array) -> None:
        truths = [row.tick.truth for row in rows]
        current = np.array([truth.current_world_m_s for truth in truths])
        ground = np.linalg.norm([truth.nu_body[:3] for truth in truths], axis=1)
        water = np.linalg.norm([truth.nu_relative_body[:3] for truth in truths], axis=1)
        origin = T_world_body[:, :3, 3]
        batch.send(paths.VEHICLE, rr.Transform3D.columns(translation=origin, mat3x3=T_world_body[:, :3, :3]))
        batch.send(paths.CURRENT_ARROW, rr.Arrows3D.columns(vectors=_ARROW_M_PER_M_S * current, origins=origin))
        batch.scalars(paths.CURRENT, current)
        batch.scalars(paths.SPEED, np.column_stack([ground, water]))
        batch.scalars(paths.RANGE, _ranges(rows))
        batch.scalars(paths.CONTACT, np.array([truth.contact_force_n for truth in truths]))
        batch.scalars(paths.COMMANDS, np.array([row.tick.command.values for row in rows]))

    def _write_pose(self, batch: Batch, rows: Sequence[Row], T_station_camera: Array) -> None:
        T_world_station = self._setup.T_world_station
        self._write_path(batch, (T_world_station @ T_station_camera)[:, :3, 3])
        percepts = [(index, row.tick.percept) for index, row in enumerate(rows) if row.tick.percept is not None]
        if not percepts:
            return
        seen = np.array([index for index, _ in percepts])
        poses = [_measured(percept) for _, percept in percepts]
        has_pose = np.array([pose is not None for pose in poses])
        measured = [pose for pose in poses if pose is not None]
        estimated = np.array([pose.T_station_camera for pose in measured]).reshape(-1, 4, 4)
        error_m, angle_rad = pose_errors(estimated, T_station_camera[seen[has_pose]])
        frames = batch.select(seen)
        # Frames without a measured pose get an empty row: the line breaks there instead of bridging the gap.
        frames.scalars(paths.POSE_ERROR, error_m, has_pose)
        frames.scalars(paths.POSE_ANGLE, np.degrees(angle_rad), has_pose)
        frames.scalars(paths.REPROJECTION, np.array([pose.reprojection_error_px for pose in measured]), has_pose)
        if measured:
            positions = (T_world_station @ estimated)[:, :3, 3]
            batch.select(seen[has_pose]).send(paths.ESTIMATES, rr.Points3D.columns(positions=positions))

    def _write_path(self, batch: Batch, camera_world_m: Array) -> None:
        before = camera_world_m[0] if self._last_camera_world_m is None else self._last_camera_world_m
        self._last_camera_world_m = camera_world_m[-1]
        starts = np.vstack([before, camera_world_m[:-1]])
        batch.send(
            paths.PATH, rr.LineStrips3D.columns(strips=np.stack([starts, camera_world_m], axis=1).astype(np.float32))
        )

    def _write_modes(self, batch: Batch, rows: Sequence[Row]) -> None:
        modes = [row.tick.command.mode for row in rows]
        batch.scalars(paths.MODE_NUMBER, np.array([self._modes.number(mode) for mode in modes], dtype=np.float64))
        to_go_m = [row.tick.truth.to_go_m for row in rows]
        followed = (self._modes.follow(index, mode, to_go_m[index]) for index, mode in enumerate(modes))
        changes = [change for change in followed if change is not None]
        if changes:
            at = batch.select(np.array([change.row for change in changes]))
            at.send(paths.MODE_STATE, rr.StateChange.columns(state=[change.mode for change in changes]))
            at.send(paths.MODE_LOG, rr.TextLog.columns(text=[change.text for change in changes]))


def _measured(percept: Percept) -> PoseEstimate | None:
    pose = percept.pose
    return pose if pose is not None and pose.measured else None


def _ranges(rows: Sequence[Row]) -> Array:
    """(n,) distance from the station, m."""
    return np.array([row.tick.truth.range_m for row in rows])


def _write_lights(batch: Batch, rows: Sequence[Row]) -> None:
    seen = [(index, row.tick.percept) for index, row in enumerate(rows) if row.tick.percept is not None]
    if seen:
        frames = batch.select(np.array([index for index, _ in seen]))
        write_lights(frames, [percept for _, percept in seen])
