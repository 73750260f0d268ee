"""Docking into the conical station, with or without a rotating beacon."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from auvdock.controllers.pilot import ConicalPilot
from auvdock.controllers.rotating.pilot import RotatingPilot
from auvdock.envs.perceived import docking_metrics, perceived_docking
from auvdock.episode.config import EpisodeCfg
from auvdock.episode.task import Task, make_pilot

__all__ = ["conical_task"]

_STAGES: Mapping[str, str] = {"acquire": "search", "abort": "timeout", "docked": "terminal"}


def conical_task(cfg: EpisodeCfg) -> Task:
    """The task; its own pilot is the rotating beacon's if there is one or the station's heading is unknown.

    Raises:
        ConfigError: a name that does not exist or a value that does not fit.
    """
    station = cfg.world.station
    world, perceiver = perceived_docking(cfg.world, cfg.perception)
    found_anywhere = station.rotating is not None or cfg.world.station_heading == "unknown"
    pilot = make_pilot(cfg, world, RotatingPilot if found_anywhere else ConicalPilot)
    return Task(
        kind="conical" if station.rotating is None else "rotating",
        station=station,
        detector=cfg.perception.detector,
        world=world,
        perceiver=perceiver,
        pilot=pilot,
        metrics=partial(docking_metrics, world),
        stages=_STAGES,
    )
