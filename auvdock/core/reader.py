"""Plain data into frozen dataclasses: each value is of its field's type, or refused under its full path.

Configuration consists of nested dataclasses, floats, whole numbers, text, names (`Literal`), truth values, tuples of
these, a choice of them (`float | None`), and tables whose content somebody else checks (`Mapping[str, Any]`). A number
may be annotated with limits (`core.limits`); they and the magnitudes of `core.magnitudes` are checked here alone.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from auvdock.core.errors import ConfigError, located
from auvdock.core.limits import Limit
from auvdock.core.magnitudes import FINITE, WHOLE, check_magnitude, unit_of

__all__ = ["bare_type", "from_mapping", "hints_of", "known_table", "read_value"]

T = TypeVar("T")

_WANTED: Mapping[Any, str] = {
    float: FINITE,
    int: WHOLE,
    str: "text",
    bool: "true or false",
    types.NoneType: "nothing",
}
_LARGEST_FLOAT = int(float.fromhex("0x1.fffffffffffffp+1023"))
"""As a whole number: greater ones become no float."""
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


@cache
def hints_of(cls: Any) -> Mapping[str, Any]:  # noqa: ANN401 - a dataclass of any kind
    """Annotations of a dataclass' fields, by name; remembered, since they are text that takes long to read."""
    hints = get_type_hints(cls, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls) if field.init}


def bare_type(hint: Any) -> Any:  # noqa: ANN401
    """The type that an annotation limits: float of `Annotated[float, above(0.0)]`, str of `Literal["a", "b"]`."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return arguments[0]
    return type(arguments[0]) if origin is Literal else hint


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
    hints = hints_of(cls)
    given = known_table(cls, data, prefix)
    values = {key: read_value(hints[key], value, f"{prefix}{key}") for key, value in given.items()}
    for field in dataclasses.fields(typing.cast(Any, cls)):
        absent = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if absent and field.init and field.name not in values:
            raise ConfigError(f"{prefix}{field.name}", None, "a value, it has no default")
    with located(prefix):
        return cls(**values)


def read_value(hint: Any, value: Any, path: str) -> Any:  # noqa: ANN401
    """`value` as the type `hint` wants it.

    Raises:
        ConfigError: a value of another type, or that its dataclass refuses; its field begins with `path`.
    """
    if dataclasses.is_dataclass(hint):
        if isinstance(value, typing.cast(type, hint)):
            return value
        return from_mapping(typing.cast(type, hint), _table(value, path), f"{path}.")
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _within(arguments[1:], read_value(arguments[0], value, path), path)
    if origin is Literal:
        return _read_name(arguments, value, path)
    if origin in (typing.Union, types.UnionType):
        return _read_choice(arguments, value, path)
    if origin is tuple:
        return _read_tuple(arguments, value, path)
    if origin is Mapping:
        return dict(_table(value, path))
    return _read_scalar(hint, value, path)


def _within(limits: tuple[Limit, ...], value: Any, path: str) -> Any:  # noqa: ANN401
    if all(limit.admits(value) for limit in limits):
        return value
    unit = unit_of(path, value)
    words = " and ".join(limit.words.format(unit=f" {unit}" if unit else "") for limit in limits)
    raise ConfigError(path, value, ", ".join([words, *(limit.why for limit in limits if limit.why)]))


def _read_name(names: tuple[Any, ...], value: Any, path: str) -> Any:  # noqa: ANN401
    if isinstance(value, str) and value in names:
        return value
    raise ConfigError(path, value, f"one of {', '.join(names)}")


def _read_choice(options: tuple[Any, ...], value: Any, path: str) -> Any:  # noqa: ANN401
    if type(value) in options:
        return read_value(type(value), value, path)
    options = tuple(option for option in options if option is not types.NoneType)
    refused: dict[Any, ConfigError] = {}
    for option in options:
        try:
            return read_value(option, value, path)
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
    return tuple(read_value(hint, item, f"{path}[{index}]") for index, (hint, item) in enumerate(pairs))


def _read_scalar(hint: Any, value: Any, path: str) -> Any:  # noqa: ANN401
    if hint not in _WANTED:
        raise TypeError(f"{path}: settings of type {hint} cannot be read")
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)  # Python counts True as 1
    if hint is float and (isinstance(value, float | np.floating) or (is_whole and abs(int(value)) <= _LARGEST_FLOAT)):
        check_magnitude(path, float(value))
        return float(value)
    if hint is int and is_whole:
        check_magnitude(path, int(value))
        return int(value)
    if hint in (str, bool, types.NoneType) and isinstance(value, hint):
        return value
    raise ConfigError(path, value, _WANTED[hint])


def _table(value: Any, path: str) -> Mapping[str, Any]:  # noqa: ANN401
    if not isinstance(value, Mapping):
        raise ConfigError(path, value, "a table of settings")
    return typing.cast(Mapping[str, Any], value)


def known_table(cls: Any, data: Any, prefix: str) -> Mapping[str, Any]:  # noqa: ANN401
    """`data`, if it is a table with no other keys than the fields of the dataclass `cls`.

    Raises:
        ConfigError: it is none, or has an unknown key; the message names the nearest known one.
    """
    table = _table(data, prefix.rstrip(".") or cls.__name__)
    known = list(hints_of(cls))
    for key in table:
        if key not in known:
            name = str(key) if _BARE_KEY.fullmatch(str(key)) else repr(key)
            near = difflib.get_close_matches(str(key), known, n=1)
            remedy = f"the known key {near[0]!r}" if near else f"one of {', '.join(known)}"
            raise ConfigError(f"{prefix}{name}", key, f"{remedy} (this key is unknown)")
    return table
