"""A campaign's rows grouped by what was varied."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from auvdock.campaign.axes import AxisCfg, AxisValue
from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.row import Row, outcome
from auvdock.campaign.statistics import Rate, wilson
from auvdock.campaign.store import read_campaign, read_manifest, read_table

__all__ = ["LABELS", "Binning", "Campaign", "Map", "load", "success_map"]

BINS = 6
"""Bins of a drawn axis."""

LABELS = {
    "current": "current speed, m/s",
    "attenuation": "attenuation at 450 nm, 1/m",
    "turbidity": "attenuation at 530 nm, Petzold's waters, 1/m",
    "current_direction": "current direction, °",
    "gust": "gusts, standard deviation, m/s",
    "shear": "shear, 1/m",
    "start_range": "start range, m",
    "start_lateral": "start offset sideways, m",
    "start_vertical": "start offset in depth, m",
    "start_heading": "start heading error, °",
    "interfering_lights": "interfering lights",
    "marine_snow": "marine snow",
    "surface_reflection": "surface reflection",
}
"""What axes are called on figures, where their name does not do."""


@dataclass(frozen=True, eq=False)
class Campaign:
    """A campaign that has run, or part of one.

    Attributes:
        folder: where it lies.
        cfg: what was asked.
        manifest: versions and more.
        rows: finished episodes, by number.
    """

    folder: Path
    cfg: CampaignCfg
    manifest: dict[str, Any]
    rows: list[Row]

    @property
    def rate(self) -> Rate:
        """Over all episodes that left a result."""
        return rate_of(self.rows)


def load(folder: Path) -> Campaign:
    """Read a campaign's folder.

    Raises:
        CampaignError: no campaign, or damaged files.
    """
    return Campaign(folder, read_campaign(folder), read_manifest(folder), read_table(folder).to_pylist())


def rate_of(rows: Sequence[Row]) -> Rate:
    """Success rate of some rows, over those that left a result."""
    found = [outcome(row) for row in rows]
    lost = found.count(None)
    return wilson(found.count(True), len(found) - lost, lost=lost)


@dataclass(frozen=True)
class Binning:
    """An axis cut into cells.

    Attributes:
        name: the axis.
        label: with its unit.
        ticks: text of each cell.
        place: from a value to its cell's number.
    """

    name: str
    label: str
    ticks: tuple[str, ...]
    place: Callable[[AxisValue], int]


def binning(axis: AxisCfg) -> Binning:
    """A grid axis by its values, a drawn one by bins of equal probability."""
    label = LABELS.get(axis.name, axis.name)
    if axis.is_grid:
        values = axis.grid
        index = {value: number for number, value in enumerate(values)}
        return Binning(axis.name, label, tuple(_text(value) for value in values), lambda value: index[value])
    edges = [axis.quantile(number / BINS) for number in range(BINS + 1)]
    ticks = tuple(f"{_text(low)} to {_text(high)}" for low, high in pairwise(edges))
    inner = edges[1:-1]
    return Binning(axis.name, label, ticks, lambda value: sum(float(value) >= edge for edge in inner))


@dataclass(frozen=True, eq=False)
class Map:
    """Success over two axes.

    Attributes:
        across: columns.
        down: rows; None if there is one axis only.
        rates: [row][column].
    """

    across: Binning
    down: Binning | None
    rates: list[list[Rate]]


def map_axes(cfg: CampaignCfg) -> tuple[AxisCfg, AxisCfg | None] | None:
    """The axes of the success map: turbidity across and current down, or the first that there are."""
    wanted = {"attenuation": 0, "turbidity": 0, "current": 1}
    axes = sorted(
        (axis for axis in cfg.axes if not axis.is_grid or len(axis.grid) > 1), key=lambda axis: wanted.get(axis.name, 2)
    )
    if not axes:
        return None
    return axes[0], axes[1] if len(axes) > 1 else None


def success_map(campaign: Campaign) -> Map | None:
    """Success rates over the map's axes; None if nothing varies."""
    axes = map_axes(campaign.cfg)
    if axes is None:
        return None
    across, down = binning(axes[0]), binning(axes[1]) if axes[1] is not None else None
    cells: list[list[list[Row]]] = [[[] for _ in across.ticks] for _ in (down.ticks if down else ("",))]
    for row in campaign.rows:
        cells[_place(row, down) if down else 0][_place(row, across)].append(row)
    return Map(across, down, [[rate_of(cell) for cell in line] for line in cells])


def by_axis(rows: Sequence[Row], axis: AxisCfg) -> tuple[Binning, list[list[Row]]]:
    """Rows by the cells of one axis."""
    cut = binning(axis)
    groups: list[list[Row]] = [[] for _ in cut.ticks]
    for row in rows:
        groups[_place(row, cut)].append(row)
    return cut, groups


def _place(row: Row, cut: Binning) -> int:
    value = row[cut.name]
    if value is None:
        raise ValueError(f"episode {row['episode']} has no {cut.name}")
    return cut.place(value)


def _text(value: AxisValue) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
