"""The pilot's guidance modes as a recording shows them: a number for the plot, a lane of states, a log of changes."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.recording.palette import rgba

__all__ = [
    "KNOWN_MODES",
    "LANDING_COLOURS",
    "LANDING_MODES",
    "LEVELS",
    "LEVEL_COLOURS",
    "MODE_COLOURS",
    "ModeChange",
    "ModeFollower",
]

KNOWN_MODES = ("acquire", "far", "mid", "near", "terminal", "docked", "abort", "approach", "circle", "lineup")
"""Modes of the package's own pilots, numbered from 0; those of a user's pilot get the numbers after them."""
LANDING_MODES = ("search", "align", "descend", "touchdown")
"""Modes of the landing pilot, beside "approach", "docked" and "abort"."""
LEVELS = ("none", "lights", "tag", "fused")
"""What a landing's pose rests on."""

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
LANDING_COLOURS = (
    rgba(130, 130, 140),
    rgba(60, 160, 200),
    rgba(230, 160, 50),
    rgba(220, 110, 50),
)
LEVEL_COLOURS = (rgba(110, 110, 120), rgba(90, 130, 255), rgba(230, 200, 80), rgba(90, 200, 110))


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


class ModeFollower:
    """Numbers the modes of an episode and notices their changes."""

    def __init__(self, landing: bool = False) -> None:
        """Start before the first tick; `landing` tells what distances are from."""
        self._landing = landing
        self._numbers = {mode: number for number, mode in enumerate(KNOWN_MODES)}
        self._current: str | None = None

    def number(self, mode: str) -> int:
        """The mode's number; a mode never seen before gets the next free one."""
        return self._numbers.setdefault(mode, len(self._numbers))

    def follow(self, row: int, mode: str, ahead_m: float) -> ModeChange | None:
        """The change if `mode` is another than in the tick before, else None.

        Args:
            row: index of the tick within its batch.
            mode: the tick's mode.
            ahead_m: how far the nose is in front of the mouth along the station's axis, negative inside; in landing how
                far the seat is from its place.
        """
        if mode == self._current:
            return None
        where = f"{abs(ahead_m):.1f} m {'in front of' if ahead_m >= 0.0 else 'past'} the mouth"
        if self._landing:
            where = f"{ahead_m:.2f} m from the guides"
        text = f"{mode}, {where}" if self._current is None else f"{self._current} → {mode}, {where}"
        self._current = mode
        return ModeChange(row, mode, text)
