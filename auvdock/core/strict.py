"""Strict TOML into frozen dataclasses: each value is of its field's type, or refused under its full path.

Configuration consists of nested dataclasses, floats, whole numbers, text, truth values, tuples of these, a choice of
them (`float | None`), and tables whose content somebody else checks (`Mapping[str, Any]`).
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
import tomllib
import types
import typing
from collections.abc import Mapping
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from auvdock.core.errors import ConfigError, located

__all__ = ["from_mapping", "load_toml", "merge", "names_file", "read_toml", "recheck", "setting_type", "to_plain"]

T = TypeVar("T")

_LARGEST_INT = 2**63 - 1
"""TOML's whole numbers have 64 bits."""
_WANTED: Mapping[Any, str] = {
    float: "a finite number",
    int: "a whole number of at most 64 bits",
    str: "text",
    bool: "true or false",
    types.NoneType: "nothing",
}
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def read_toml(path: Path | Traversable) -> dict[str, Any]:
    """Parse a TOML file.

    Raises:
        ConfigError: the file is missing or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError("file", str(path), f"a readable TOML file ({error})") from error
    except (ValueError, RecursionError) as error:  # of tomllib: no TOML, a number too long, tables too deep
        raise ConfigError("file", str(path), f"valid TOML ({error})") from error


def names_file(value: object) -> bool:
    """Whether a setting that may be a preset's name or a file ("my_lake.toml") is a file."""
    return isinstance(value, str) and value.endswith(".toml")


def load_toml(cls: type[T], path: Path | Traversable) -> T:
    """Read a TOML file into the dataclass `cls`; see `from_mapping`."""
    return from_mapping(cls, read_toml(path))


def from_mapping(cls: type[T], data: Mapping[str, Any], prefix: str = "") -> T:
    """Build the frozen dataclass `cls` from nested plain data.

    Lists become tuples, whole numbers become floats where a float is wanted.

    Args:
        cls: the dataclass.
        data: what is given; fields with a default may be absent.
        prefix: path of `data` in the whole ("world.start."), for errors.

    Raises:
        ConfigError: an unknown or missing key, a value of the wrong type, or one that `cls` refuses.
    """
    hints = _hints(cls)
    values = {key: _read(hints[key], value, f"{prefix}{key}") for key, value in _known(cls, data, prefix).items()}
    for field in dataclasses.fields(typing.cast(Any, cls)):
        absent = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if absent and field.init and field.name not in values:
            raise ConfigError(f"{prefix}{field.name}", None, "a value, it has no default")
    with located(prefix):
        return cls(**values)


def merge(base: T, overrides: Mapping[str, Any], prefix: str = "") -> T:
    """Copy a dataclass with some fields replaced by nested plain data, checked as strictly as a whole file.

    Raises:
        ConfigError: as `from_mapping`.
    """
    if not dataclasses.is_dataclass(base) or isinstance(base, type):
        raise TypeError("merge needs a dataclass instance")
    cls = type(base)
    hints = _hints(cls)
    changes: dict[str, Any] = {}
    for key, value in _known(cls, overrides, prefix).items():
        current, path = getattr(base, key), f"{prefix}{key}"
        if dataclasses.is_dataclass(current) and isinstance(value, Mapping):
            changes[key] = merge(current, typing.cast(Mapping[str, Any], value), f"{path}.")
        else:
            changes[key] = _read(hints[key], value, path)
    with located(prefix):
        return dataclasses.replace(base, **changes)  # type: ignore[type-var]


def recheck(value: T, prefix: str = "") -> T:
    """The same dataclasses made anew from within, so that each checks its fields; for those made without.

    Raises:
        ConfigError: a field that is refused, or a number that is not finite.
    """
    if not dataclasses.is_dataclass(value) or isinstance(value, type):
        raise TypeError("recheck needs a dataclass instance")
    fields = [field.name for field in dataclasses.fields(value) if field.init]
    values = {name: _rechecked(getattr(value, name), f"{prefix}{name}") for name in fields}
    with located(prefix):
        return type(value)(**values)


def setting_type(cls: type, path: str, prefix: str = "") -> Any:  # noqa: ANN401 - a type as annotations write it
    """The type of a dotted setting of the dataclass `cls`.

    Raises:
        ConfigError: no such setting.
    """
    name, _, rest = path.partition(".")
    _known(cls, {name: None}, prefix)
    hint = _hints(cls)[name]
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


_hints = cache(get_type_hints)


def _read(hint: Any, value: Any, path: str) -> Any:  # noqa: ANN401
    """`value` as the type `hint` wants it."""
    if dataclasses.is_dataclass(hint):
        if isinstance(value, typing.cast(type, hint)):
            return value
        return from_mapping(typing.cast(type, hint), _table(value, path), f"{path}.")
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return _read_choice(arguments, value, path)
    if origin is tuple:
        return _read_tuple(arguments, value, path)
    if origin is Mapping:
        return dict(_table(value, path))
    return _read_scalar(hint, value, path)


def _read_choice(options: tuple[Any, ...], value: Any, path: str) -> Any:  # noqa: ANN401
    if type(value) in options:
        return _read(type(value), value, path)
    options = tuple(option for option in options if option is not types.NoneType)
    refused: dict[Any, ConfigError] = {}
    for option in options:
        try:
            return _read(option, value, path)
        except ConfigError as error:
            refused[option] = error
    # Of a table only the one choice that is a table can tell what is wrong inside it.
    fitting = [option for option in options if dataclasses.is_dataclass(option) and isinstance(value, Mapping)]
    if len(options) == 1 or fitting:
        raise refused[(fitting or options)[0]]
    raise ConfigError(path, value, " or ".join(refused[option].remedy for option in options))


def _read_tuple(wanted: tuple[Any, ...], value: Any, path: str) -> tuple[Any, ...]:  # noqa: ANN401
    items: Any = value
    if not isinstance(value, list | tuple):
        raise ConfigError(path, value, "a list")
    if wanted[-1] is Ellipsis:
        wanted = (wanted[0],) * len(items)
    if len(items) != len(wanted):
        raise ConfigError(path, value, f"a list of {len(wanted)}")
    pairs = zip(wanted, items, strict=True)
    return tuple(_read(hint, item, f"{path}[{index}]") for index, (hint, item) in enumerate(pairs))


def _read_scalar(hint: Any, value: Any, path: str) -> Any:  # noqa: ANN401
    if hint not in _WANTED:
        raise TypeError(f"{path}: settings of type {hint} cannot be read")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)  # Python counts True as 1
    if hint is float and is_number and abs(value) <= _LARGEST_FLOAT:
        return float(value)
    if hint is int and is_number and isinstance(value, int) and abs(value) <= _LARGEST_INT:
        return value
    if hint in (str, bool, types.NoneType) and isinstance(value, hint):
        return value
    raise ConfigError(path, value, _WANTED[hint])


_LARGEST_FLOAT = int(float.fromhex("0x1.fffffffffffffp+1023"))
"""As a whole number, with which any whole number and any float compare; NaN is not at most anything."""


def _rechecked(value: Any, path: str) -> Any:  # noqa: ANN401
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return recheck(value, f"{path}.")
    if isinstance(value, tuple):
        items = typing.cast(tuple[Any, ...], value)
        return tuple(_rechecked(item, f"{path}[{index}]") for index, item in enumerate(items))
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(path, value, _WANTED[float])
    return value


def _table(value: Any, path: str) -> Mapping[str, Any]:  # noqa: ANN401
    if not isinstance(value, Mapping):
        raise ConfigError(path, value, "a table of settings")
    return typing.cast(Mapping[str, Any], value)


def _known(cls: Any, data: Any, prefix: str) -> Mapping[str, Any]:  # noqa: ANN401
    """`data`, if it is a table with no other keys than the fields of `cls`."""
    table = _table(data, prefix.rstrip(".") or cls.__name__)
    known = [field.name for field in dataclasses.fields(cls) if field.init]
    for key in table:
        if key not in known:
            name = str(key) if _BARE_KEY.fullmatch(str(key)) else repr(key)
            near = difflib.get_close_matches(str(key), known, n=1)
            remedy = f"the known key {near[0]!r}" if near else f"one of {', '.join(known)}"
            raise ConfigError(f"{prefix}{name}", key, f"{remedy} (this key is unknown)")
    return table
