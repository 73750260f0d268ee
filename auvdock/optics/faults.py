"""Faults of a landing station for tests: lights that are dead, and a tag that something covers for a while."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative

__all__ = ["FaultCfg", "TagCover", "dead_indices"]


@dataclass(frozen=True)
class FaultCfg(Checked):
    """What is broken; nothing by default."""

    tag_hidden_from_s: NotNegative | None = None
    """Time from which the tag is covered; None for no such time."""
    tag_hidden_below_m: NotNegative | None = None
    """Height of the camera above the tag at which, when first reached, the tag is covered; None for no such height."""
    tag_hidden_for_s: NotNegative = 2.0
    """How long the tag stays covered."""
    dead_lights: tuple[str, ...] = ()
    """Names of the station's lights that do not shine."""


class TagCover:
    """Whether the tag is covered, frame by frame."""

    def __init__(self, cfg: FaultCfg) -> None:
        """Nothing has happened yet."""
        self._cfg = cfg
        self.reset()

    def reset(self) -> None:
        """Start an episode."""
        self._reached_s: float | None = None

    def hidden(self, height_m: float, time_s: float) -> bool:
        """Whether it is now, with the camera at a height above the tag; remembers when the height was reached."""
        cfg = self._cfg
        if self._reached_s is None and cfg.tag_hidden_below_m is not None and height_m <= cfg.tag_hidden_below_m:
            self._reached_s = time_s
        starts = (cfg.tag_hidden_from_s, self._reached_s)
        return any(start is not None and start <= time_s < start + cfg.tag_hidden_for_s for start in starts)


def dead_indices(layout: BeaconLayout, names: tuple[str, ...]) -> IntArray:
    """Indices of the named lights.

    Raises:
        ConfigError: the station has no light of that name.
    """
    known = [beacon.name for beacon in layout.beacons]
    for name in names:
        if name not in known:
            raise ConfigError("dead_lights", name, f"one of {', '.join(known)}")
    return np.array([known.index(name) for name in names], dtype=np.int64)
