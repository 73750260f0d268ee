"""`auvdock reproduce landing-trials`: paper C's ten landings beside ours."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import parse
from auvdock.cli.saving import Saving
from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.envs.config import FIDELITIES
from auvdock.experiments.landing_ranges import Comparison, RangeCell, compare, range_cells
from auvdock.experiments.landing_trials import (
    PAPER,
    LandingTrial,
    TrialSummary,
    fly_trials,
    summarise,
    trial_cfg,
)
from auvdock.experiments.landing_trials_pictures import draw_curves_16, draw_paths_15, draw_ranges
from auvdock.optics.water import load_water
from auvdock.perception.landing.config import LEVELS
from auvdock.planning.pictures import make_folder

__all__ = ["LandingTrials", "run_landing_trials"]


@dataclass(frozen=True)
class LandingTrials:
    """Paper C's ten landings (figures 15 and 16) beside ours, flown by both levels, by the lights and by the tag alone.

    Exit code: 0 if the fused flights reach the paper's success rate with position within 20 mm and heading within 3° in
    95 % of the frames after alignment, 1 if not.
    """

    fidelity: str = "beacons"
    """"pixels" (renders every frame; minutes) or "beacons"."""
    trials: int = 10
    """Flights of each kind; the paper's ten by default."""
    seed: int = 0
    """Seed of the first; the others follow by ones."""
    levels: tuple[str, ...] = LEVELS
    """By what to fly: "both", "lights", "tag"."""
    water: str = "clear"
    """Water preset."""
    out: Path | None = None
    """Folder for the pictures and trials.json with all curves."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_landing_trials(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(LandingTrials, argv, prog)
    _check(args)
    if args.out is not None:
        make_folder(args.out)
    cfg = trial_cfg(args.fidelity, {"world": {"water": args.water}})
    seeds = range(args.seed, args.seed + args.trials)
    with counting_progress() as progress:
        task = progress.add_task("landings", total=args.trials * len(args.levels))
        trials = fly_trials(cfg, seeds, args.levels, lambda: progress.advance(task))
    summaries = [summarise(trials, name) for name in args.levels]
    cells, comparisons = range_cells(trials), compare(trials)
    report = _report(args, summaries, cells, comparisons)
    saving = Saving()
    if args.out is not None:
        _write(args.out, args, trials, cells, report, saving)
    if args.json:
        print(json.dumps(report, allow_nan=False))
    else:
        _print(summaries, cells, comparisons)
    good = all(_good(summary) for summary in summaries if summary.levels == "both")
    return saving.finish(exit_codes.DONE if good else exit_codes.NOT_MET)


def _check(args: LandingTrials) -> None:
    if args.fidelity not in FIDELITIES:
        raise ConfigError("fidelity", args.fidelity, f"one of {', '.join(FIDELITIES)}")
    if args.trials < 1:
        raise ConfigError("trials", args.trials, "1 or more")
    if args.seed < 0:
        raise ConfigError("seed", args.seed, "0 or more")
    if not args.levels or not set(args.levels) <= set(LEVELS):
        raise ConfigError("levels", args.levels, f"some of {', '.join(LEVELS)}")
    load_water(args.water)


def _good(summary: TrialSummary) -> bool:
    rate = summary.docked.rate
    within = summary.within_paper
    return rate is not None and rate >= PAPER["success"] and within is not None and within >= 0.95


def _report(
    args: LandingTrials,
    summaries: Sequence[TrialSummary],
    cells: Sequence[RangeCell],
    comparisons: Sequence[Comparison],
) -> dict[str, Any]:
    return {
        "fidelity": args.fidelity,
        "water": args.water,
        "seeds": [args.seed, args.seed + args.trials - 1],
        "paper": dict(PAPER),
        "ours": [asdict(summary) for summary in summaries],
        "ranges": [asdict(cell) for cell in cells],
        "fused_against_better": [asdict(comparison) for comparison in comparisons],
        "fused_worse_in": [asdict(comparison) for comparison in comparisons if comparison.worse],
    }


def _write(
    out: Path,
    args: LandingTrials,
    trials: Sequence[LandingTrial],
    cells: Sequence[RangeCell],
    report: dict[str, Any],
    saving: Saving,
) -> None:
    shown = [trial for trial in trials if trial.levels == args.levels[0]][: int(PAPER["shown"])]
    saving.attempt(out / "landing_paths.png", lambda path: draw_paths_15(path, shown))
    saving.attempt(out / "landing_curves.png", lambda path: draw_curves_16(path, shown))
    title = f"Error against range: {args.fidelity}, water {args.water}, {len(trials)} flights"
    saving.attempt(out / "landing_ranges.png", lambda path: draw_ranges(path, cells, title))
    curves = [
        {
            "seed": trial.seed,
            "levels": trial.levels,
            "success": trial.result.success,
            "failure_reason": trial.result.failure_reason,
            "time_s": _numbers(trial.time_s),
            "true_xi_eta_zeta_m_psi_rad": [_numbers(row) for row in trial.true],
            "estimated_xi_eta_zeta_m_psi_rad": [_numbers(row) for row in trial.estimated],
        }
        for trial in trials
    ]
    saving.text(out / "trials.json", json.dumps({**report, "flights": curves}, allow_nan=False))


def _numbers(values: Array) -> list[float | None]:
    """Rounded to a hundredth of a millimetre; None for what is not there."""
    return [None if math.isnan(value) else round(value, 5) for value in np.asarray(values).tolist()]


def _print(summaries: Sequence[TrialSummary], cells: Sequence[RangeCell], comparisons: Sequence[Comparison]) -> None:
    console = output()
    table = Table(title="paper C's landing trials; estimate against truth after alignment", title_justify="left")
    names = (
        "flown by",
        "docked",
        "95 %",
        "≤20 mm, 3°",
        "≤10 mm, 1°",
        "p95 mm",
        "p95 °",
        "final mm",
        "final °",
        "failures",
    )
    for name in names:
        table.add_column(name, justify="left" if name in ("flown by", "failures") else "right")
    table.add_row("paper C", "about 90 %", "", "all", "", "20", "3", "", "", "current")
    for summary in summaries:
        docked = summary.docked
        table.add_row(
            summary.levels,
            f"{docked.successes}/{docked.episodes}",
            f"{100 * docked.low:.0f}-{100 * docked.high:.0f} %",
            *(_percent(value) for value in (summary.within_paper, summary.within_target)),
            _figure(summary.position_p95_m, 1000.0),
            _figure(summary.heading_p95_deg),
            _figure(summary.final_position_m, 1000.0),
            _figure(summary.final_heading_deg),
            ", ".join(f"{seed}: {reason}" for seed, reason in summary.failures.items()),
        )
    console.print(table)
    table = Table(title="rms error (mm, °) and share of frames measured, by height over the tag", title_justify="left")
    for name in ("height m", "frames", *(f"{level} {unit}" for level in LEVELS for unit in ("mm", "°", "%"))):
        table.add_column(name, justify="right")
    for low, high in dict.fromkeys((cell.low_m, cell.high_m) for cell in cells):
        row = {cell.levels: cell for cell in cells if cell.low_m == low}
        values: list[str] = []
        for level in LEVELS:
            cell = row[level]
            values += [_figure(cell.position_m, 1000.0), _figure(cell.heading_deg, 1.0, 3), _percent(cell.measured)]
        table.add_row(f"{low:g}-{high:g}", str(row["both"].frames), *values)
    console.print(table)
    worse = [comparison for comparison in comparisons if comparison.worse]
    if not worse:
        console.print(f"fused is in none of {len(comparisons)} bins worse than the better level (95 %)")
    for comparison in worse:
        console.print(
            f"fused is worse than {comparison.better} in {comparison.quantity} at {comparison.low_m:g}-"
            f"{comparison.high_m:g} m: {comparison.fused:.3g} against {comparison.single:.3g}"
        )


def _figure(value: float | None, scale: float = 1.0, digits: int = 2) -> str:
    return "" if value is None else f"{scale * value:.{digits}f}"


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.1f}"
