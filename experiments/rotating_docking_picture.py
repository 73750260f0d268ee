"""Tracks of the rotating beacon's docking from above, beside those of the same starts without it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Wedge

from auvdock.experiments.rotating_docking import Arm, Flight

__all__ = ["draw_tracks"]

_REACH_M = 52.0
_FRONT, _BEHIND, _FAILED = "#2a78b5", "#7a4fb0", "#d0452f"


def draw_tracks(path: Path, panels: Sequence[tuple[Arm, Sequence[Flight]]], shown: int = 40) -> None:
    """Draw the first `shown` flights of each arm from above, station frame, into a PNG file.

    Args:
        path: the file.
        panels: arms with their flights, one panel each.
        shown: flights drawn in each.
    """
    figure = Figure(figsize=(6.4 * len(panels), 6.6), dpi=110, layout="constrained")
    axes: list[Any] = np.atleast_1d(figure.subplots(1, len(panels), sharex=True, sharey=True)).tolist()
    for axis, (arm, flights) in zip(axes, panels, strict=True):
        _ground(axis)
        drawn = list(flights)[:shown]
        for flight in drawn:
            _track(axis, flight)
        docked = sum(flight.result.success for flight in drawn)
        axis.set_title(f"{arm.title}: {docked} of {len(drawn)} dock", fontsize=11)
        axis.set_xlabel("x along the approach axis, m")
    axes[0].set_ylabel("y, m")
    _legend(axes[-1])
    figure.savefig(path)


def _ground(axis: Any) -> None:  # noqa: ANN401 - matplotlib's axes are untyped
    axis.set_aspect("equal")
    axis.set_xlim(-_REACH_M, _REACH_M)
    axis.set_ylim(-_REACH_M, _REACH_M)
    axis.add_patch(Wedge((0.0, 0.0), 25.0, -22.5, 22.5, color="#f2d675", alpha=0.35, lw=0, zorder=0))
    for radius in (20.0, 45.0):
        axis.add_patch(Circle((0.0, 0.0), radius, fill=False, ls=":", color="#999999", lw=0.8, zorder=0))
    axis.add_patch(Circle((-1.35, 0.0), 12.0, fill=False, ls="--", color="#999999", lw=0.8, zorder=0))
    body = [(0.0, -1.0), (0.0, 1.0), (-1.2, 0.15), (-2.7, 0.15), (-2.7, -0.15), (-1.2, -0.15)]
    axis.add_patch(Polygon(body, color="#333333", zorder=3))
    axis.grid(visible=True, color="#eeeeee", zorder=-1)


def _track(axis: Any, flight: Flight) -> None:  # noqa: ANN401
    places = np.array(flight.path_m)
    colour = (_BEHIND if flight.behind else _FRONT) if flight.result.success else _FAILED
    axis.plot(places[:, 0], places[:, 1], color=colour, lw=1.0, alpha=0.75, zorder=2)
    axis.plot(places[0, 0], places[0, 1], marker="o", ms=4, color=colour, mec="white", mew=0.5, zorder=4)


def _legend(axis: Any) -> None:  # noqa: ANN401
    angle = math.radians(22.5)
    axis.annotate("array's beams", (14.0 * math.cos(angle) + 8.0, -3.0), fontsize=8, color="#8a7420")
    for label, colour in (("docked, began in front", _FRONT), ("docked, began behind", _BEHIND), ("failed", _FAILED)):
        axis.plot([], [], color=colour, label=label)
    axis.legend(loc="lower left", fontsize=8, framealpha=0.9)
