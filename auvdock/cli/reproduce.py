"""`auvdock reproduce NAME`: a published table beside ours."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import parse
from auvdock.cli.saving import Saving
from auvdock.core.errors import ConfigError
from auvdock.experiments.guidance_space import (
    CELLS,
    TOLERANCE_M3,
    CellResult,
    ReadingResult,
    reproduce,
    task_count,
)
from auvdock.experiments.guidance_space_check import check_grid, check_region, draw_agreement
from auvdock.optics.water import load_water
from auvdock.planning.pictures import make_folder

__all__ = ["GuidanceRegion", "GuidanceSpace", "run_guidance_region", "run_guidance_space"]


@dataclass(frozen=True)
class GuidanceSpace:
    """Paper A's tables 4 and 5 (size of the precise-guidance space) beside ours.

    Exit code: 0 if every cell agrees within 0.1 m³, 1 if not.
    """

    json: bool = False
    """Print one JSON object and nothing else."""
    workers: int | None = None
    """Processes; by default one per core."""


def run_guidance_space(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(GuidanceSpace, argv, prog)
    if args.workers is not None and args.workers < 1:
        raise ConfigError("workers", args.workers, "1 or more")
    with counting_progress() as progress:
        task = progress.add_task("cells and readings", total=task_count())
        report = reproduce(lambda: progress.advance(task), args.workers)
    if args.json:
        print(json.dumps(_plain(report.cells, report.readings, report.within), allow_nan=False))
    else:
        _print(report.cells, report.readings, report.within)
    return 0 if report.within == len(CELLS) else 1


def _plain(cells: Sequence[CellResult], readings: Sequence[ReadingResult], within: int) -> dict[str, Any]:
    rows: list[dict[str, Any]] = []
    for result in cells:
        row = asdict(result)
        cell = row.pop("cell")
        rows.append({**cell, **row})
    return {
        "tolerance_m3": TOLERANCE_M3,
        "cells": rows,
        "cells_within": within,
        "cells_total": len(cells),
        "max_difference_m3": max(abs(result.difference_m3) for result in cells),
        "readings": [asdict(reading) for reading in readings],
    }


def _print(cells: Sequence[CellResult], readings: Sequence[ReadingResult], within: int) -> None:
    console = output()
    for number, title in ((4, "table 4: lights and beam angle"), (5, "table 5: six lights of 45°, inward tilt")):
        table = Table(title=f"paper A, {title}; volumes in m³", title_justify="left")
        for name in ("angle °", "lights", "tilt °", "paper", "ours", "difference", "fine hull", "converged", "voxels"):
            table.add_column(name, justify="right")
        for result in cells:
            cell = result.cell
            if cell.table == number:
                figures = (result.ours_m3, result.difference_m3, result.fine_hull_m3, result.converged_hull_m3)
                table.add_row(
                    f"{cell.angle_deg:g}",
                    str(cell.count),
                    f"{cell.inward_tilt_deg:+g}",
                    f"{cell.paper_m3:.1f}",
                    f"{figures[0]:.2f}",
                    f"{figures[1]:+.3f}",
                    *(f"{value:.1f}" for value in (*figures[2:], result.fine_voxel_m3)),
                )
        console.print(table)
    table = Table(title="what other readings of the paper would have given", title_justify="left")
    for name in ("reading", "table 4 rms", "table 5 rms", "greatest m³", "cells within", "best tilt", "gain"):
        table.add_column(name, justify="left" if name == "reading" else "right")
    for reading in readings:
        table.add_row(
            reading.name,
            f"{reading.table_4_rms:.4f}",
            f"{reading.table_5_rms:.4f}",
            f"{reading.max_difference_m3:.2f}",
            f"{reading.cells_within}/{len(cells)}",
            f"{reading.best_tilt_deg:+g}°",
            f"{reading.gain:.3f}",
        )
    console.print(table)
    console.print(f"{within} of {len(cells)} cells within {TOLERANCE_M3:g} m³ of the paper's")


@dataclass(frozen=True)
class GuidanceRegion:
    """The planned guidance space beside the one in which the pixel pipeline really finds four beacons.

    Renders a few frames at each place of a grid and runs detector and authentication on them; needs OpenGL.
    Exit code: 0 if intersection over union is 0.8 or more in every water, 1 if not.
    """

    waters: tuple[str, ...] = ("pool", "lake")
    """Water presets."""
    steps: tuple[float, ...] = (2.2, 1.4)
    """Grid step in m for each water."""
    out: Path | None = None
    """Folder for a picture of each water: guidance_region_WATER.png."""
    workers: int | None = None
    """Processes; by default one per core."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_guidance_region(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(GuidanceRegion, argv, prog)
    if len(args.steps) != len(args.waters) or not all(0.2 <= step <= 20.0 for step in args.steps):
        raise ConfigError("steps", args.steps, "one grid step of 0.2 to 20 m for each water")
    if args.workers is not None and args.workers < 1:
        raise ConfigError("workers", args.workers, "1 or more")
    for water in args.waters:
        load_water(water)
    if args.out is not None:
        make_folder(args.out)
    rows: list[dict[str, Any]] = []
    saving = Saving()
    with counting_progress() as progress:
        for water, step_m in zip(args.waters, args.steps, strict=True):
            grid = check_grid(water, step_m)
            task = progress.add_task(f"poses in {water}", total=len(grid[0]))
            agreement = check_region(water, step_m, lambda done: progress.advance(task, done), args.workers, grid)  # noqa: B023
            picture = None
            if args.out is not None:
                picture = args.out / f"guidance_region_{water}.png"
                saving.attempt(picture, lambda path: draw_agreement(path, agreement))  # noqa: B023 - called at once
            rows.append(
                {
                    "water": water,
                    "step_m": step_m,
                    "places": len(agreement.places_m),
                    "planned": int(agreement.planned.sum()),
                    "seen": int(agreement.seen.sum()),
                    "intersection_over_union": agreement.intersection_over_union,
                    "picture": str(picture) if str(picture) in saving.written else None,
                }
            )
    good = all(row["intersection_over_union"] >= 0.8 for row in rows)
    if args.json:
        print(json.dumps({"waters": rows, "target": 0.8}, allow_nan=False))
        return saving.finish(exit_codes.DONE if good else exit_codes.NOT_MET)
    table = Table(title="planned region against rendered frames", title_justify="left")
    for name in ("water", "places", "planned", "seen", "intersection over union"):
        table.add_column(name, justify="left" if name == "water" else "right")
    for row in rows:
        ratio = row["intersection_over_union"]
        table.add_row(row["water"], str(row["places"]), str(row["planned"]), str(row["seen"]), f"{ratio:.3f}")
    output().print(table)
    return saving.finish(exit_codes.DONE if good else exit_codes.NOT_MET)
