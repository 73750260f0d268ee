"""Sections through guidance spaces, as PNG."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.core.errors import ConfigError

__all__ = ["Panel", "draw_curves", "draw_sections", "make_folder", "save_figure", "section_grid"]

_COLOURS = ("#f4f4f4", "#dfe7ee", "#c6d6e5", "#a9c3dc", "#5b9bd5", "#2e75b6", "#1f4e79", "#17375e", "#0f2540")


@dataclass(frozen=True, eq=False)
class Panel:
    """One section.

    Attributes:
        title: what is cut.
        across: name of the axis to the right.
        up: name of the axis upwards.
        across_m: (n,) coordinates.
        up_m: (k,) coordinates.
        count: (n, k) lights found there.
        marks_m: (j, 2) places of the array's lights in the section's axes.
        agreed: (p, 3) places checked in rendered frames: across, up, 1 where enough lights were found, else 0.
    """

    title: str
    across: str
    up: str
    across_m: Array
    up_m: Array
    count: IntArray
    marks_m: Array
    agreed: Array | None = None


def section_grid(
    count: Callable[[Array], IntArray], axes: tuple[int, int], across_m: Array, up_m: Array, fixed_m: float
) -> IntArray:
    """Lights found (n, k) over a plane parallel to two axes of the station frame, the third held at `fixed_m`."""
    one, other = np.meshgrid(across_m, up_m, indexing="ij")
    points = np.full((one.size, 3), fixed_m)
    points[:, axes[0]], points[:, axes[1]] = one.ravel(), other.ravel()
    return count(points).reshape(one.shape)


def draw_sections(path: Path, title: str, panels: list[Panel], needed: int) -> None:
    """Write a picture with the panels side by side.

    Raises:
        ConfigError: the file cannot be written.
    """
    figure = Figure(figsize=(5.4 * len(panels), 5.2), layout="constrained")
    figure.suptitle(title, parse_math=False)  # it may bear a file's name, with a dollar sign in it
    # One colour for each number of lights: the region begins where the strong blue does.
    shift = max(needed - 4, 0)
    colours = ListedColormap([_COLOURS[max(k - shift, 0)] for k in range(len(_COLOURS))])
    norm = BoundaryNorm(np.arange(-0.5, len(_COLOURS)), len(_COLOURS))
    image = None
    for index, panel in enumerate(panels):
        axes: Axes = figure.add_subplot(1, len(panels), index + 1)
        image = axes.pcolormesh(
            panel.across_m, panel.up_m, np.minimum(panel.count, 8).T, cmap=colours, norm=norm, shading="nearest"
        )
        inside: BoolArray = panel.count >= needed
        if inside.any() and not inside.all():
            axes.contour(panel.across_m, panel.up_m, inside.T.astype(float), [0.5], colors="black", linewidths=1.0)
        axes.plot(panel.marks_m[:, 0], panel.marks_m[:, 1], "o", color="#d95f02", markersize=4, label="array lights")
        if panel.agreed is not None:
            seen = panel.agreed[:, 2] > 0.5
            axes.plot(*panel.agreed[seen, :2].T, "o", color="#1b9e77", markersize=3, label="pixels: found")
            axes.plot(*panel.agreed[~seen, :2].T, "x", color="#d7191c", markersize=4, label="pixels: not found")
        axes.set_title(panel.title, fontsize=10)
        axes.set_xlabel(f"{panel.across} [m]")
        axes.set_ylabel(f"{panel.up} [m]")
        axes.set_aspect("equal")
        if index == 0:
            handles, labels = axes.get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside lower left", ncols=len(labels), fontsize=8)
    if image is not None:
        figure.colorbar(image, ax=figure.axes, label="array lights found", ticks=range(9), shrink=0.8)
    save_figure(figure, path)


def draw_curves(path: Path, title: str, curves: list[tuple[str, Array, Array]]) -> None:
    """Write a picture of sweeps: name of the swept quantity, its values (n,), volumes (n,) in m³."""
    figure = Figure(figsize=(4.2 * len(curves), 3.6), layout="constrained")
    figure.suptitle(title, parse_math=False)  # it may bear a file's name, with a dollar sign in it
    for index, (name, values, volumes) in enumerate(curves):
        axes: Axes = figure.add_subplot(1, len(curves), index + 1)
        axes.plot(values, volumes, "o-", color="#1f4e79")
        axes.set_ylim(0.0, 1.08 * max(float(volumes.max()), 1e-9))
        axes.set_xlabel(name)
        axes.set_ylabel("volume [m³]")
        axes.grid(alpha=0.3)
    save_figure(figure, path)


def make_folder(folder: Path) -> None:
    """Make a folder for results; ask before long work, so that it is not lost.

    Raises:
        ConfigError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError("out", str(folder), f"a folder that can be written to ({error.strerror})") from error


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG.

    Raises:
        ConfigError: the file cannot be written.
    """
    make_folder(path.parent)
    try:
        FigureCanvasAgg(figure).print_png(str(path))
    except OSError as error:
        raise ConfigError("out", str(path), f"a folder that can be written to ({error.strerror})") from error
