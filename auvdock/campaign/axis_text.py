"""An axis as a flag writes it: 0:0.5:6, 0:0.5, or none,mild,severe."""

from __future__ import annotations

import math

from auvdock.campaign.axes import KIND_WORDS, AxisCfg, AxisValue
from auvdock.core.errors import ConfigError

__all__ = ["parse_axis"]


def parse_axis(name: str, text: str, kind: type[AxisValue]) -> AxisCfg:
    """An axis from a flag: `low:high:count` is a grid, `low:high` a distribution, `a,b,c` or one value a list.

    Text is always a list: its colons are those of "package.module:Name".

    Raises:
        ConfigError: text that is none of these, or values that are not of the setting's type (`axis_kind`).
    """
    try:
        return _parsed(name, text, kind)
    except ConfigError as error:
        raise ConfigError(name, text, error.remedy) from error


def _parsed(name: str, text: str, kind: type[AxisValue]) -> AxisCfg:
    remedy = "low:high:count, low:high, or values with commas between them"
    parts = text.split(":")
    if len(parts) == 1 or kind in (str, bool):
        return AxisCfg(name, tuple(_value(part.strip(), name, kind, remedy) for part in text.split(",")))
    if len(parts) > 3:
        raise ConfigError(name, text, remedy)
    try:
        low, high = float(parts[0]), float(parts[1])
        count = int(parts[2]) if len(parts) == 3 else 0
    except ValueError as error:
        raise ConfigError(name, text, remedy) from error
    if len(parts) == 3 and low == high and count == 1:
        return AxisCfg(name, (low,))
    if len(parts) == 3 and count < 2:
        raise ConfigError(name, text, "a count of 2 or more")
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise ConfigError(name, text, "finite numbers with low below high")
    return AxisCfg(name, low=low, high=high, count=count)


def _value(text: str, name: str, kind: type[AxisValue], remedy: str) -> AxisValue:
    if not text:
        raise ConfigError(name, text, remedy)
    if kind is str:
        return text
    wrong = ConfigError(name, text, f"{KIND_WORDS[kind]}, as this setting is")
    if kind is bool:
        if text not in ("true", "false"):
            raise wrong
        return text == "true"
    try:
        number = int(text) if kind is int else float(text)
    except ValueError as error:
        raise wrong from error
    if not math.isfinite(number):
        raise wrong
    return number
