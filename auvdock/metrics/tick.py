"""One control period as metrics and observers see it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from auvdock.core.arrays import Image
from auvdock.core.contracts import Command, Percept, Proprioception
from auvdock.sim.truth import Truth

__all__ = ["Metrics", "Tick"]


@dataclass(frozen=True, eq=False)
class Tick:
    """One control period.

    Attributes:
        truth: the simulator's state; for the log only, the pilot never sees it.
        proprioception: what the vehicle's own sensors said.
        image: (H, W, 3) uint8 RGB if a frame was rendered in this period, else None.
        percept: what perception made of this period's frame, None if there was no frame.
        command: what the pilot gave.
    """

    truth: Truth
    proprioception: Proprioception
    image: Image | None
    percept: Percept | None
    command: Command


class Metrics(Protocol):
    """Gathers some of an episode's metrics tick by tick."""

    def add(self, tick: Tick) -> None:
        """Take in one control period."""
        ...

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """What it found, named as in `EpisodeResult`; what nobody fills keeps None."""
        ...
