"""`auvdock report`: a campaign as one HTML file, with tables for a paper."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.text import Text

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.plan import Plan
from auvdock.campaign.report.cells import Campaign, load
from auvdock.campaign.report.compare import Comparison, compare
from auvdock.campaign.report.page import html_page, recording_path
from auvdock.campaign.report.tables import csv_table, latex_table
from auvdock.cli import exit_codes
from auvdock.cli.console import output
from auvdock.cli.parsing import parse
from auvdock.cli.recorded import run_recorded
from auvdock.cli.saving import Saving
from auvdock.core.errors import ConfigError
from auvdock.episode.result import LOST_REASONS
from auvdock.episode.runner import EpisodeRunner

__all__ = ["Report", "run"]


@dataclass(frozen=True)
class Report:
    """Write report.html, report.csv and report.tex into a campaign's folder.

    A campaign that still runs, or was stopped, is reported as far as it has come.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    """Folder that `auvdock sweep --out` wrote."""
    against: Path | None = None
    """Another campaign of the same seed and grid to compare with, pair by pair (McNemar's test)."""
    record_failures: int = 0
    """Fly this many failed episodes again first and record them, so that the page can link to the recordings."""
    json: bool = False
    """Print the figures as one JSON object and nothing else."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Report, argv, prog)
    if args.record_failures < 0:
        raise ConfigError("record-failures", args.record_failures, "a whole number of 0 or more")
    campaign = load(args.folder)
    if not campaign.rows:
        raise CampaignError(f"{args.folder}: no episode has finished yet; run sweep with --resume")
    comparison = compare(campaign, load(args.against)) if args.against else None
    saving = Saving()
    _record(campaign, args.record_failures, saving)
    page = args.folder / "report.html"
    try:
        tables = {page: html_page(campaign, comparison), page.with_suffix(".csv"): csv_table(campaign)}
        for path, text in {**tables, page.with_suffix(".tex"): latex_table(campaign)}.items():
            path.write_text(text, encoding="utf-8", errors="backslashreplace")  # a folder's name may be no text
    except OSError as error:
        raise CampaignError(f"{args.folder}: cannot be written ({error.strerror})") from error
    if args.json:
        print(json.dumps(_plain(campaign, comparison, page)))
    else:
        rate = campaign.rate
        console = output()
        shares = f"{100 * (rate.rate or 0.0):.1f} % [{100 * rate.low:.1f}, {100 * rate.high:.1f}]"
        console.print(f"success {shares} in {rate.episodes} episodes", highlight=False)
        if rate.lost:
            console.print(Text(f"{rate.lost} MORE WITHOUT RESULT: crashed or hung, in no rate", "red"))
        if comparison:
            test = comparison.test
            points = f"{100 * test.difference:+.1f} points, p = {test.p_value:.3g}"
            console.print(f"against {args.against}: {points}", soft_wrap=True)
        console.print(f"page: {page}\ntables: {page.with_suffix('.csv')}, {page.with_suffix('.tex')}", soft_wrap=True)
    return saving.finish(exit_codes.DONE)


def _record(campaign: Campaign, count: int, saving: Saving) -> None:
    """Recordings of the first failures, as far as they are not there."""
    failed = [int(row["episode"] or 0) for row in campaign.rows if row["success"] is not True and row["error"] is None]
    wanted = [number for number in failed[:count] if not recording_path(campaign.folder, number).exists()]
    plan = Plan(campaign.cfg)
    for number in wanted:
        spec = plan[number]
        path = recording_path(campaign.folder, number)
        # What is there, the next report takes for whole.
        run_recorded(EpisodeRunner(plan.config(spec)), spec.seed, path, saving, whole=True)


def _plain(campaign: Campaign, comparison: Comparison | None, page: Path) -> dict[str, object]:
    rate, causes = campaign.rate, Counter(row["failure_reason"] for row in campaign.rows)
    figures: dict[str, object] = {
        "report": str(page),
        "success_rate": rate.rate,
        "ci_low": rate.low,
        "ci_high": rate.high,
        "episodes": rate.episodes,
        "lost": {name: count for name, count in causes.items() if name in LOST_REASONS},
    }
    if comparison:
        test = comparison.test
        figures["comparison"] = {
            "pairs": test.pairs,
            "lost_pairs": comparison.lost,
            "only_first": test.only_first,
            "only_second": test.only_second,
            "difference": test.difference,
            "ci_low": test.low,
            "ci_high": test.high,
            "p_value": test.p_value,
        }
    return figures
