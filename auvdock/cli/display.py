"""What a person sees while an episode runs and when it is over."""

from __future__ import annotations

import math
from pathlib import Path

from rich.progress import BarColumn, Progress, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from auvdock.cli.console import command_line, description, live, messages, output
from auvdock.episode.result import EpisodeResult
from auvdock.episode.stations import STATIONS, result_lines
from auvdock.episode.trace import EpisodeSetup
from auvdock.metrics.tick import Tick

__all__ = ["ProgressDisplay", "print_result"]

PLAIN_EVERY_S = 10.0
"""Simulated time between progress lines where the output is no terminal."""


class ProgressDisplay:
    """A live line: distance made good, mode, range, speed. Plain lines where standard error is no terminal."""

    def __init__(self) -> None:
        """Prepare; nothing is shown before the episode starts."""
        self._console = messages()
        self._inside_m = 0.0
        self._progress: Progress | None = None
        self._start_range_m: float | None = None
        self._next_plain_s = 0.0
        self._around = False

    def on_start(self, setup: EpisodeSetup) -> None:
        """Show the title."""
        self._around, self._inside_m = STATIONS[setup.kind].all_around, setup.station.inside_m
        line = f"auvdock: {setup.title}, water {setup.water}, detector {setup.detector}"
        self._console.print(line, soft_wrap=True)
        if self._console.is_terminal:
            self._progress = live(self._console, description(), BarColumn(40), TimeElapsedColumn())
            self._progress.add_task("starting", total=1.0)
            self._progress.start()

    def on_tick(self, tick: Tick) -> None:
        """Update the line."""
        range_m = tick.truth.range_m if self._around and tick.truth.range_m > 3.0 else tick.truth.to_go_m
        if self._start_range_m is None:
            self._start_range_m = range_m
        speed_m_s = math.hypot(*(float(part) for part in tick.truth.nu_body[:3]))
        line = f"t {tick.truth.time_s:5.1f} s  {tick.command.mode:8s} range {range_m:5.1f} m  {speed_m_s:4.2f} m/s"
        if self._progress is not None:
            done = 1.0 - max(0.0, range_m + self._inside_m) / (self._start_range_m + self._inside_m)
            self._progress.update(self._progress.task_ids[0], description=line, completed=max(0.0, done))
        elif tick.truth.time_s >= self._next_plain_s:
            self._next_plain_s += PLAIN_EVERY_S
            self._console.print(line, highlight=False)

    def on_end(self, result: EpisodeResult) -> None:
        """Nothing: the table comes last."""

    def close(self) -> None:
        """Take the live line away."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None


def print_result(result: EpisodeResult, station: str, record: Path | None) -> None:
    """The result as a table on standard output.

    Args:
        result: the result.
        station: key of `auvdock.episode.stations.STATIONS`.
        record: its recording, if there is one.
    """
    console = output()
    table = Table(title=f"{STATIONS[station].docking}, seed {result.seed}", title_justify="left")
    table.add_column("metric")
    table.add_column("value", justify="right")
    verdict = Text("docked", "green") if result.success else Text(f"failed: {result.failure_reason}", "red")
    table.add_row("outcome", verdict)
    for line in result_lines(station, result):
        table.add_row(line.name, line.text)
    table.add_row("wall-clock time", f"{result.wall_s:.1f} s")
    table.add_row("real-time factor", f"{result.real_time_factor:.1f} x")
    console.print(table)
    if record is not None:
        view = command_line("auvdock", "view", record)
        console.print(f"recording: {record}   ({view})", highlight=False, soft_wrap=True)
