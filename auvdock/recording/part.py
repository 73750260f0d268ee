"""What a kind of station adds to a recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import rerun as rr
import rerun.blueprint as rrb

from auvdock.core.arrays import Array
from auvdock.recording.batch import Batch

if TYPE_CHECKING:
    from auvdock.metrics.tick import Tick

__all__ = ["Point", "Series", "StationPart", "plot"]

Point = tuple[float, float, float]
Series = tuple[tuple[str, int], ...]
"""Name and colour of each series of a plot."""


class StationPart(ABC):
    """One episode's recording, as far as it is one kind of station's own.

    Attributes:
        grid_m: spacing of the grid on the floor.
        plots: series of plots that other kinds do not have, or name differently, by the plots' paths.
        modes: colours of guidance modes that other kinds do not have.
    """

    grid_m: float
    plots: Mapping[str, Series] = {}
    modes: Mapping[str, int] = {}

    @abstractmethod
    def eye(self, station_m: Point) -> tuple[Point, Point]:
        """Where the scene is looked at from and what at, in the world; `station_m` is the station frame's origin."""

    @abstractmethod
    def log_scene(self, stream: rr.RecordingStream) -> None:
        """Log what stays the same: the station's body, in the station frame, and how its own marks look."""

    @abstractmethod
    def place(self, to_go_m: float) -> str:
        """Where the vehicle is, in words for the log of modes, by `Truth.to_go_m`."""

    def views(self) -> list[rrb.Vertical]:
        """Tabs of plots that other kinds do not have, the foremost first."""
        return []

    def lanes(self) -> list[rrb.StateTimelineView]:
        """States shown below the pilot's modes."""
        return []

    def write(self, batch: Batch, ticks: Sequence[Tick], T_station_camera: Array) -> None:  # noqa: B027 - often none
        """Write its own columns of ticks (at least one) in their order.

        Args:
            batch: their times.
            ticks: n control periods.
            T_station_camera: (n, 4, 4) true poses of the camera.
        """


def plot(name: str, path: str) -> rrb.TimeSeriesView:
    """A plot against time of what lies below a path."""
    return rrb.TimeSeriesView(name=name, origin=path, plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop))
