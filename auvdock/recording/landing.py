"""A landing in a recording: platform, guides and tag; errors ξ, η, ζ, ψ, the tag's outline, the level in use."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from auvdock.core.arrays import Array
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.transforms import invert
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.recording import paths
from auvdock.recording.batch import PIXEL_CORNER, Batch
from auvdock.recording.palette import rgba
from auvdock.recording.part import Point, Series, StationPart, plot

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup
    from auvdock.metrics.tick import Tick

__all__ = ["LandingPart"]

_PLATE_M = 0.02
_ABOVE_M = 0.002
"""So far above the platform is the tag's outline drawn, to be seen."""
_AXES = (("ξ, m", rgba(255, 120, 90)), ("η, m", rgba(110, 220, 130)), ("ζ, m", rgba(110, 170, 255)))
_PALE = (
    ("ξ estimated, m", rgba(255, 190, 170)),
    ("η estimated, m", rgba(190, 245, 200)),
    ("ζ estimated, m", rgba(190, 215, 255)),
)
_LEVELS: Mapping[str, int] = {
    "none": rgba(110, 110, 120),
    "lights": rgba(90, 130, 255),
    "tag": rgba(230, 200, 80),
    "fused": rgba(90, 200, 110),
}
"""What a landing's pose rests on, and its colour."""


class LandingPart(StationPart):
    """A platform on the floor."""

    grid_m = 1.0
    plots: Mapping[str, Series] = {
        paths.PLACE: (*_AXES, *_PALE),
        paths.PLACE_ANGLE: (("ψ, deg", rgba(240, 200, 90)), ("ψ estimated, deg", rgba(250, 235, 190))),
        paths.RANGE: (("seat to its place, m", rgba(110, 200, 255)),),
    }
    modes: Mapping[str, int] = {
        "search": rgba(130, 130, 140),
        "align": rgba(60, 160, 200),
        "descend": rgba(230, 160, 50),
        "touchdown": rgba(220, 110, 50),
    }

    def __init__(self, setup: EpisodeSetup, station: LandingStationCfg) -> None:
        """Begin an episode."""
        self._station = station
        self._camera = setup.camera
        self._T_camera_body = invert(setup.camera.T_body_camera)
        self._seat = np.append(setup.vehicle.seat_body_m, 1.0)
        half = 0.5 * station.tag.size_m
        x, y, z = station.tag.position_m
        corners = [(x + half * a, y + half * b, z, 1.0) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))]
        self._tag = np.array(corners)
        self._level = ""

    def eye(self, station_m: Point) -> tuple[Point, Point]:
        """From the side and above, with the descent in view."""
        x, y, z = station_m
        return (x - 4.0, y - 6.5, z + 3.5), (x, y, z + 2.0)

    def log_scene(self, stream: rr.RecordingStream) -> None:
        """Log platform, guides and tag, in the station frame, and how the tag's outline and the levels look."""
        for name, shape in _platform(self._station).items():
            stream.log(f"{paths.PLATFORM}/{name}", shape, static=True, strict=True)
        outline = self._tag[:, :3] + np.array([0.0, 0.0, _ABOVE_M])
        tag = rr.LineStrips3D(
            [outline], colors=[rgba(255, 255, 255)], radii=[0.006], labels=[f"tag {self._station.tag.tag_id}"]
        )
        stream.log(f"{paths.PLATFORM}/tag", tag, static=True, strict=True)
        lines = rr.LineStrips2D.from_fields(colors=[rgba(255, 240, 90)], radii=[-2.0])
        stream.log(paths.TAG_OUTLINE, lines, static=True, strict=True)
        levels = rr.StateConfiguration(values=list(_LEVELS), colors=np.array(list(_LEVELS.values()), dtype=np.uint32))
        stream.log(paths.LEVEL_STATE, levels, static=True, strict=True)

    def views(self) -> list[rrb.Vertical]:
        """The seat's place and heading."""
        place = plot("Seat from its place, m", paths.PLACE)
        return [rrb.Vertical(place, plot("Heading error, deg", paths.PLACE_ANGLE), name="Place")]

    def lanes(self) -> list[rrb.StateTimelineView]:
        """The level in use."""
        return [rrb.StateTimelineView(name="Level", origin=paths.LEVEL_STATE)]

    def place(self, to_go_m: float) -> str:
        """The seat's way to its place."""
        return f"{to_go_m:.2f} m from the guides"

    def write(self, batch: Batch, ticks: Sequence[Tick], T_station_camera: Array) -> None:
        """Write errors ξ, η, ζ, ψ against time, the tag's outline, the level in use."""
        places = np.array([self._errors(tick) for tick in ticks])
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

    def _errors(self, tick: Tick) -> list[float]:
        """ξ, η, ζ, ψ, true and then estimated; NaN, which breaks a line, where there is no estimate."""
        landing, percept = tick.truth.landing, tick.percept
        true = [math.nan] * 4 if landing is None else [*landing.seat_error_m.tolist(), landing.heading_error_rad]
        if percept is None or percept.pose is None:
            return [*true, *([math.nan] * 4)]
        T_station_body = percept.pose.T_station_camera @ self._T_camera_body
        x, y, z, _ = (T_station_body @ self._seat).tolist()
        heading = math.atan2(float(T_station_body[1, 0]), float(T_station_body[0, 0]))
        return [*true, x, y, z - self._station.guide.seat_height_m, heading]

    def _outline(self, percept: LandingPercept) -> Array | None:
        if percept.tag is None:
            return None
        points = (invert(percept.tag.T_station_camera) @ self._tag.T).T[:, :3]
        if float(points[:, 2].min()) <= 0.01:
            return None
        return self._camera.project(points) + PIXEL_CORNER


def _platform(station: LandingStationCfg) -> dict[str, rr.Boxes3D]:
    """Slab and guide plates by their names."""
    size = (station.length_m, station.width_m, station.height_m)
    boxes = {"slab": ((0.0, 0.0, -0.5 * station.height_m), size, 0.0)}
    guide = station.guide
    angle = math.radians(guide.opening_half_angle_deg)
    apex_m = guide.seat_height_m - guide.seat_radius_m / math.sin(angle)
    length = guide.mouth_half_width_m / math.sin(angle)
    for name, x in zip(("head", "tail"), guide.x_m, strict=True):
        for side, sign in (("port", 1.0), ("starboard", -1.0)):
            y = sign * 0.5 * (length * math.sin(angle) + _PLATE_M * math.cos(angle))
            z = apex_m + 0.5 * (length * math.cos(angle) - _PLATE_M * math.sin(angle))
            boxes[f"guide_{name}_{side}"] = ((x, y, z), (guide.thickness_m, _PLATE_M, length), -sign * angle)
    shapes: dict[str, rr.Boxes3D] = {}
    for name, (centre, extent, turn) in boxes.items():
        quaternion = rr.Quaternion(xyzw=[math.sin(0.5 * turn), 0.0, 0.0, math.cos(0.5 * turn)])
        shapes[name] = rr.Boxes3D(
            half_sizes=[[0.5 * part for part in extent]],
            centers=[centre],
            quaternions=[quaternion],
            colors=[rgba(150, 158, 165)],
            fill_mode=rr.components.FillMode.Solid,
        )
    return shapes
