"""Limits of settings, said as annotations of their fields: `rate_hz: Annotated[float, above(0.0), at_most(1000.0)]`.

`core.reader` checks them; the unit in its message is the one that the setting's name ends with.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

__all__ = [
    "AcuteDeg",
    "Count",
    "Limit",
    "NotNegative",
    "OpenShare",
    "Positive",
    "PositiveShare",
    "Share",
    "above",
    "at_least",
    "at_most",
    "below",
    "between",
]


@dataclass(frozen=True)
class Limit:
    """Numbers that a setting may be."""

    least: float
    """Smallest of them."""
    greatest: float
    """Largest of them."""
    words: str
    """Phrase that completes "give ...", with `{unit}` where the unit belongs."""
    why: str = ""
    """Reason that a message adds, if the setting's name does not say it."""

    def admits(self, value: float) -> bool:
        """Whether a number is one of them; NaN never is."""
        return self.least <= value <= self.greatest


def above(bound: float, why: str = "") -> Limit:
    """Numbers greater than `bound`."""
    return Limit(math.nextafter(bound, math.inf), math.inf, f"more than {_shown(bound)}{{unit}}", why)


def at_least(bound: float, why: str = "") -> Limit:
    """`bound` and greater numbers."""
    return Limit(bound, math.inf, f"{_shown(bound)}{{unit}} or more", why)


def below(bound: float, why: str = "") -> Limit:
    """Numbers less than `bound`."""
    return Limit(-math.inf, math.nextafter(bound, -math.inf), f"less than {_shown(bound)}{{unit}}", why)


def at_most(bound: float, why: str = "") -> Limit:
    """`bound` and smaller numbers."""
    return Limit(-math.inf, bound, f"at most {_shown(bound)}{{unit}}", why)


def between(low: float, high: float, why: str = "") -> Limit:
    """Numbers from `low` to `high`, both included."""
    return Limit(low, high, f"{_shown(low)} to {_shown(high)}{{unit}}", why)


def _shown(bound: float) -> str:
    return f"{bound:.15g}"


Positive = Annotated[float, above(0.0)]
"""A size, rate, weight or threshold that cannot be 0."""
NotNegative = Annotated[float, at_least(0.0)]
"""A size that may be 0."""
Share = Annotated[float, between(0.0, 1.0)]
"""A part of a whole, or a probability."""
PositiveShare = Annotated[float, above(0.0), at_most(1.0)]
"""A part of a whole that is never none of it: an efficiency."""
OpenShare = Annotated[float, above(0.0), below(1.0)]
"""A part of a whole that is neither none nor all of it."""
AcuteDeg = Annotated[float, above(0.0), at_most(90.0)]
"""An angle that is not none and at most a right one."""
Count = Annotated[int, at_least(1)]
"""How many, where none makes no sense."""
