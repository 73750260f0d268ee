"""Configuration of an episode: the world and the pilot's head; difficulty levels as TOML on top."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self, TypeAlias

from auvdock.assets import asset
from auvdock.controllers.landing.config import LandingControlCfg
from auvdock.controllers.pilot import ControlCfg
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.strict import merge, read_toml
from auvdock.envs.config import WorldCfg, rotating_world_cfg
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.episode.files import embed_files
from auvdock.perception.landing.config import LandingPerceptionCfg
from auvdock.perception.pipeline import PerceptionCfg

__all__ = [
    "LEVELS",
    "LEVEL_STATIONS",
    "AnyEpisodeCfg",
    "EpisodeCfg",
    "LandingEpisodeCfg",
    "landing_level_cfg",
    "level_cfg",
]

LEVELS = (0, 1, 2, 3, 4)
"""Difficulty levels; `assets/levels/level_N.toml` (rotating beacon: `rotating_N.toml`) says what each changes."""
LEVEL_STATIONS = ("conical", "rotating")
"""Stations whose worlds are an `EpisodeCfg`."""


class _Episode(Checked):
    """What the configurations of all episodes can do."""

    world: Any

    def override(self, changes: Mapping[str, Any]) -> Self:
        """A copy with nested fields replaced, checked as strictly as a TOML file.

        A station's or water's file is read now: the copy holds what it says.

        Raises:
            ConfigError: an unknown key or a value that does not fit.
        """
        return merge(self, embed_files(changes, type(self.world.station)))


@dataclass(frozen=True)
class EpisodeCfg(_Episode):
    """One docking episode."""

    world: WorldCfg = WorldCfg()
    perception: PerceptionCfg = PerceptionCfg()
    control: ControlCfg = ControlCfg()


@dataclass(frozen=True)
class LandingEpisodeCfg(_Episode):
    """One landing episode."""

    world: LandingWorldCfg = LandingWorldCfg()
    perception: LandingPerceptionCfg = LandingPerceptionCfg()
    control: LandingControlCfg = LandingControlCfg()


AnyEpisodeCfg: TypeAlias = EpisodeCfg | LandingEpisodeCfg
"""Configuration of an episode of any kind of docking."""


def level_cfg(level: int, station: str = "conical") -> EpisodeCfg:
    """The configuration of a difficulty level.

    Args:
        level: one of `LEVELS`.
        station: "conical" (starts before the mouth) or "rotating" (starts all around, `rotating_world_cfg`).

    Raises:
        ConfigError: no such level or station.
    """
    if station == "conical":
        return EpisodeCfg().override(_level_changes("level", level))
    if station == "rotating":
        return EpisodeCfg(world=rotating_world_cfg()).override(_level_changes("rotating", level))
    raise ConfigError("station", station, f"one of {', '.join(LEVEL_STATIONS)}")


def landing_level_cfg(level: int) -> LandingEpisodeCfg:
    """The configuration of a difficulty level of landing; `assets/levels/landing_N.toml` says what each changes.

    Raises:
        ConfigError: no such level.
    """
    return LandingEpisodeCfg().override(_level_changes("landing", level))


def _level_changes(kind: str, level: int) -> dict[str, Any]:
    if level not in LEVELS:
        raise ConfigError("level", level, f"one of {', '.join(map(str, LEVELS))}")
    return read_toml(asset("levels", f"{kind}_{level}"))
