"""The conical station in a recording: funnel and tube."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from auvdock.core.station import ConicalStationCfg
from auvdock.recording import paths
from auvdock.recording.meshes import frustum
from auvdock.recording.modes import from_the_mouth
from auvdock.recording.palette import rgba
from auvdock.recording.part import Point, StationPart

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup

__all__ = ["ConicalPart"]

_OUTWARDS = np.array([1.0, 0.0, 0.0])


class ConicalPart(StationPart):
    """A funnel and the tube behind it; all else is what every kind of station has."""

    grid_m = 5.0

    def __init__(self, setup: EpisodeSetup, station: ConicalStationCfg) -> None:
        """Begin an episode."""
        self._setup, self._funnel = setup, station.funnel

    def eye(self, station_m: Point) -> tuple[Point, Point]:
        """From the side and above, with the approach in view."""
        x, y, z = station_m
        return (x + 10.0, y + 17.0, z + 6.5), (x + 6.5, y, z)

    def log_scene(self, stream: rr.RecordingStream) -> None:
        """Log funnel and tube."""
        funnel = self._funnel
        throat = np.array([-funnel.length_m, 0.0, 0.0])
        cone = frustum(np.zeros(3), -_OUTWARDS, funnel.length_m, funnel.mouth_radius_m, funnel.tube_radius_m, 48)
        tube = frustum(throat, -_OUTWARDS, funnel.tube_length_m, funnel.tube_radius_m, funnel.tube_radius_m)
        for path, mesh in ((paths.FUNNEL, cone), (paths.TUBE, tube)):
            stream.log(path, mesh.shown(rgba(200, 205, 210, 110)), static=True, strict=True)

    def place(self, to_go_m: float) -> str:
        """The nose's way to the mouth."""
        return from_the_mouth(to_go_m)
