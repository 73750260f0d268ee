"""Refusing numbers that cannot be, by the name of the setting."""

from __future__ import annotations

import math

from auvdock.core.errors import ConfigError

__all__ = ["check_above", "check_finite", "check_range"]


def check_range(field: str, value: float, low: float, high: float, remedy: str) -> None:
    """Refuse a number outside [low, high].

    Raises:
        ConfigError: it lies outside, or is not finite.
    """
    if not (math.isfinite(value) and low <= value <= high):
        raise ConfigError(field, value, remedy)


def check_above(field: str, value: float, low: float, remedy: str, high: float = math.inf) -> None:
    """Refuse a number that is not greater than `low`, or greater than `high`.

    Raises:
        ConfigError: it lies outside (low, high], or is not finite.
    """
    if not (math.isfinite(value) and low < value <= high):
        raise ConfigError(field, value, remedy)


def check_finite(field: str, value: tuple[float, ...], remedy: str) -> None:
    """Refuse a vector with something in it that is not finite.

    Raises:
        ConfigError: there is.
    """
    if not all(math.isfinite(part) for part in value):
        raise ConfigError(field, value, remedy)
