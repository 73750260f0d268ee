"""`auvdock reproduce models`: how large the papers' networks are, beside ours."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import counting_progress, output
from auvdock.cli.parsing import parse
from auvdock.experiments.network_sizes import NOTES, PUBLISHED, TOLERANCE, Published, SizeResult, compare_sizes

__all__ = ["Models", "run_models"]

_CONVENTION = (
    "640 × 640 px; normalisations folded into convolutions; all convolutions and matrix products, "
    "2 operations for each multiply and add"
)


@dataclass(frozen=True)
class Models:
    """Parameters and operations of the papers' networks and ablation rows beside ours; needs auvdock[train].

    Exit code: 0 if all rows of paper A that we have, and paper C's YOLOv11n, BiFPN and AKConv rows, are within 2 % or
    give the printed figure when rounded; 1 if not.
    """

    json: bool = False
    """Print one JSON object and nothing else."""


def run_models(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Models, argv, prog)
    with counting_progress() as progress:
        task = progress.add_task("rows", total=len(PUBLISHED))
        rows = compare_sizes(lambda: progress.advance(task))
    required = [row for row in rows if isinstance(row, SizeResult) and row.published.required]
    met = sum(row.met for row in required)
    if args.json:
        plain = [_plain(row) for row in rows]
        summary = {"tolerance": TOLERANCE, "required": len(required), "met": met, "convention": _CONVENTION}
        print(json.dumps({**summary, "rows": plain}, allow_nan=False))
    else:
        _print(rows)
        output().print(f"{met} of {len(required)} rows with a target (●) met; {_CONVENTION}", highlight=False)
    return exit_codes.DONE if met == len(required) else exit_codes.NOT_MET


def _plain(row: SizeResult | Published) -> dict[str, Any]:
    published = row.published if isinstance(row, SizeResult) else row
    plain = asdict(published)
    for name in ("size", "gflops"):
        printed = plain.pop(name)
        plain[f"paper_{name}"] = None if printed is None else float(printed)
    plain["notes"] = [NOTES[note] for note in published.notes]
    if isinstance(row, SizeResult):
        ours = asdict(row)
        ours.pop("published")
        plain |= ours
    return plain


def _print(rows: Sequence[SizeResult | Published]) -> None:
    numbers = {note: str(index) for index, note in enumerate(NOTES, 1)}
    console = output()
    for paper, what in (("A", "conical, tables 7 and 8"), ("B", "rotating, table 4"), ("C", "landing, tables 4 and 5")):
        table = Table(title=f"paper {paper}, {what}", title_justify="left")
        for name in ("", "row", "size", "ours", "%", "GFLOPs", "ours", "%", "note"):
            table.add_column(name, justify="left" if name in ("", "row", "note") else "right")
        for row in rows:
            published = row.published if isinstance(row, SizeResult) else row
            if published.paper == paper:
                mark = "●" if published.required else ""
                notes = ", ".join(numbers[note] for note in published.notes)
                table.add_row(mark, f"{published.table}  {published.row}", *_figures(row), notes)
        console.print(table)
    for note, number in numbers.items():
        console.print(f"{number:>2}  {NOTES[note]}", highlight=False)


def _figures(row: SizeResult | Published) -> list[str]:
    published = row.published if isinstance(row, SizeResult) else row
    size, gflops = f"{published.size} {published.unit}", published.gflops or ""
    if not isinstance(row, SizeResult):
        return [size, "", "", gflops, "", ""]
    size_off = _percent(row.size_difference)
    return [size, f"{row.size:.3f}", size_off, gflops, f"{row.gflops:.2f}", _percent(row.gflops_difference)]


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:+.1f}"
