"""How great and how small a setting may be: its name says its unit, and the unit how far physics goes.

Every setting that comes from outside passes here (`core.reader`, `core.strict`), whatever dataclass it belongs to. The
class itself asks for more where it knows more.
"""

from __future__ import annotations

import math
import re

from auvdock.core.errors import ConfigError

__all__ = ["FINITE", "WHOLE", "check_magnitude"]

FINITE = "a finite number"
"""What a float is asked to be."""
WHOLE = "a whole number of at most 64 bits"
"""What an int is asked to be; TOML's and Parquet's have no more."""
_LARGEST_INT = 2**63 - 1

_GREATEST: dict[str, tuple[float, str]] = {
    "per_m": (100.0, "1/m"),
    "attenuation": (100.0, "1/m"),
    "current": (1e3, "m/s"),
    "m": (11_000.0, "m, the ocean's greatest depth"),
    "m_s": (1e3, "m/s"),
    "s": (1e9, "s, which is 30 years"),
    "hz": (1e6, "Hz"),
    "deg": (1e6, "degrees"),
    "rad": (1e4, "rad"),
    "rad_s": (1e4, "rad/s"),
    "n": (1e9, "N"),
    "w": (1e6, "W"),
    "px": (1e6, "pixels"),
}
"""Greatest magnitude by the end of a setting's name, and what a message calls it."""
_GREATEST_COUNT = 1_000_000_000
"""Of whole numbers, which count something: lamps, pixels, frames, photons."""
_GREATEST_OTHER = 1e15
"""Of other numbers: their products and squares stay finite."""
_LEAST = 1e-100
"""Of numbers that have a unit and are not 0, so that one over their squares is finite; rounding leaves greater ones."""
_NUMBERS = ("seed", "episode")
"""Whole numbers that name something instead of counting it."""
_INDEX = re.compile(r"\[\d+\]$")


def check_magnitude(path: str, value: float) -> None:
    """Refuse a number that is not finite, or whose magnitude is beyond anything of its unit.

    Args:
        path: of the setting, "world.start.max_range_m" or "position_m[2]"; a flag's name may have dashes.
        value: a float or whole number.

    Raises:
        ConfigError: such a number.
    """
    if isinstance(value, int):
        if abs(value) > _LARGEST_INT:
            raise ConfigError(path, value, WHOLE)
    elif not math.isfinite(value):
        raise ConfigError(path, value, FINITE)
    greatest, unit = _greatest(_INDEX.sub("", path).rpartition(".")[2].replace("-", "_"), value)
    if abs(value) > greatest:
        raise ConfigError(path, value, f"a magnitude of at most {greatest:g} {unit}".rstrip())
    if unit and 0.0 < abs(value) < _LEAST:
        raise ConfigError(path, value, f"0, or a magnitude of at least {_LEAST:g} {unit.partition(',')[0]}")


def _greatest(name: str, value: float) -> tuple[float, str]:
    if isinstance(value, int):
        return (_LARGEST_INT if name in _NUMBERS else _GREATEST_COUNT), ""
    words = name.split("_")
    for first in range(len(words)):  # the longest end first: m_s before s
        found = _GREATEST.get("_".join(words[first:]))
        if found is not None:
            return found
    return _GREATEST_OTHER, ""
