"""Pictures of the landing trials: paths and curves as paper C's figures 15 and 16, and error against range."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvdock.experiments.landing_ranges import RangeCell
from auvdock.experiments.landing_trials import PAPER, LandingTrial
from auvdock.planning.pictures import save_figure

__all__ = ["draw_curves_16", "draw_paths_15", "draw_ranges"]

_COLOURS = ("#1b6ca8", "#d95f02", "#1b9e77", "#a6266e", "#7a5c00")
_LEVEL_STYLE = {
    "lights": ("lights (level I)", "#d95f02", "o"),
    "tag": ("tag (level II)", "#1b6ca8", "s"),
    "both": ("fused", "#222222", "D"),
}
_AXES = (("ξ [m]", "to the head"), ("η [m]", "to starboard"), ("ζ [m]", "down"), ("ψ [°]", "to starboard"))


def draw_paths_15(path: Path, trials: Sequence[LandingTrial]) -> None:
    """The seat's way down to its place in the guides, in space: paper C, figure 15."""
    figure = Figure(figsize=(7.0, 6.4), layout="constrained")
    axes: Any = figure.add_subplot(projection="3d")
    for trial, colour in zip(trials, _cycle(len(trials)), strict=True):
        xi, eta, zeta = trial.estimated[:, :3].T
        axes.plot(xi, eta, -zeta, color=colour, linewidth=1.4, label=_label(trial))
        axes.plot(*(trial.true[0, :2]), -trial.true[0, 2], "o", color=colour, markersize=4)
    axes.plot([0.0], [0.0], [0.0], "k*", markersize=10, label="place in the guides")
    axes.set_xlabel("ξ [m]")
    axes.set_ylabel("η [m]")
    axes.set_zlabel("height -ζ [m]")
    axes.set_title("Landings by the estimated pose (paper C, figure 15)", fontsize=10)
    axes.legend(fontsize=8, loc="upper left")
    save_figure(figure, path)


def draw_curves_16(path: Path, trials: Sequence[LandingTrial]) -> None:
    """ξ, η, ζ and ψ over time, estimated and true: paper C, figure 16."""
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    figure.suptitle("Position and heading over the station (paper C, figure 16): estimated, true dotted")
    grid = figure.subplots(2, 2, sharex=True)
    for index, (name, way) in enumerate(_AXES):
        axes: Axes = grid[index // 2][index % 2]
        scale = 180.0 / np.pi if index == 3 else 1.0
        for trial, colour in zip(trials, _cycle(len(trials)), strict=True):
            axes.plot(trial.time_s, scale * trial.estimated[:, index], color=colour, linewidth=1.3, label=_label(trial))
            axes.plot(trial.time_s, scale * trial.true[:, index], ":", color="black", linewidth=0.8)
        axes.axhline(0.0, color="grey", linewidth=0.6)
        axes.set_ylabel(f"{name} ({way})")
        axes.grid(alpha=0.3)
        if index >= 2:
            axes.set_xlabel("time [s]")
    grid[0][0].legend(fontsize=8)
    save_figure(figure, path)


def draw_ranges(path: Path, cells: Sequence[RangeCell], title: str) -> None:
    """Position and heading error, and share of frames measured, over the camera's height above the tag."""
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    figure.suptitle(title, fontsize=11)
    position, heading, share = figure.subplots(3, 1, sharex=True)
    for levels, (label, colour, marker) in _LEVEL_STYLE.items():
        chosen = [cell for cell in cells if cell.levels == levels]
        middle = np.array([0.5 * (cell.low_m + cell.high_m) for cell in chosen])
        solved = [cell for cell in chosen if cell.position_m is not None]
        at = np.array([0.5 * (cell.low_m + cell.high_m) for cell in solved])
        for axes, values, bounds, scale in (
            (position, [cell.position_m for cell in solved], [cell.position_95 for cell in solved], 1000.0),
            (heading, [cell.heading_deg for cell in solved], [cell.heading_95 for cell in solved], 1.0),
        ):
            value = scale * np.array(values, dtype=np.float64)
            bound = scale * np.array(bounds, dtype=np.float64).reshape(-1, 2)
            gap = np.maximum(np.vstack([value - bound[:, 0], bound[:, 1] - value]), 0.0)
            axes.errorbar(at, value, yerr=gap, color=colour, marker=marker, markersize=4, capsize=3, label=label)
        share.plot(middle, [100.0 * cell.measured for cell in chosen], color=colour, marker=marker, markersize=4)
    position.axhline(1000.0 * PAPER["position_m"], color="grey", linestyle="--", linewidth=0.8, label="paper's bound")
    heading.axhline(PAPER["heading_deg"], color="grey", linestyle="--", linewidth=0.8)
    position.set_ylabel("position, rms [mm]")
    heading.set_ylabel("heading, rms [°]")
    share.set_ylabel("frames measured [%]")
    share.set_xlabel("height of the camera over the tag [m]")
    for axes in (position, heading):
        axes.set_yscale("log")
    for axes in (position, heading, share):
        axes.grid(alpha=0.3, which="both")
    position.legend(fontsize=8)
    save_figure(figure, path)


def _cycle(count: int) -> list[str]:
    return [_COLOURS[index % len(_COLOURS)] for index in range(count)]


def _label(trial: LandingTrial) -> str:
    return f"seed {trial.seed}" + ("" if trial.result.success else f" ({trial.result.failure_reason})")
