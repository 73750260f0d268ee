"""The pilot's guidance modes as a recording shows them: a number for the plot, a lane of states, a log of changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from auvdock.recording.palette import rgba

__all__ = [
    "KNOWN_MODES",
    "MODE_COLOURS",
    "ModeChange",
    "ModeFollower",
    "from_the_mouth",
]

KNOWN_MODES = ("acquire", "far", "mid", "near", "terminal", "docked", "abort", "approach", "circle", "lineup")
"""Modes of the package's own pilots, numbered from 0; those of a user's pilot get the numbers after them."""

MODE_COLOURS = (
    rgba(130, 130, 140),
    rgba(70, 110, 200),
    rgba(60, 160, 200),
    rgba(230, 160, 50),
    rgba(220, 110, 50),
    rgba(70, 170, 90),
    rgba(200, 60, 60),
    rgba(150, 110, 200),
    rgba(190, 120, 190),
    rgba(110, 130, 220),
)


@dataclass(frozen=True)
class ModeChange:
    """A change of mode.

    Attributes:
        row: index of the tick within its batch.
        mode: the new mode.
        text: the change in words.
    """

    row: int
    mode: str
    text: str


def from_the_mouth(ahead_m: float) -> str:
    """How far the nose is in front of the mouth along the station's axis, negative inside."""
    return f"{abs(ahead_m):.1f} m {'in front of' if ahead_m >= 0.0 else 'past'} the mouth"


class ModeFollower:
    """Numbers the modes of an episode and notices their changes."""

    def __init__(self, place: Callable[[float], str] = from_the_mouth) -> None:
        """Start before the first tick; `place` says in words where the vehicle is, by its way to go."""
        self._place = place
        self._numbers = {mode: number for number, mode in enumerate(KNOWN_MODES)}
        self._current: str | None = None

    def number(self, mode: str) -> int:
        """The mode's number; a mode never seen before gets the next free one."""
        return self._numbers.setdefault(mode, len(self._numbers))

    def follow(self, row: int, mode: str, to_go_m: float) -> ModeChange | None:
        """The change if `mode` is another than in the tick before, else None.

        Args:
            row: index of the tick within its batch.
            mode: the tick's mode.
            to_go_m: the vehicle's way to go (`Truth.to_go_m`).
        """
        if mode == self._current:
            return None
        where = self._place(to_go_m)
        text = f"{mode}, {where}" if self._current is None else f"{self._current} → {mode}, {where}"
        self._current = mode
        return ModeChange(row, mode, text)
