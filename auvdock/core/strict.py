"""Strict TOML files into frozen dataclasses, and changes of them; see `auvdock.core.reader` for what is taken."""

from __future__ import annotations

import dataclasses
import tomllib
import typing
from collections.abc import Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar, get_args

from auvdock.core.errors import ConfigError, located
from auvdock.core.magnitudes import check_magnitude
from auvdock.core.reader import bare_type, from_mapping, hints_of, known_table, read_value

__all__ = [
    "bare_type",
    "from_mapping",
    "load_toml",
    "merge",
    "names_file",
    "read_toml",
    "recheck",
    "setting_type",
    "to_plain",
]

T = TypeVar("T")


def read_toml(path: Path | Traversable) -> dict[str, Any]:
    """Parse a TOML file in UTF-8, with or without the byte-order mark that some editors put first.

    Raises:
        ConfigError: the file is missing or is not TOML.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:  # ValueError: a name with a NUL in it, or bytes that are no UTF-8
        raise ConfigError("file", str(path), f"a readable TOML file in UTF-8 ({error})") from error
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # of tomllib: no TOML, a number too long, tables too deep
        raise ConfigError("file", str(path), f"valid TOML ({error})") from error


def names_file(value: object) -> bool:
    """Whether a setting that may be a preset's name or a file ("my_lake.toml") is a file."""
    return isinstance(value, str) and value.endswith(".toml")


def load_toml(cls: type[T], path: Path | Traversable) -> T:
    """Read a TOML file into the dataclass `cls`; see `from_mapping`."""
    return from_mapping(cls, read_toml(path))


def merge(base: T, overrides: Mapping[str, Any], prefix: str = "") -> T:
    """Copy a dataclass with some fields replaced by nested plain data, checked as strictly as a whole file.

    Raises:
        ConfigError: as `from_mapping`.
    """
    if not dataclasses.is_dataclass(base) or isinstance(base, type):
        raise TypeError("merge needs a dataclass instance")
    cls = type(base)
    hints = hints_of(cls)
    changes: dict[str, Any] = {}
    for key, value in known_table(cls, overrides, prefix).items():
        current, path = getattr(base, key), f"{prefix}{key}"
        if dataclasses.is_dataclass(current) and isinstance(value, Mapping):
            changes[key] = merge(current, typing.cast(Mapping[str, Any], value), f"{path}.")
        else:
            changes[key] = read_value(hints[key], value, path)
    with located(prefix):
        return dataclasses.replace(base, **changes)  # type: ignore[type-var]


def recheck(value: T, prefix: str = "") -> T:
    """The same dataclasses made anew from within, so that each checks its fields; for those made without.

    Raises:
        ConfigError: a field that is refused, or a number that is not finite or too great (`check_magnitude`).
    """
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        raise TypeError("recheck needs a dataclass instance")
    values = {name: _rechecked(getattr(value, name), f"{prefix}{name}") for name in hints_of(type(value))}
    with located(prefix):
        return type(value)(**values)


def setting_type(cls: type, path: str, prefix: str = "") -> Any:  # noqa: ANN401 - a type as annotations write it
    """The type of a dotted setting of the dataclass `cls`, without its limits.

    Raises:
        ConfigError: no such setting.
    """
    name, _, rest = path.partition(".")
    known_table(cls, {name: None}, prefix)
    hint = bare_type(hints_of(cls)[name])
    if not rest:
        return hint
    for option in get_args(hint) or (hint,):
        if dataclasses.is_dataclass(option):
            return setting_type(typing.cast(type, option), rest, f"{prefix}{name}.")
    raise ConfigError(f"{prefix}{path}", rest, f"{prefix}{name} alone, it has no settings of its own")


def to_plain(value: Any) -> Any:  # noqa: ANN401 - mirrors JSON's own types
    """Nested dataclasses, tuples and paths as dicts, lists and strings: what JSON and TOML can hold."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    return value


def _rechecked(value: Any, path: str) -> Any:  # noqa: ANN401
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return recheck(value, f"{path}.")
    if isinstance(value, tuple):
        items = typing.cast(tuple[Any, ...], value)
        return tuple(_rechecked(item, f"{path}[{index}]") for index, item in enumerate(items))
    if isinstance(value, int | float) and not isinstance(value, bool):  # Python counts True as 1
        check_magnitude(path, value)
    return value
