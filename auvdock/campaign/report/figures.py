"""Figures of the report as inline SVG."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from auvdock.campaign.report.cells import Campaign, Map, by_axis, rate_of
from auvdock.campaign.row import Row
from auvdock.episode.result import FAILURE_REASONS

__all__ = ["axis_figure", "cause_figure", "distribution_figure", "map_figure"]

INK, MUTED, GRID = "#1b2a38", "#5b6b7a", "#d5dde4"
DOCKED, FAILED = "#2a7ab8", "#d9822b"
CAUSES = {
    "search": "#3b4cc0",
    "approach": "#2f7f86",
    "circle": "#4fa59a",
    "lineup": "#86c5a4",
    "far": "#5f8fd8",
    "mid": "#8fc1de",
    "near": "#f2b872",
    "terminal": "#dd7a3c",
    "collision": "#b3262e",
    "timeout": "#7d7d7d",
    "diverged": "#8e5ea2",
    "interrupted": "#c4c4c4",
    "hung": "#4d4d4d",
    "crashed": "#111111",
}
"""One colour per cause, from blue (far from the station) to red (at it)."""

DISTRIBUTIONS = (
    ("distortion_rate", "distortion rate, %", 100.0),
    ("false_pose_rate", "false poses, %", 100.0),
    ("entry_distance_m", "entry distance, m", 1.0),
    ("time_s", "time, s", 1.0),
    ("energy_j", "energy, kJ", 1e-3),
    ("peak_contact_force_n", "peak contact force, N", 1.0),
    ("touchdown_speed_m_s", "touchdown speed, cm/s", 100.0),
    ("final_position_error_m", "final position error, mm", 1000.0),
    ("final_heading_error_rad", "final heading error, °", 180.0 / math.pi),
)
"""Columns, their labels and the factor to the label's unit; those of which a station has nothing are left out."""


_styled = rc_context(
    {
        "svg.fonttype": "none",  # text stays text: it can be searched and copied
        "text.parse_math": False,  # names of one's own may have a dollar sign
        "font.size": 10,
        "text.color": INK,
        "axes.labelcolor": INK,
    }
)


@_styled
def map_figure(found: Map) -> str:
    """Heat map of success rates, each cell with its rate, interval and number of episodes."""
    shares = np.array([[np.nan if cell.rate is None else cell.rate for cell in line] for line in found.rates])
    rows, columns = shares.shape
    figure = Figure(figsize=(1.6 + 1.25 * columns, 1.3 + 0.62 * rows), layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(shares, cmap="cividis", vmin=0.0, vmax=1.0, origin="lower", aspect="auto")
    for row, line in enumerate(found.rates):
        for column, cell in enumerate(line):
            dark = cell.rate is None or cell.rate < 0.55
            text = "–" if cell.rate is None else f"{100 * cell.rate:.0f} %"
            ink = "white" if dark else INK
            axes.text(column, row + 0.08, text, ha="center", va="bottom", fontsize=11, fontweight="bold", color=ink)
            below = f"[{100 * cell.low:.0f}, {100 * cell.high:.0f}]  n={cell.episodes}"
            axes.text(column, row - 0.05, below, ha="center", va="top", fontsize=7.5, color=ink)
    axes.set_xticks(range(columns), found.across.ticks)
    axes.set_xlabel(found.across.label)
    if found.down is not None:
        axes.set_yticks(range(rows), found.down.ticks)
        axes.set_ylabel(found.down.label)
    else:
        axes.set_yticks([])
    axes.set_xticks(np.arange(columns - 1) + 0.5, minor=True)
    axes.set_yticks(np.arange(rows - 1) + 0.5, minor=True)
    axes.grid(which="minor", color="white", linewidth=2)
    axes.tick_params(which="both", length=0)
    bar = figure.colorbar(image, ax=axes, fraction=0.03, pad=0.02)
    bar.set_label("success rate")
    bar.outline.set_visible(False)
    return _svg(figure, "map")


@_styled
def axis_figure(campaign: Campaign) -> str:
    """Success rate along each axis with Wilson 95 % intervals."""
    axes_cfg = [axis for axis in campaign.cfg.axes if not axis.is_grid or len(axis.grid) > 1]
    figure = Figure(figsize=(max(4.2, 3.4 * len(axes_cfg)), 2.9), layout="constrained")
    for number, axis in enumerate(axes_cfg):
        cut, groups = by_axis(campaign.rows, axis)
        rates = [rate_of(group) for group in groups]
        axes = figure.add_subplot(1, len(axes_cfg), number + 1)
        for place, rate in enumerate(rates):
            if rate.rate is not None:
                axes.plot([place, place], [100 * rate.low, 100 * rate.high], color=DOCKED, linewidth=2)
                axes.plot(place, 100 * rate.rate, "o", color=DOCKED, markersize=6)
        axes.set_xticks(range(len(rates)), cut.ticks, rotation=30 if max(map(len, cut.ticks)) > 6 else 0)
        axes.set_xlabel(cut.label)
        axes.set_ylim(-3, 103)
        axes.set_ylabel("success, %" if number == 0 else "")
        _tidy(axes)
    return _svg(figure, "axes")


@_styled
def cause_figure(campaign: Campaign) -> str:
    """Failure causes by stage: overall, then along the map's second axis."""
    causes = [name for name in FAILURE_REASONS if any(row["failure_reason"] == name for row in campaign.rows)]
    axis = next((axis for axis in campaign.cfg.axes if axis.name == "current"), None)
    axis = axis or next(iter(campaign.cfg.axes), None)
    names, groups = ["all"], [campaign.rows]
    label = ""
    if axis is not None:
        cut, cells = by_axis(campaign.rows, axis)
        names, groups, label = [*cut.ticks, "all"], [*cells, campaign.rows], cut.label
    figure = Figure(figsize=(8.2, 1.3 + 0.34 * len(names)), layout="constrained")
    axes = figure.add_subplot()
    for place, group in enumerate(groups):
        left = 0.0
        for cause in causes:
            count = sum(row["failure_reason"] == cause for row in group)
            width = 100.0 * count / max(1, len(group))
            axes.barh(place, width, left=left, color=CAUSES[cause], height=0.72, edgecolor="white", linewidth=0.6)
            if width > 2.5:
                light = cause in ("mid", "near", "interrupted")
                axes.text(
                    left + width / 2, place, str(count), ha="center", va="center", fontsize=8,
                    color=INK if light else "white",
                )  # fmt: skip
            left += width
        axes.text(left + 0.4, place, f"n={len(group)}", va="center", fontsize=7.5, color=MUTED)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylabel(label)
    axes.set_xlabel("failed episodes, % of the row's")
    handles = [axes.barh(0, 0, color=CAUSES[cause], label=cause) for cause in causes]
    if handles:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=9)
    else:
        axes.set_xlim(0, 10)
    axes.margins(x=0.08)
    _tidy(axes)
    return _svg(figure, "causes")


@_styled
def distribution_figure(rows: Sequence[Row]) -> str:
    """Histograms of the metrics, docked and failed stacked."""
    shown = [entry for entry in DISTRIBUTIONS if any(row[entry[0]] is not None for row in rows)]
    lines = 1 + len(shown) // 3  # the legend takes a place too
    figure = Figure(figsize=(11.0, 2.7 * lines), layout="constrained")
    for number, (column, label, factor) in enumerate(shown):
        axes = figure.add_subplot(lines, 3, number + 1)
        docked = _values(rows, column, factor, success=True)
        failed = _values(rows, column, factor, success=False)
        both = [*docked, *failed]
        if both:
            axes.hist([docked, failed], bins=30, stacked=True, color=[DOCKED, FAILED], label=["docked", "failed"])
            low, middle, high = np.quantile(both, [0.05, 0.5, 0.95])
            axes.axvline(middle, color=INK, linewidth=1.2)
            axes.set_title(f"median {middle:.3g}, 5–95 %: {low:.3g} to {high:.3g}", fontsize=9, color=MUTED, loc="left")
        axes.set_xlabel(label)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylabel("episodes" if number % 3 == 0 else "")
        _tidy(axes)
    legend = figure.add_subplot(lines, 3, len(shown) + 1)
    legend.axis("off")
    for colour, name in ((DOCKED, "docked"), (FAILED, "failed")):
        legend.bar(0, 0, color=colour, label=name)
    legend.legend(loc="upper left", frameon=False)
    return _svg(figure, "distributions")


def _values(rows: Sequence[Row], column: str, factor: float, success: bool) -> list[float]:
    found = (row[column] for row in rows if row["success"] is success)
    return [factor * float(value) for value in found if value is not None]


def _tidy(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GRID)
    axes.tick_params(color=GRID, labelcolor=INK)
    axes.grid(axis="both", color=GRID, linewidth=0.5)
    axes.set_axisbelow(True)


def _svg(figure: Figure, salt: str) -> str:
    """The figure's SVG element; the salt keeps identifiers apart on one page and equal between runs."""
    buffer = io.StringIO()
    with rc_context({"svg.hashsalt": salt}):
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]
