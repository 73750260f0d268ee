"""Strict TOML into frozen dataclasses: an unknown key is an error that names the nearest known one."""

from __future__ import annotations

import dataclasses
import difflib
import math
import tomllib
import types
import typing
from collections.abc import Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import dacite

from auvdock.core.errors import ConfigError

__all__ = ["from_mapping", "load_toml", "merge", "read_toml", "to_plain"]

T = TypeVar("T")


def read_toml(path: Path | Traversable) -> dict[str, Any]:
    """Parse a TOML file.

    Raises:
        ConfigError: the file is missing or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError("file", str(path), f"a readable TOML file ({error})") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError("file", str(path), f"valid TOML ({error})") from error


def load_toml(cls: type[T], path: Path | Traversable) -> T:
    """Read a TOML file into the dataclass `cls`; see `from_mapping`."""
    return from_mapping(cls, read_toml(path))


def from_mapping(cls: type[T], data: Mapping[str, Any], prefix: str = "") -> T:
    """Build the frozen dataclass `cls` from nested plain data.

    Lists become tuples, integers become floats where a float is wanted.

    Raises:
        ConfigError: an unknown or missing key, a value of the wrong type, or one that `cls` refuses.
    """
    _check_keys(cls, data, prefix)
    try:
        return dacite.from_dict(
            cls, data, config=dacite.Config(strict=True, cast=[tuple], type_hooks={float: _to_float})
        )
    except dacite.MissingValueError as error:
        raise ConfigError(f"{prefix}{error.field_path}", None, "a value, it has no default") from error
    except dacite.WrongTypeError as error:
        wanted = getattr(error.field_type, "__name__", str(error.field_type))
        raise ConfigError(f"{prefix}{error.field_path}", error.value, f"a value of type {wanted}") from error
    except dacite.DaciteError as error:
        raise ConfigError(prefix.rstrip(".") or cls.__name__, dict(data), f"values that fit ({error})") from error


def merge(base: T, overrides: Mapping[str, Any], prefix: str = "") -> T:
    """Copy a dataclass with some fields replaced by nested plain data, checked as strictly as a whole file.

    Raises:
        ConfigError: as `from_mapping`.
    """
    if not dataclasses.is_dataclass(base) or isinstance(base, type):
        raise TypeError("merge needs a dataclass instance")
    cls = type(base)
    known = {field.name for field in dataclasses.fields(base)}
    changes: dict[str, Any] = {}
    for key, value in overrides.items():
        if key not in known:
            raise _unknown_key(cls, key, prefix)
        current = getattr(base, key)
        if dataclasses.is_dataclass(current) and isinstance(value, Mapping):
            changes[key] = merge(current, value, f"{prefix}{key}.")
        else:
            changes[key] = _convert(get_type_hints(cls)[key], value, f"{prefix}{key}")
    return dataclasses.replace(base, **changes)  # type: ignore[type-var]


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


def _to_float(value: Any) -> float:  # noqa: ANN401
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise dacite.WrongTypeError(float, value)
    return float(value)


def _convert(hint: Any, value: Any, field: str) -> Any:  # noqa: ANN401
    box = dataclasses.make_dataclass("Box", [("value", hint)])
    try:
        converted: Any = from_mapping(box, {"value": value})
    except ConfigError as error:
        raise ConfigError(field + error.field.removeprefix("value"), error.value, error.remedy) from error
    return converted.value


def _check_keys(cls: Any, data: Any, prefix: str) -> None:  # noqa: ANN401
    if not dataclasses.is_dataclass(cls) or not isinstance(data, Mapping):
        return
    hints = get_type_hints(cls)
    known = {field.name for field in dataclasses.fields(cls) if field.init}
    for key, value in data.items():
        if key not in known:
            raise _unknown_key(cls, key, prefix)
        if isinstance(value, float) and not math.isfinite(value):
            raise ConfigError(f"{prefix}{key}", value, "a finite number")
        _check_nested(hints[key], value, f"{prefix}{key}")


def _check_nested(hint: Any, value: Any, path: str) -> None:  # noqa: ANN401
    if isinstance(value, bool) and hint is int:
        raise ConfigError(path, value, "a whole number")  # Python counts True as 1
    if dataclasses.is_dataclass(hint):
        _check_keys(hint, value, f"{path}.")
    elif get_origin(hint) in (tuple, list) and isinstance(value, tuple | list):
        inner = [argument for argument in get_args(hint) if argument is not Ellipsis]
        for index, item in enumerate(value):
            _check_nested(inner[min(index, len(inner) - 1)], item, f"{path}[{index}]")
    elif get_origin(hint) in (typing.Union, types.UnionType):
        for option in get_args(hint):
            if dataclasses.is_dataclass(option) and isinstance(value, Mapping):
                _check_keys(option, value, f"{path}.")


def _unknown_key(cls: Any, key: str, prefix: str) -> ConfigError:  # noqa: ANN401
    known = [field.name for field in dataclasses.fields(cls) if field.init]
    near = difflib.get_close_matches(key, known, n=1)
    remedy = f"the known key {near[0]!r}" if near else f"one of {', '.join(known)}"
    return ConfigError(f"{prefix}{key}", key, f"{remedy} (this key is unknown)")
