"""What a worker does: build once, then turn episode specs into rows."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.plan import EpisodeSpec, Plan
from auvdock.campaign.row import Row, lost_row, row_of
from auvdock.core.errors import AuvdockError
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.episode.runner import EpisodeRunner

__all__ = ["DockingJob", "EpisodeFunction", "Job", "attempt"]

EpisodeFunction = Callable[[EpisodeSpec], Row]
"""Runs one episode."""


class Job(Protocol):
    """Picklable data from which every worker builds its own episode function."""

    def build(self) -> EpisodeFunction:
        """Make what the worker needs once: simulator, optics tables, later a renderer."""
        ...


def attempt(run: EpisodeFunction, spec: EpisodeSpec) -> Row:
    """Run one episode; an exception in it is the episode's own failure, not the campaign's.

    Raises:
        AuvdockError: what the user can put right stops the campaign.
    """
    try:
        return run(spec)
    except AuvdockError:
        raise
    except Exception as error:
        text = " ".join(str(error).split())
        return lost_row(spec, "crashed", f"{type(error).__name__}: {text}"[:500])


@dataclass(frozen=True)
class DockingJob:
    """Docking episodes of a campaign."""

    campaign: CampaignCfg
    """The campaign."""
    cached_runners: int = 48
    """Runners that a worker keeps, by configuration; the least recently used goes first, so memory stays bounded."""

    def build(self) -> EpisodeFunction:
        """A function with its own runners and its own renderer."""
        return _Docking(self.campaign, self.cached_runners)


class _Docking:
    """Runners by configuration."""

    def __init__(self, campaign: CampaignCfg, cached_runners: int) -> None:
        self._plan = Plan(campaign)
        self._cached = cached_runners
        self._runners: OrderedDict[tuple[object, ...], EpisodeRunner] = OrderedDict()

    def __call__(self, spec: EpisodeSpec) -> Row:
        return row_of(spec, self._runner(spec).run(spec.seed))

    def _runner(self, spec: EpisodeSpec) -> EpisodeRunner:
        key = tuple(spec.point.values())
        runner = self._runners.get(key)
        if runner is not None:
            self._runners.move_to_end(key)
            return runner
        while len(self._runners) >= self._cached:
            self._runners.popitem(last=False)[1].world.close()
        self._runners[key] = runner = self._make(self._plan.config(spec))
        return runner

    def _make(self, cfg: AnyEpisodeCfg) -> EpisodeRunner:
        return EpisodeRunner(cfg)
