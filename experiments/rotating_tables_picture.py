"""Plot of paper B's tables beside ours: error over distance, by day and night."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from auvdock.experiments.rotating_rig import X_M, Y_M
from auvdock.experiments.rotating_watch import Watch
from auvdock.planning.pictures import save_figure

__all__ = ["draw_errors"]

_COLOURS = ("#b03a2e", "#ca6f1e", "#2e75b6", "#1f4e79")


def draw_errors(
    path: Path,
    title: str,
    paper: dict[tuple[float, bool], tuple[float | None, ...]],
    watches: Sequence[Watch],
    ours: Callable[[Watch], Sequence[float]],
    paper_method: Callable[[Watch], Sequence[float]],
) -> None:
    """Write the picture: paper dashed, its method in our water dotted, ours drawn through; logarithmic error.

    Args:
        path: of the PNG.
        title: of the figure.
        paper: the published table.
        watches: all videos.
        ours: errors of a video by our method, degrees.
        paper_method: likewise by the paper's.
    """
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    figure.suptitle(f"paper B, {title}; mean absolute error")
    axes = figure.subplots(1, 2, sharey=True)
    for panel, day in zip(axes, (True, False), strict=True):
        panel.set_title("day" if day else "night")
        for x_m, colour in zip(X_M, _COLOURS, strict=True):
            published = [np.nan if value is None else value for value in paper[x_m, day]]
            panel.plot(Y_M, published, "--", color=colour, lw=1.0)
            for pick, style in ((paper_method, ":"), (ours, "o-")):
                values = [_mean(watches, x_m, y_m, day, pick) for y_m in Y_M]
                label = f"X = {x_m:+g} m" if pick is ours else None
                panel.plot(Y_M, values, style, color=colour, lw=1.3, ms=4, label=label)
        panel.set_yscale("log")
        panel.set_xlabel("Y in m")
        panel.grid(True, which="both", alpha=0.3)
    axes[0].set_ylabel("degrees")
    handles, labels = axes[1].get_legend_handles_labels()
    for style, name in (("--", "paper"), (":", "its method here"), ("o-", "ours")):
        (line,) = axes[1].plot([], [], style, color="black", lw=1.2, ms=4)
        handles.append(line)
        labels.append(name)
    axes[1].legend(handles, labels, fontsize=8, ncols=2)
    save_figure(figure, path)


def _mean(
    watches: Sequence[Watch], x_m: float, y_m: float, day: bool, pick: Callable[[Watch], Sequence[float]]
) -> float:
    there = [w for w in watches if (w.place.x_m, w.place.y_m, w.place.day) == (x_m, y_m, day)]
    errors = [abs(error) for w in there for error in pick(w)]
    return float(np.mean(errors)) if errors else float("nan")
