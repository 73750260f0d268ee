"""Parsing of flags: tyro over frozen dataclasses, with a level or a TOML file as the defaults beneath the flags."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import tyro

from auvdock.campaign.config import STATIONS
from auvdock.core.errors import ConfigError
from auvdock.core.strict import read_toml
from auvdock.episode.config import AnyEpisodeCfg

__all__ = ["DEFAULT_LEVEL", "base_config", "level_and_file", "parse"]

T = TypeVar("T")

DEFAULT_LEVEL = 1
"""Level of an episode that names none."""


def parse(cls: type[T], argv: Sequence[str], prog: str, default: T | None = None) -> T:
    """Fill the dataclass `cls` from flags; wrong flags end the program with exit code 2, as argparse's do."""
    doc = (cls.__doc__ or "").strip()
    # What a configuration may leave out (a rotating beacon) shall give flags where it is there, never subcommands.
    config = (tyro.conf.AvoidSubcommands,)
    if default is None:
        return tyro.cli(cls, args=list(argv), prog=prog, description=doc, config=config)
    return tyro.cli(cls, args=list(argv), prog=prog, description=doc, default=default, config=config)


def base_config(argv: Sequence[str], station: str) -> AnyEpisodeCfg:
    """The configuration that `--level N` and `--config FILE` ask for; other flags then change single fields of it.

    Args:
        argv: what the user gave.
        station: key of `auvdock.campaign.config.STATIONS`.

    Raises:
        ConfigError: no such level, or a file that does not fit.
    """
    level, file = level_and_file(argv)
    cfg = STATIONS[station](level)
    return cfg.override(read_toml(file)) if file is not None else cfg


def level_and_file(argv: Sequence[str]) -> tuple[int, Path | None]:
    """What `--level N` and `--config FILE` say.

    Raises:
        ConfigError: a level that is no whole number.
    """
    finder = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    finder.add_argument("--level", default=str(DEFAULT_LEVEL))
    finder.add_argument("--config", default=None)
    found, _ = finder.parse_known_args(list(argv))
    try:
        level = int(found.level)
    except ValueError as error:
        raise ConfigError("level", found.level, "a whole number of 0 to 4") from error
    return level, Path(found.config) if found.config else None
