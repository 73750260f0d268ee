"""What a person sees while a campaign runs."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import BarColumn, Progress

from auvdock.campaign.campaign import Tally
from auvdock.campaign.row import Row
from auvdock.cli.console import description, live

__all__ = ["SweepProgress"]

PLAIN_EVERY_S = 10.0
"""Time between lines where the output is no terminal."""


class SweepProgress:
    """A live bar on a terminal, a plain line now and then elsewhere, nothing if quiet."""

    def __init__(self, console: Console, workers: int, quiet: bool) -> None:
        """Prepare."""
        self._console = console
        self._workers = workers
        self._quiet = quiet
        self._progress: Progress | None = None
        self._planned = 0
        self._before = 0
        self._started = 0.0
        self._next_plain = 0.0

    def on_start(self, planned: int, tally: Tally) -> None:
        """Show what is ahead."""
        self._planned, self._before, self._started = planned, tally.episodes, time.monotonic()
        self._next_plain = self._started + PLAIN_EVERY_S
        if self._quiet:
            return
        there = f", {tally.episodes} there already" if tally.episodes else ""
        plural = "" if self._workers == 1 else "s"
        self._console.print(f"auvdock: {planned} episodes{there}, {self._workers} worker{plural}", highlight=False)
        if self._console.is_terminal:
            self._progress = live(self._console, BarColumn(30), description())
            self._progress.add_task(
                "starting; a new installation first compiles, up to a minute", total=planned, completed=tally.episodes
            )
            self._progress.start()

    def on_row(self, row: Row, tally: Tally) -> None:
        """Update."""
        if self._progress is not None:
            task = self._progress.task_ids[0]
            self._progress.update(task, completed=tally.episodes, description=self._line(tally))
        elif not self._quiet and (time.monotonic() >= self._next_plain or tally.episodes == self._planned):
            self._next_plain = time.monotonic() + PLAIN_EVERY_S
            self._console.print(self._line(tally), highlight=False, soft_wrap=True)

    def close(self) -> None:
        """Take the bar away."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None

    def _line(self, tally: Tally) -> str:
        elapsed = max(1e-9, time.monotonic() - self._started)
        rate = (tally.episodes - self._before) / elapsed
        left = _clock((self._planned - tally.episodes) / rate) if rate > 0.0 else "?"
        found = tally.rate
        success = f"success {100.0 * (found.rate or 0.0):.1f} % [{100.0 * found.low:.1f}, {100.0 * found.high:.1f}]"
        return f"{tally.episodes}/{self._planned} episodes  {rate:.2f}/s  {left} left  {success}"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
