"""`auvdock reproduce rotating-docking`: the rotating beacon's closed loop, with and without it, and its scenarios."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
from rich.table import Table

from auvdock.campaign.statistics import McNemar, Rate
from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import at_least, parse
from auvdock.cli.saving import Saving
from auvdock.experiments.kept import Kept
from auvdock.experiments.rotating_docking import (
    ARMS,
    ArmSummary,
    Flight,
    fly_arm,
    paired,
    pick_arms,
    summarise,
)
from auvdock.experiments.rotating_docking_picture import draw_tracks
from auvdock.planning.pictures import make_folder

__all__ = ["RotatingDocking", "run_rotating_docking"]

TARGETS = {"beacon": 0.95, "beacon-0.3": 0.90}
"""Least success rates of the task itself."""


@dataclass(frozen=True)
class RotatingDocking:
    """Docking by the rotating beacon from a ring of 20 to 45 m, beside the same starts with the fixed lamps alone.

    Exit code: 0 if it docks in 95 % of the episodes at 0.1 m/s and 90 % at 0.3 m/s, as far as these were flown, else 1.
    """

    episodes: int = 200
    """Episodes per arm, seeds 0 and on."""
    first_seed: int = 0
    """First seed."""
    arms: tuple[str, ...] = tuple(arm.name for arm in ARMS)
    """What to fly: beacon, beacon-0.3, fixed, clock, drops, false-light."""
    fidelity: Literal["beacons", "pixels"] = "beacons"
    """beacons draws detections without an image; pixels renders every frame."""
    workers: int = 1
    """Processes."""
    out: Path | None = None
    """Folder for rotating_docking.png, the tracks from above, rotating_docking.json, every episode, and flights.jsonl,
    from which a run that was stopped goes on."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run_rotating_docking(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(RotatingDocking, argv, prog)
    at_least(1, episodes=args.episodes, workers=args.workers)
    at_least(0, first_seed=args.first_seed)
    arms = pick_arms(args.arms)
    if args.out is not None:
        make_folder(args.out)
    cv2.setNumThreads(1)
    seeds = range(args.first_seed, args.first_seed + args.episodes)
    flown: dict[str, tuple[Flight, ...]] = {}
    kept = Kept(None if args.out is None else args.out / "flights.jsonl")
    saving = Saving()
    with counting_progress() as progress:
        for arm in arms:
            task = progress.add_task(arm.title, total=len(seeds))
            flown[arm.name] = fly_arm(
                arm,
                seeds,
                args.fidelity,
                args.workers,
                lambda: progress.advance(task),  # noqa: B023 - called within this turn of the loop only
                kept,
            )
            if args.out is not None:
                saving.text(args.out / "rotating_docking.json", _rows(flown))
    kept.close()
    summaries = [summarise(arm, flown[arm.name]) for arm in arms]
    tests = {}
    if "beacon" in flown:
        tests = {name: paired(flown["beacon"], flights) for name, flights in flown.items() if name != "beacon"}
    if args.out is not None:
        panels = [(arm, flown[arm.name]) for arm in arms if arm.name in ("beacon", "fixed")]
        drawn = panels or [(arms[0], flown[arms[0].name])]
        saving.attempt(args.out / "rotating_docking.png", lambda path: draw_tracks(path, drawn))
    met = {s.arm.name: (s.docked.rate or 0.0) >= TARGETS[s.arm.name] for s in summaries if s.arm.name in TARGETS}
    if args.json:
        print(json.dumps(_plain(args, summaries, tests, met, kept), allow_nan=False))
    else:
        _print(summaries, tests)
    return saving.finish(exit_codes.DONE if all(met.values()) else exit_codes.NOT_MET)


def _rows(flown: dict[str, tuple[Flight, ...]]) -> str:
    rows: dict[str, list[dict[str, Any]]] = {}
    for name, flights in flown.items():
        rows[name] = []
        for flight in flights:
            row = flight.result.to_json()
            del row["config"], row["versions"]  # of all the same; flights.jsonl has the versions
            rows[name].append(row)
    return json.dumps(rows, allow_nan=False)


def _plain(
    args: RotatingDocking,
    summaries: Sequence[ArmSummary],
    tests: dict[str, McNemar],
    met: dict[str, bool],
    kept: Kept,
) -> dict[str, Any]:
    arms: list[dict[str, Any]] = []
    for summary in summaries:
        row = asdict(summary)
        row["arm"] = summary.arm.name
        row["title"] = summary.arm.title
        arms.append(row)
    return {
        "first_seed": args.first_seed,
        "episodes": args.episodes,
        "fidelity": args.fidelity,
        "git_revisions": sorted(str(revision) for revision in kept.revisions),
        "targets": TARGETS,
        "met": met,
        "arms": arms,
        "paired_with_beacon": {name: asdict(test) for name, test in tests.items()},
    }


def _print(summaries: Sequence[ArmSummary], tests: dict[str, McNemar]) -> None:
    console = output()
    # Two narrow tables: one of all columns is not legible in a terminal of 80.
    table = _table("docked; 95 % intervals after Wilson", ("arm", "of all", "began in front", "began behind"))
    for s in summaries:
        table.add_row(s.arm.title, _share(s.docked), _share(s.front), _share(s.behind))
    console.print(table)
    columns = ("arm", "found", "pose", "docked", "azimuth rms", "median", "hand-over")
    table = _table("median times; azimuth errors: all fixes, median episode, as the array took over", columns)
    for s in summaries:
        seconds = [_shown(value, "{:.0f} s") for value in (s.acquire_s, s.first_pose_s, s.time_s)]
        angles = [_shown(value, "{:.2f}°") for value in (s.azimuth_rms_deg, s.azimuth_median_deg, s.handover_deg)]
        table.add_row(s.arm.title, *seconds, *angles)
    console.print(table)
    for s in summaries:
        if s.failures:
            causes = ", ".join(f"{name} {count}" for name, count in sorted(s.failures.items()))
            console.print(f"{s.arm.title}: failed in {causes}", highlight=False)
    for name, test in tests.items():
        console.print(
            f"{name} against beacon, {test.pairs} pairs: difference {100 * test.difference:+.1f} "
            f"[{100 * test.low:+.1f}, {100 * test.high:+.1f}] points, McNemar p = {test.p_value:.2g}",
            highlight=False,
        )


def _table(title: str, columns: Sequence[str]) -> Table:
    table = Table(title=title, title_justify="left")
    for name in columns:
        table.add_column(name, justify="left" if name == "arm" else "right")
    return table


def _share(rate: Rate) -> str:
    return f"{rate.successes}/{rate.episodes} [{100 * rate.low:.0f}, {100 * rate.high:.0f}] %"


def _shown(value: float | None, form: str) -> str:
    return "-" if value is None else form.format(value)
