"""The blueprint: which views the viewer opens and what each shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb

from auvdock.core.landing_station import LandingStationCfg
from auvdock.recording import paths
from auvdock.recording.rotating import beacon_of, rotating_views

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup

__all__ = ["make_blueprint"]

_ON_THE_IMAGE = (paths.DETECTIONS, paths.TRACKS, paths.BEARINGS, paths.TAG_OUTLINE)
"""Marks that belong on the image and not into the scene."""


def make_blueprint(setup: EpisodeSetup) -> rrb.Blueprint:
    """3-D scene on the left; the camera at the top right, plots and the pilot's modes below it."""
    landing = isinstance(setup.station, LandingStationCfg)
    return rrb.Blueprint(
        rrb.Horizontal(
            _scene(setup),
            rrb.Vertical(_camera(), _plots(setup), _modes(landing), row_shares=[5, 4, 3]),
            column_shares=[1, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline=paths.SIM_TIME),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _scene(setup: EpisodeSetup) -> rrb.Spatial3DView:
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
    eye, target = (x + 10.0, y + 17.0, z + 6.5), (x + 6.5, y, z)
    if isinstance(setup.station, LandingStationCfg):
        eye, target = (x - 4.0, y - 6.5, z + 3.5), (x, y, z + 2.0)
    return rrb.Spatial3DView(
        name="Scene",
        origin=paths.WORLD,
        contents=[
            "+ $origin/**",
            f"- {paths.DETECTIONS}",
            f"- {paths.TRACKS}",
            f"- {paths.BEARINGS}",
            f"- {paths.TAG_OUTLINE}",
        ],
        background=[12, 26, 40],
        line_grid=rrb.LineGrid3D(
            plane=rr.components.Plane3D.XY.with_distance(z - setup.station.floor_below_m),
            spacing=1.0 if isinstance(setup.station, LandingStationCfg) else 5.0,
            color=[90, 120, 140, 60],
        ),
        eye_controls=rrb.EyeControls3D(position=eye, look_target=target),
        overrides={paths.PATH: until_now, paths.ESTIMATES: until_now},
    )


def _camera() -> rrb.Spatial2DView:
    return rrb.Spatial2DView(name="Camera", origin=paths.CAMERA, background=[0, 0, 0])


def _plot(name: str, path: str) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(name=name, origin=path, plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop))


def _plots(setup: EpisodeSetup) -> rrb.Tabs:
    first: list[rrb.Vertical] = []
    if beacon_of(setup) is not None:
        first.append(rotating_views())
    if isinstance(setup.station, LandingStationCfg):
        place = (_plot("Seat from its place, m", paths.PLACE), _plot("Heading error, deg", paths.PLACE_ANGLE))
        first.append(rrb.Vertical(*place, name="Place"))
    return rrb.Tabs(
        *first,
        rrb.Vertical(
            _plot("Pose error against truth, m", paths.POSE_ERROR),
            _plot("Pose error against truth, deg", paths.POSE_ANGLE),
            name="Pose error",
        ),
        rrb.Vertical(_plot("Range", paths.RANGE), _plot("Speed", paths.SPEED), name="Motion"),
        _plot("Commands", paths.COMMANDS),
        rrb.Vertical(_plot("Current", paths.CURRENT), _plot("Contact", paths.CONTACT), name="Water and contact"),
        rrb.Vertical(
            _plot("Lights", paths.LIGHT_COUNTS), _plot("Reprojection error", paths.REPROJECTION), name="Perception"
        ),
        active_tab=0,
    )


def _modes(landing: bool) -> rrb.Tabs:
    lanes = [rrb.StateTimelineView(name="Mode", origin=paths.MODE_STATE)]
    if landing:
        lanes.append(rrb.StateTimelineView(name="Level", origin=paths.LEVEL_STATE))
    return rrb.Tabs(
        rrb.Horizontal(
            rrb.Vertical(*lanes) if landing else lanes[0],
            rrb.TextLogView(
                name="Mode changes",
                origin=paths.MODE_LOG,
                columns=rrb.TextLogColumns(timeline_columns=[paths.SIM_TIME], text_log_columns=["body"]),
            ),
            name="Mode",
        ),
        _plot("Mode number", paths.MODE_NUMBER),
        rrb.TextDocumentView(name="Episode", origin=paths.SUMMARY),
        active_tab=0,
    )
