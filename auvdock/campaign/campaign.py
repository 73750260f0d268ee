"""Run a campaign: plan, executor and store together."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.errors import CampaignError
from auvdock.campaign.executor import Executor, peak_rss_mb
from auvdock.campaign.job import Job
from auvdock.campaign.plan import Plan
from auvdock.campaign.row import Row, Value, outcome
from auvdock.campaign.statistics import Rate, wilson
from auvdock.campaign.store import Store, read_table
from auvdock.episode.result import LOST_REASONS

__all__ = ["CampaignObserver", "CampaignSummary", "Tally", "run_campaign"]

ROUND_EPISODES = 100
"""With `until_ci`, episodes between two looks at the interval (or a whole grid, if that is more)."""
CELL_EPISODES = 20
"""With `until_ci_per_cell`, a cell's episodes between two looks at its interval."""
CRASHES = 10
"""If this many episodes have ended and all of them crashed, the campaign stops."""


@dataclass
class Tally:
    """Running counts."""

    episodes: int = 0
    successes: int = 0
    crashes: int = 0
    lost: int = 0
    """Crashed or hung."""

    def add(self, success: bool, reason: Value) -> None:
        """Count one episode by its success and failure reason."""
        self.episodes += 1
        self.successes += success
        self.crashes += reason == "crashed"
        self.lost += reason in LOST_REASONS

    @property
    def rate(self) -> Rate:
        """Success rate of those that left a result, with its Wilson 95 % interval."""
        return wilson(self.successes, self.episodes - self.lost, lost=self.lost)


class CampaignObserver(Protocol):
    """Watches a campaign."""

    def on_start(self, planned: int, tally: Tally) -> None:
        """Called once; `tally` holds what earlier sessions finished."""
        ...

    def on_row(self, row: Row, tally: Tally) -> None:
        """Called after each episode is stored."""
        ...

    def close(self) -> None:
        """Called once, however it ends."""
        ...


@dataclass(frozen=True)
class CampaignSummary:
    """A campaign's outcome.

    Attributes:
        rate: over all its episodes that left a result.
        failures: those of them that failed, by cause.
        lost: episodes without a result, by cause (`LOST_REASONS`).
        ran: episodes run by this call, the others were there.
        wall_s: wall-clock time of this call.
        peak_rss_mb: this process's peak memory plus each worker's own peak.
    """

    rate: Rate
    failures: dict[str, int]
    lost: dict[str, int]
    ran: int
    wall_s: float
    peak_rss_mb: float


def run_campaign(
    cfg: CampaignCfg, job: Job, store: Store, executor: Executor, observer: CampaignObserver
) -> CampaignSummary:
    """Run the episodes that the store lacks.

    With `until_ci` the campaign goes on in rounds and stops after the first round whose prefix of episodes has an
    interval narrow enough (the fixed-width sequential interval of Chow and Robbins 1965). Rounds end before the next
    one begins, so the episodes that are run do not depend on the number of workers. With `until_ci_per_cell` each cell
    of the grid stops by its own episodes alone, looked at after every `CELL_EPISODES` of them.

    Raises:
        CampaignError: the store cannot be written, workers do not start, or all first episodes crash.
        ConfigError: a configuration that some episode refuses.
    """
    started = time.perf_counter()
    plan = Plan(cfg)
    tally = Tally()
    outcomes: dict[int, bool | None] = {}
    for row in read_table(store.folder).select(["episode", "success", "failure_reason"]).to_pylist():
        outcomes[row["episode"]] = outcome(row)
        tally.add(row["success"], row["failure_reason"])
    ran = 0
    observer.on_start(len(plan), tally)
    try:
        for episodes in _rounds(plan, outcomes):
            pending = [episode for episode in episodes if episode not in outcomes]
            if not pending:
                continue
            if not ran:
                executor.start(job)
            for row in executor.run(plan[episode] for episode in pending):
                store.add(row)
                outcomes[int(row["episode"] or 0)] = outcome(row)
                tally.add(bool(row["success"]), row["failure_reason"])
                ran += 1
                observer.on_row(row, tally)
                if tally.crashes == tally.episodes == CRASHES:
                    raise CampaignError(f"all of the first {CRASHES} episodes crashed: {row['error']}")
    except BaseException:
        store.abandon()
        raise
    finally:
        executor.close()
        observer.close()
    store.close()
    reasons = Counter(read_table(store.folder).column("failure_reason").drop_null().to_pylist())
    return CampaignSummary(
        rate=tally.rate,
        failures={name: count for name, count in reasons.most_common() if name not in LOST_REASONS},
        lost={name: count for name, count in reasons.most_common() if name in LOST_REASONS},
        ran=ran,
        wall_s=time.perf_counter() - started,
        peak_rss_mb=peak_rss_mb() + executor.peak_rss_mb,
    )


def _rounds(plan: Plan, outcomes: dict[int, bool | None]) -> Iterator[Sequence[int]]:
    """Episodes by rounds, each to be finished before the next is asked for."""
    if not plan.cfg.until_ci:
        yield range(len(plan))
        return
    if plan.cfg.until_ci_per_cell:
        yield from _rounds_by_cell(plan, outcomes)
        return
    step = max(ROUND_EPISODES, plan.cells)
    for start in range(0, len(plan), step):
        end = min(start + step, len(plan))
        yield range(start, end)
        if _half_width([outcomes[episode] for episode in range(end)]) <= plan.cfg.until_ci:
            return


def _rounds_by_cell(plan: Plan, outcomes: dict[int, bool | None]) -> Iterator[Sequence[int]]:
    """Rounds in which every cell of the grid runs its next episodes until its own interval is narrow enough.

    Episode i lies in cell i mod (number of cells); a cell has its share of the plan's episodes, never other cells'.
    """
    cells: dict[int, list[bool | None]] = {cell: [] for cell in range(min(plan.cells, len(plan)))}
    for first in range(0, -(-len(plan) // plan.cells), CELL_EPISODES):
        last = first + CELL_EPISODES
        visited = [visit * plan.cells + cell for visit in range(first, last) for cell in cells]
        episodes = [episode for episode in visited if episode < len(plan)]
        yield episodes
        for episode in episodes:
            cells[episode % plan.cells].append(outcomes[episode])
        cells = {cell: found for cell, found in cells.items() if _half_width(found) > plan.cfg.until_ci}
        if not cells:
            return


def _half_width(outcomes: Sequence[bool | None]) -> float:
    """Of the interval of those that are not None."""
    flown = [outcome for outcome in outcomes if outcome is not None]
    return wilson(sum(flown), len(flown)).half_width
