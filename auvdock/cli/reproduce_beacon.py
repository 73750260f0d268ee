"""`auvdock reproduce azimuth` and `auvdock reproduce deviation`: paper B's tables 5 and 6 beside ours."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import parse
from auvdock.cli.saving import Saving
from auvdock.core.errors import ConfigError
from auvdock.experiments.kept import Kept
from auvdock.experiments.rotating_limits import SHARE_TURNS, Limit, Sight, flash_sights, limits
from auvdock.experiments.rotating_rig import X_M, Y_M
from auvdock.experiments.rotating_tables import (
    PAPER_AZIMUTH_DEG,
    PAPER_DEVIATION_DEG,
    PLACES,
    REFERENCE,
    Mean,
    ScenarioRow,
    mean_error,
    paper_mean,
    run_videos,
    scenario_rows,
)
from auvdock.experiments.rotating_tables_picture import draw_errors
from auvdock.experiments.rotating_watch import SCENARIOS, Watch
from auvdock.planning.pictures import make_folder

__all__ = ["Azimuth", "Deviation", "run_azimuth", "run_deviation"]

AZIMUTH_TARGET_DEG = 1.0
DEVIATION_TARGET_DEG = 0.3


@dataclass(frozen=True)
class Azimuth:
    """Paper B's table 5, azimuth from the time of the beam's passing, beside its method in our water and ours.

    Exit code: 0 if our mean absolute error is 1.0° or less over the places where the paper has a figure, 1 if not.
    """

    fidelity: Literal["pixels", "beacons"] = "pixels"
    """pixels renders 1920 x 1080 frames; beacons draws detections without an image, on which the paper's method has
    nothing to go by."""
    videos: int = 2
    """Videos of each of the 56 places, each at another phase of beacon and camera."""
    turns: int = 4
    """Turns of the beacon in each; the first two only identify it."""
    workers: int = 1
    """Processes."""
    out: Path | None = None
    """Folder for a plot, every video's errors, and watches.jsonl, from which a run that was stopped goes on and which
    both tables read: the second needs no video of its own."""
    json: bool = False
    """Print one JSON object and nothing else."""


@dataclass(frozen=True)
class Deviation(Azimuth):
    """Paper B's table 6, the horizontal deviation angle, beside its equation 6 in our camera and our rays.

    Exit code: 0 if our mean absolute error is 0.3° or less over the places where the paper has a figure, 1 if not.
    """


@dataclass(frozen=True)
class _Kind:
    name: str
    title: str
    paper: dict[tuple[float, bool], tuple[float | None, ...]]
    ours: Callable[[Watch], Sequence[float]]
    paper_method: Callable[[Watch], Sequence[float]]
    target_deg: float


_AZIMUTH = _Kind(
    "azimuth",
    "table 5: azimuth",
    PAPER_AZIMUTH_DEG,
    lambda watch: watch.ours_deg,
    lambda watch: watch.paper_deg,
    AZIMUTH_TARGET_DEG,
)
_DEVIATION = _Kind(
    "deviation",
    "table 6: horizontal deviation angle",
    PAPER_DEVIATION_DEG,
    lambda watch: watch.ours_deviation_deg,
    lambda watch: watch.paper_deviation_deg,
    DEVIATION_TARGET_DEG,
)


def run_azimuth(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    return _run(parse(Azimuth, argv, prog), _AZIMUTH)


def run_deviation(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    return _run(parse(Deviation, argv, prog), _DEVIATION)


def _run(args: Azimuth, kind: _Kind) -> int:
    for name, least in (("videos", 1), ("turns", 3), ("workers", 1)):
        if getattr(args, name) < least:
            raise ConfigError(name, getattr(args, name), f"{least} or more")
    if args.out is not None:
        make_folder(args.out)
    cv2.setNumThreads(1)
    with_scenarios = kind is _AZIMUTH
    scenario_videos = max(args.videos, 4)
    with_images = args.fidelity == "pixels"
    count = len(PLACES) * args.videos + (len(SCENARIOS) * scenario_videos if with_scenarios else 0)
    count += 2 * len(X_M) if with_images else 0
    scenarios: list[ScenarioRow] = []
    sights: list[Sight] = []
    kept = Kept(None if args.out is None else args.out / "watches.jsonl")
    with counting_progress() as progress:
        task = progress.add_task("videos", total=count)
        shared = (args.turns, args.fidelity, args.workers, lambda: progress.advance(task))
        watches = run_videos(PLACES, args.videos, *shared, kept=kept)
        if with_scenarios:
            scenarios = scenario_rows(scenario_videos, *shared, kept=kept)
        if with_images:
            sights = flash_sights(args.workers, lambda: progress.advance(task), kept)
    kept.close()
    farthest = limits(watches, sights)
    report = _report(args, kind, watches, scenarios)
    report["limits"] = [asdict(limit) for limit in farthest]
    report["git_revisions"] = sorted(str(revision) for revision in kept.revisions)
    saving = Saving()
    if args.out is not None:
        picture = args.out / f"{kind.name}.png"
        saving.attempt(
            picture, lambda path: draw_errors(path, kind.title, kind.paper, watches, kind.ours, kind.paper_method)
        )
        report["picture"] = str(picture) if saving.written else None
        text = json.dumps({**report, "videos": [asdict(watch) for watch in watches]}, allow_nan=False, indent=1)
        saving.text(args.out / f"{kind.name}.json", text)
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        _print(kind, report, farthest, scenarios)
    return saving.finish(exit_codes.DONE if report["within_target"] else exit_codes.NOT_MET)


def _report(args: Azimuth, kind: _Kind, watches: Sequence[Watch], scenarios: Sequence[ScenarioRow]) -> dict[str, Any]:
    """Everything that is printed, as plain data."""
    shown = [w for w in watches if kind.paper[w.place.x_m, w.place.day][Y_M.index(w.place.y_m)] is not None]
    ours = mean_error(kind.ours(w) for w in shown)
    bounds = [w.bound_deg for w in shown if w.bound_deg is not None]
    report: dict[str, Any] = {
        "table": kind.name,
        "fidelity": args.fidelity,
        "videos_per_place": args.videos,
        "turns": args.turns,
        "paper_mean_deg": paper_mean(kind.paper),
        "ours": asdict(ours),
        "paper_method": asdict(mean_error(kind.paper_method(w) for w in shown)),
        "target_deg": kind.target_deg,
        "within_target": ours.value is not None and ours.value <= kind.target_deg,
        "places_without_ours": sum(1 for group in _by_place(shown) if not any(kind.ours(w) for w in group)),
        "cells": [_cell(kind, group) for group in _by_place(watches)],
        "detections_per_pass": [w.run for w in watches],
    }
    if kind is _AZIMUTH:
        report["fused"] = asdict(mean_error([w.fused_deg] for w in shown if w.fused_deg is not None))
        turns = max(sum(w.turns for w in shown), 1)
        report["printed_minimum_answers_share"] = (
            sum(w.printed for w in shown) / turns if args.fidelity == "pixels" else None
        )
        report["bound_rms_deg"] = float(np.sqrt(np.mean(np.square(bounds)))) if bounds else None
        errors = [error for w in shown for error in w.ours_deg]
        report["ours_rms_deg"] = float(np.sqrt(np.mean(np.square(errors)))) if errors else None
        report["scenario_place"] = asdict(REFERENCE)
        report["scenarios"] = [asdict(row) for row in scenarios]
    return report


def _by_place(watches: Sequence[Watch]) -> list[list[Watch]]:
    groups: dict[object, list[Watch]] = {}
    for w in watches:
        groups.setdefault(w.place, []).append(w)
    return list(groups.values())


def _cell(kind: _Kind, group: Sequence[Watch]) -> dict[str, Any]:
    place = group[0].place
    paper = kind.paper[place.x_m, place.day][Y_M.index(place.y_m)]
    ours = mean_error(kind.ours(w) for w in group)
    return {
        **asdict(place),
        "paper_deg": paper,
        "paper_method": asdict(mean_error(kind.paper_method(w) for w in group)),
        "ours": asdict(ours),
        "difference_deg": ours.value - paper if ours.value is not None and paper is not None else None,
        "seeds": [w.seed for w in group],
    }


def _print(kind: _Kind, report: dict[str, Any], farthest: Sequence[Limit], scenarios: Sequence[ScenarioRow]) -> None:
    console = output()
    table = Table(
        title=f"paper B, {kind.title}; mean |error| in °: paper / its method here / ours", title_justify="left"
    )
    table.add_column("X")
    for y_m in Y_M:
        table.add_column(f"{y_m:g} m", justify="right")
    cells = {(c["x_m"], c["day"], c["y_m"]): c for c in report["cells"]}
    for x_m in X_M:
        for day in (True, False):
            texts = [_cell_text(cells[x_m, day, y_m]) for y_m in Y_M]
            table.add_row(f"{x_m:+g} m {'day' if day else 'night'}", *texts)
    console.print(table)
    for title, mean in (("ours", report["ours"]), ("paper's method here", report["paper_method"])):
        console.print(f"{title}: {_mean_text(Mean(**mean))}, over the places where the paper has a figure")
    if report["fidelity"] == "pixels":
        console.print("calibrated: its weight of the area on table 5's mean, the camera's gain on the limits by night")
    console.print(f"paper: {report['paper_mean_deg']:.2f}° (mean over 20 to 45 m); target {kind.target_deg:g}°")
    if report["places_without_ours"]:
        console.print(f"places where the paper has a figure and ours none: {report['places_without_ours']}")
    if kind is _AZIMUTH:
        console.print(f"ours, turns of a video fused: {_mean_text(Mean(**report['fused']))}")
        share = report["printed_minimum_answers_share"]
        if share is not None:
            console.print(f"passes with five detections, as algorithm 2 asks: {share:.0%}")
        if report["bound_rms_deg"] is not None and report["ours_rms_deg"] is not None:
            rms, bound = report["ours_rms_deg"], report["bound_rms_deg"]
            console.print(f"rms {rms:.3f}°, Cramér–Rao bound {bound:.3f}° (photon and read noise alone)")
    _print_limits(console, farthest)
    if scenarios:
        _print_scenarios(console, scenarios)


def _print_limits(console: Console, rows: Sequence[Limit]) -> None:
    table = Table(title="farthest Y at which the beacon is seen, m", title_justify="left")
    for name in ("X", "paper", "flash found", f"turns at {Y_M[-1]:g} m", "its method here", "ours"):
        table.add_column(name, justify="left" if name == "X" else "right")
    for row in rows:
        title = f"{row.x_m:+g} m {'day' if row.day else 'night'}"
        shares = f"{row.shares[0][1]:.0%}" if row.shares else "-"
        found, by_paper, ours = (f"{y_m:g}" if y_m else "-" for y_m in (row.found_m, row.paper_method_m, row.ours_m))
        table.add_row(title, f"{row.paper_m:g}", found, shares, by_paper, ours)
    console.print(table)
    console.print(
        f"flash found in half of {SHARE_TURNS} turns; a method: half of the passes timed, in half of the videos"
    )


def _print_scenarios(console: Console, rows: Sequence[ScenarioRow]) -> None:
    table = Table(title=f"azimuth at X {REFERENCE.x_m:g}, Y {REFERENCE.y_m:g} m, night", title_justify="left")
    for name in ("scenario", "ours", "ours, signed", "fixes of passes", "paper's method"):
        table.add_column(name, justify="left" if name == "scenario" else "right")
    for row in rows:
        signed = "-" if row.ours_signed_deg is None else f"{row.ours_signed_deg:+.2f}°"
        table.add_row(row.name, _mean_text(row.ours), signed, f"{row.found_share:.0%}", _mean_text(row.paper_method))
    console.print(table)


def _cell_text(cell: dict[str, Any]) -> str:
    values = (cell["paper_deg"], cell["paper_method"]["value"], cell["ours"]["value"])
    return " / ".join("-" if value is None else f"{value:.2f}" for value in values)


def _mean_text(mean: Mean) -> str:
    if mean.value is None:
        return "-"
    interval = "" if mean.low is None else f" [{mean.low:.2f}, {mean.high:.2f}]"
    return f"{mean.value:.2f}°{interval} (n {mean.passes} in {mean.videos} videos)"
