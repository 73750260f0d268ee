"""The kinds of station that episodes, campaigns, recordings and commands know: what is each one's own stands here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

from auvdock.controllers.named import find_pilot
from auvdock.core.errors import located
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.station import ConicalStationCfg
from auvdock.core.strict import read_toml
from auvdock.episode.config import AnyEpisodeCfg, EpisodeCfg, LandingEpisodeCfg, landing_level_cfg, level_cfg
from auvdock.episode.conical_task import conical_task
from auvdock.episode.landing_task import landing_task
from auvdock.episode.result import EpisodeResult
from auvdock.episode.result_lines import Line, docking_lines, landing_lines, shared_lines
from auvdock.episode.task import Task

__all__ = ["STATIONS", "StationKind", "make_task", "result_lines", "station_kind"]


@dataclass(frozen=True)
class StationKind:
    """A kind of station."""

    name: str
    """In a title."""
    docking: str
    """What an episode there is called."""
    level: Callable[[int], AnyEpisodeCfg]
    """Configuration of an episode of a difficulty level."""
    lines: Callable[[EpisodeResult], list[Line]]
    """What a result says of this kind alone."""
    marks: frozenset[str] = frozenset()
    """Settings of which a station's file has one exactly if it describes this kind."""
    all_around: bool = False
    """Whether episodes may start behind the station, where no way along its axis is left."""


def _settings(cls: type[Any]) -> frozenset[str]:
    return frozenset(field.name for field in fields(cls))


STATIONS: Mapping[str, StationKind] = {
    "conical": StationKind("conical station", "conical docking", level_cfg, docking_lines),
    "rotating": StationKind(
        "rotating beacon",
        "docking by the rotating beacon",
        partial(level_cfg, station="rotating"),
        docking_lines,
        frozenset({"rotating"}),
        all_around=True,
    ),
    "landing": StationKind(
        "landing station",
        "landing",
        landing_level_cfg,
        landing_lines,
        _settings(LandingStationCfg) - _settings(ConicalStationCfg),
    ),
}
"""All of them, by the names that users know them by. `auvdock.recording.parts` has what each adds to a recording."""

_TASKS: Mapping[type, Callable[[Any], Task]] = {
    EpisodeCfg: conical_task,
    LandingEpisodeCfg: landing_task,
}


def make_task(cfg: AnyEpisodeCfg) -> Task:
    """The task that a configuration asks for.

    Raises:
        ConfigError: a name that does not exist or a value that does not fit.
    """
    with located("control."):
        find_pilot(cfg.control.controller)  # before the world, whose loops may have to be compiled
    return _TASKS[type(cfg)](cfg)


def station_kind(path: Path) -> str:
    """Which of `STATIONS` a station's file describes; the first if it has no setting by which others are known.

    Raises:
        ConfigError: a file that cannot be read.
    """
    settings = set(read_toml(path))
    return next((name for name, kind in STATIONS.items() if kind.marks & settings), next(iter(STATIONS)))


def result_lines(station: str, result: EpisodeResult) -> list[Line]:
    """What the result of an episode at one of `STATIONS` says."""
    return [*shared_lines(result), *STATIONS[station].lines(result)]
