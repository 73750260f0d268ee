"""Landing on the platform."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import cast

from auvdock.controllers.landing.pilot import LandingPilot
from auvdock.controllers.named import PilotFactory
from auvdock.envs.perceived import landing_metrics, perceived_landing
from auvdock.episode.config import LandingEpisodeCfg
from auvdock.episode.task import Task, make_pilot

__all__ = ["landing_task"]

_STAGES: Mapping[str, str] = {
    "search": "search",
    "approach": "far",
    "align": "mid",
    "descend": "near",
    "touchdown": "terminal",
    "docked": "terminal",
    "abort": "timeout",
}


def landing_task(cfg: LandingEpisodeCfg) -> Task:
    """The task.

    Raises:
        ConfigError: a name that does not exist or a value that does not fit.
    """
    world, perceiver = perceived_landing(cfg.world, cfg.perception)
    own = cast(PilotFactory, LandingPilot)  # it reads more of a percept than others do, and is given no other
    return Task(
        kind="landing",
        station=cfg.world.station,
        detector=cfg.perception.detector,
        world=world,
        perceiver=perceiver,
        pilot=make_pilot(cfg, world, own),
        metrics=partial(landing_metrics, world),
        stages=_STAGES,
    )
