"""The kinds of station that recordings know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from auvdock.recording.conical import ConicalPart
from auvdock.recording.landing import LandingPart
from auvdock.recording.part import StationPart
from auvdock.recording.rotating import RotatingPart

if TYPE_CHECKING:
    from auvdock.episode.trace import EpisodeSetup

__all__ = ["PARTS", "part_of"]

PARTS: Mapping[str, Callable[[EpisodeSetup, Any], StationPart]] = {
    "conical": ConicalPart,
    "rotating": RotatingPart,
    "landing": LandingPart,
}
"""What makes the part of each of `auvdock.episode.stations.STATIONS`, from the setup and the station in it."""


def part_of(setup: EpisodeSetup) -> StationPart:
    """What the episode's station adds to its recording."""
    return PARTS[setup.kind](setup, setup.station)
