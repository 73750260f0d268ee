"""The blueprint: which views the viewer opens and what each shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb

from auvdock.recording import paths
from auvdock.recording.part import StationPart, plot

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup

__all__ = ["make_blueprint"]

_ON_THE_IMAGE = (paths.DETECTIONS, paths.TRACKS, paths.BEARINGS, paths.TAG_OUTLINE)
"""Marks that belong on the image and not into the scene."""


def make_blueprint(setup: EpisodeSetup, part: StationPart) -> rrb.Blueprint:
    """3-D scene on the left; the camera at the top right, plots and the pilot's modes below it."""
    return rrb.Blueprint(
        rrb.Horizontal(
            _scene(setup, part),
            rrb.Vertical(_camera(), _plots(part), _modes(part), row_shares=[5, 4, 3]),
            column_shares=[1, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline=paths.SIM_TIME),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _scene(setup: EpisodeSetup, part: StationPart) -> rrb.Spatial3DView:
    # Path and estimates are logged piece by piece: only "everything up to now" makes them a line and a cloud.
    until_now = rrb.VisibleTimeRanges(
        [
            rrb.VisibleTimeRange(
                timeline, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
            )
            for timeline in (paths.SIM_TIME, paths.FRAME)
        ]
    )
    x, y, z = (float(part) for part in setup.T_world_station[:3, 3])
    eye, target = part.eye((x, y, z))
    return rrb.Spatial3DView(
        name="Scene",
        origin=paths.WORLD,
        contents=["+ $origin/**", *(f"- {path}" for path in _ON_THE_IMAGE)],
        background=[12, 26, 40],
        line_grid=rrb.LineGrid3D(
            plane=rr.components.Plane3D.XY.with_distance(z - setup.station.floor_below_m),
            spacing=part.grid_m,
            color=[90, 120, 140, 60],
        ),
        eye_controls=rrb.EyeControls3D(position=eye, look_target=target),
        overrides={paths.PATH: until_now, paths.ESTIMATES: until_now},
    )


def _camera() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(name="Camera", origin=paths.CAMERA, background=[0, 0, 0])


def _plots(part: StationPart) -> rrb.Tabs:
    return rrb.Tabs(
        *part.views(),
        rrb.Vertical(
            plot("Pose error against truth, m", paths.POSE_ERROR),
            plot("Pose error against truth, deg", paths.POSE_ANGLE),
            name="Pose error",
        ),
        rrb.Vertical(plot("Range", paths.RANGE), plot("Speed", paths.SPEED), name="Motion"),
        plot("Commands", paths.COMMANDS),
        rrb.Vertical(plot("Current", paths.CURRENT), plot("Contact", paths.CONTACT), name="Water and contact"),
        rrb.Vertical(
            plot("Lights", paths.LIGHT_COUNTS), plot("Reprojection error", paths.REPROJECTION), name="Perception"
        ),
        active_tab=0,
    )


def _modes(part: StationPart) -> rrb.Tabs:
    lanes = [rrb.StateTimelineView(name="Mode", origin=paths.MODE_STATE), *part.lanes()]
    return rrb.Tabs(
        rrb.Horizontal(
            rrb.Vertical(*lanes) if len(lanes) > 1 else lanes[0],
            rrb.TextLogView(
                name="Mode changes",
                origin=paths.MODE_LOG,
                columns=rrb.TextLogColumns(timeline_columns=[paths.SIM_TIME], text_log_columns=["body"]),
            ),
            name="Mode",
        ),
        plot("Mode number", paths.MODE_NUMBER),
        rrb.TextDocumentView(name="Episode", origin=paths.SUMMARY),
        active_tab=0,
    )
