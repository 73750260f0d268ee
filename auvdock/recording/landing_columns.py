"""What a landing adds to a recording: errors ξ, η, ζ, ψ against time, the tag's outline, the level in use."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from auvdock.core.arrays import Array
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.transforms import invert
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.recording import paths
from auvdock.recording.batch import Batch

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup, Tick

__all__ = ["LandingColumns"]

_PIXEL_CORNER = 0.5


class LandingColumns:
    """Writes a landing's own columns."""

    def __init__(self, setup: EpisodeSetup) -> None:
        """Begin an episode.

        Raises:
            TypeError: the station is no landing station.
        """
        station = setup.station
        if not isinstance(station, LandingStationCfg):
            raise TypeError(f"no landing station: {type(station).__name__}")
        self._camera = setup.camera
        self._T_camera_body = invert(setup.camera.T_body_camera)
        self._seat = np.append(setup.vehicle.seat_body_m, 1.0)
        self._place_up_m = station.guide.seat_height_m
        half = 0.5 * station.tag.size_m
        x, y, z = station.tag.position_m
        corners = [(x + half * a, y + half * b, z, 1.0) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))]
        self._tag = np.array(corners)
        self._level = ""

    def write(self, batch: Batch, ticks: Sequence[Tick]) -> None:
        """Write ticks (at least one) in their order."""
        places = np.array([self._place(tick) for tick in ticks])
        batch.scalars(paths.PLACE, places[:, [0, 1, 2, 4, 5, 6]])
        batch.scalars(paths.PLACE_ANGLE, np.degrees(places[:, [3, 7]]))
        seen = [(index, tick.percept) for index, tick in enumerate(ticks) if isinstance(tick.percept, LandingPercept)]
        if not seen:
            return
        outlines = [self._outline(percept) for _, percept in seen]
        strips = [outline for outline in outlines if outline is not None]
        columns = rr.LineStrips2D.columns(strips=np.array(strips, dtype=np.float32).reshape(-1, 5, 2))
        frames = batch.select(np.array([index for index, _ in seen]))
        frames.send(paths.TAG_OUTLINE, columns.partition([0 if outline is None else 1 for outline in outlines]))
        changes: list[tuple[int, str]] = []
        for index, percept in seen:
            if percept.level != self._level:
                self._level = percept.level
                changes.append((index, percept.level))
        if changes:
            at = batch.select(np.array([index for index, _ in changes]))
            at.send(paths.LEVEL_STATE, rr.StateChange.columns(state=[level for _, level in changes]))

    def _place(self, tick: Tick) -> list[float]:
        """ξ, η, ζ, ψ, true and then estimated; NaN, which breaks a line, where there is no estimate."""
        landing, percept = tick.truth.landing, tick.percept
        true = [math.nan] * 4 if landing is None else [*landing.seat_error_m.tolist(), landing.heading_error_rad]
        if percept is None or percept.pose is None:
            return [*true, *([math.nan] * 4)]
        T_station_body = percept.pose.T_station_camera @ self._T_camera_body
        x, y, z, _ = (T_station_body @ self._seat).tolist()
        heading = math.atan2(float(T_station_body[1, 0]), float(T_station_body[0, 0]))
        return [*true, x, y, z - self._place_up_m, heading]

    def _outline(self, percept: LandingPercept) -> Array | None:
        if percept.tag is None:
            return None
        points = (invert(percept.tag.T_station_camera) @ self._tag.T).T[:, :3]
        if float(points[:, 2].min()) <= 0.01:
            return None
        return self._camera.project(points) + _PIXEL_CORNER
