"""Parsing of flags: tyro over frozen dataclasses, with a level or a TOML file as the defaults beneath the flags.

tyro makes the dataclasses from within and would run their checks where nobody knows which flags they came from. So it
fills them unchecked, and `auvdock.core.strict.recheck` makes them anew, with each error under its full path.
"""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Generator, Sequence
from contextlib import contextmanager, redirect_stderr
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import tyro
from tyro.constructors import (
    ConstructorRegistry,
    PrimitiveConstructorSpec,
    PrimitiveTypeInfo,
    StructConstructorSpec,
    StructTypeInfo,
)

from auvdock.cli.early_flags import find_flags
from auvdock.cli.flag_errors import FlagError, one_line
from auvdock.core.errors import ConfigError
from auvdock.core.strict import names_file, read_toml, recheck
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.episode.stations import STATIONS
from auvdock.optics.water import WaterCfg, load_water

__all__ = [
    "DEFAULT_LEVEL",
    "at_least",
    "base_config",
    "level_and_file",
    "named_by_flag",
    "parse",
    "station_file",
    "with_station",
]

T = TypeVar("T")

DEFAULT_LEVEL = 1
"""Level of an episode that names none."""


def parse(cls: type[T], argv: Sequence[str], prog: str, default: T | None = None) -> T:
    """Fill the dataclass `cls` from flags; asked for help it prints that and ends the program.

    Raises:
        FlagError: flags that cannot be used.
        ConfigError: a value that its field's dataclass refuses, or that is no finite number.
    """
    doc = (cls.__doc__ or "").strip()
    # What a configuration may leave out (a rotating beacon) shall give flags where it is there, never subcommands.
    config = (tyro.conf.AvoidSubcommands,)
    read = partial(tyro.cli, cls, args=list(argv), prog=prog, description=doc, config=config, registry=_registry())
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            given: T = read() if default is None else read(default=default)
    except SystemExit as stop:
        if stop.code:
            raise FlagError(one_line(said.getvalue(), prog)) from None
        raise
    try:
        return recheck(given)
    except ConfigError as error:
        # An episode's settings are flags of their own, without its name before them; other flags have dashes.
        setting = error.field.removeprefix("episode.")
        name = setting if "." in setting else setting.replace("_", "-")
        raise ConfigError(name, error.value, error.remedy) from error


def _registry() -> ConstructorRegistry:
    """How flags become values where tyro's own way does not serve."""
    registry = ConstructorRegistry()
    asked: list[StructTypeInfo] = []

    @registry.struct_rule
    def unchecked(info: StructTypeInfo) -> StructConstructorSpec | None:
        """Tyro's own rule for dataclasses, but that nothing is checked yet."""
        if asked or not dataclasses.is_dataclass(info.type):
            return None
        asked.append(info)  # the rules below this one are asked, not this one again
        try:
            spec = ConstructorRegistry.get_struct_spec(info)
        finally:
            asked.clear()
        if not isinstance(spec, StructConstructorSpec):
            return None
        return dataclasses.replace(spec, instantiate=partial(_unchecked, info.type))

    @registry.primitive_rule
    def water(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[str | WaterCfg] | None:
        """A water by name or file, never by its coefficients."""
        if info.type != str | WaterCfg:
            return None
        return PrimitiveConstructorSpec(
            nargs=1,
            metavar="NAME|FILE",
            instance_from_str=lambda words: load_water(words[0]) if names_file(words[0]) else words[0],
            is_instance=lambda value: isinstance(value, str | WaterCfg),
            str_from_instance=lambda value: [value.name if isinstance(value, WaterCfg) else value],
        )

    return registry


def _unchecked(cls: type, **values: Any) -> object:  # noqa: ANN401 - whatever fields there are
    made = object.__new__(cls)
    for name, value in values.items():
        object.__setattr__(made, name, value)
    return made


def at_least(least: int, **values: int | None) -> None:
    """Refuse whole numbers below `least`, by the names of their flags; None is a flag that was not given.

    Raises:
        ConfigError: the first that is too small.
    """
    for name, value in values.items():
        if value is not None and value < least:
            raise ConfigError(name.replace("_", "-"), value, f"a whole number of {least} or more")


@contextmanager
def named_by_flag(**flags: str) -> Generator[None]:
    """Name a setting in errors by the flag that gives it here: `cone_deg="cone"`; others keep their names."""
    try:
        yield
    except ConfigError as error:
        if error.field not in flags:
            raise
        raise ConfigError(flags[error.field], error.value, error.remedy) from error


def base_config(argv: Sequence[str], station: str) -> AnyEpisodeCfg:
    """The configuration that `--level N` and `--config FILE` ask for; other flags then change single fields of it.

    Args:
        argv: what the user gave.
        station: key of `auvdock.episode.stations.STATIONS`.

    Raises:
        ConfigError: no such level, or a file that does not fit.
    """
    level, file = level_and_file(argv)
    cfg = STATIONS[station].level(level)
    return cfg.override(read_toml(file)) if file is not None else cfg


def level_and_file(argv: Sequence[str]) -> tuple[int, Path | None]:
    """What `--level N` and `--config FILE` say.

    Raises:
        ConfigError: a level that is no whole number.
    """
    found = find_flags(argv, "level", "config")
    level, file = found["level"], found["config"]
    try:
        number = DEFAULT_LEVEL if level is None else int(level)
    except ValueError as error:
        raise ConfigError("level", level, "a whole number of 0 to 4") from error
    return number, Path(file) if file else None


def station_file(argv: Sequence[str]) -> str | None:
    """What `--station FILE` says."""
    return find_flags(argv, "station")["station"]


def with_station(cfg: AnyEpisodeCfg, file: str) -> AnyEpisodeCfg:
    """The configuration with the station of a TOML file.

    Raises:
        ConfigError: a file that cannot be read, or that describes another kind of station.
    """
    if not names_file(file):
        raise ConfigError("station", file, "a station's file, NAME.toml")
    return cfg.override({"world": {"station": file}})
