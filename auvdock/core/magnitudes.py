"""How great and how small a setting may be: its name says its unit, and the unit how far physics goes.

Every number passes here (`core.reader`), whatever setting it is; an annotation asks for more where more is known of one
(`core.limits`).
"""

from __future__ import annotations

import math
import re
from functools import cache

from auvdock.core.errors import ConfigError

__all__ = ["FINITE", "LEAST", "WHOLE", "check_magnitude", "greatest_of", "unit_of"]

FINITE = "a finite number"
"""What a float is asked to be."""
WHOLE = "a whole number of at most 64 bits"
"""What an int is asked to be; TOML's and Parquet's have no more."""
_LARGEST_INT = 2**63 - 1

_GREATEST: dict[str, tuple[float, str]] = {
    "per_m": (100.0, "1/m"),
    "per_s": (1e9, "1/s"),
    "1_s": (1e9, "1/s"),
    "attenuation": (100.0, "1/m"),
    "turbidity": (100.0, "1/m"),
    "current": (1e3, "m/s"),
    "m": (11_000.0, "m, the ocean's greatest depth"),
    "m_s": (1e3, "m/s"),
    "s": (1e9, "s, which is 30 years"),
    "hz": (1e6, "Hz"),
    "deg": (1e6, "degrees"),
    "rad": (1e4, "rad"),
    "rad_s": (1e4, "rad/s"),
    "deg_s": (1e6, "degrees/s"),
    "rev_s": (1e4, "rev/s"),
    "px_s": (1e9, "pixels/s"),
    "rad_m": (1e4, "rad/m"),
    "nm": (1e6, "nm"),
    "n": (1e9, "N"),
    "w": (1e6, "W"),
    "v": (1e5, "V"),
    "px": (1e6, "pixels"),
}
"""Greatest magnitude by the end of a setting's name, and what a message calls it."""
_GREATEST_COUNT = 1_000_000_000
"""Of whole numbers, which count something: lamps, pixels, frames, photons."""
_GREATEST_OTHER = 1e15
"""Of other numbers: their products and squares stay finite."""
LEAST = 1e-100
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
    greatest, unit = _greatest(path, isinstance(value, int))
    if abs(value) > greatest:
        raise ConfigError(path, value, f"a magnitude of at most {greatest:g} {unit}".rstrip())
    if unit and 0.0 < abs(value) < LEAST:
        raise ConfigError(path, value, f"0, or a magnitude of at least {LEAST:g} {unit.partition(',')[0]}")


def unit_of(path: str, value: float) -> str:
    """Unit of a setting as a message writes it ("m/s"); nothing for whole numbers and for numbers without a unit."""
    return _greatest(path, isinstance(value, int))[1].partition(",")[0]


def greatest_of(path: str, is_whole: bool) -> float:
    """Greatest magnitude of a setting."""
    return _greatest(path, is_whole)[0]


@cache
def _greatest(path: str, is_whole: bool) -> tuple[float, str]:
    name = _INDEX.sub("", path).rpartition(".")[2].replace("-", "_")
    if is_whole:
        return (_LARGEST_INT if name in _NUMBERS else _GREATEST_COUNT), ""
    words = name.split("_")
    for first in range(len(words)):  # the longest end first: m_s before s
        found = _GREATEST.get("_".join(words[first:]))
        if found is not None:
            return found
    return _GREATEST_OTHER, ""
