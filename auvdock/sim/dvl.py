"""The Doppler log as a device: it pings now and then, loses pings, and sees no floor that is too near.

Between good pings it gives out what it last measured, and how old that is. Without a bottom lock but with water track
the velocity over ground is that through the water and the current that both last gave together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, between
from auvdock.core.transforms import rotation_from_euler_zyx

__all__ = ["Dvl", "DvlCfg", "DvlReading"]

_ROUNDING_S = 1e-9


@dataclass(frozen=True)
class DvlCfg(Checked):
    """When the log measures; by default with every sample."""

    ping_period_s: NotNegative = 0.0
    """Time between pings; 0 for one with every sample of the sensors."""
    lost_share: Annotated[float, between(0.0, 0.95)] = 0.0
    """Share of the pings that are lost, each by itself: neither bottom lock nor water track."""
    blind_below_m: NotNegative = 0.0
    """Nearer than this to what lies below it, the log has no bottom lock."""


class DvlReading(NamedTuple):
    """What the log gives out.

    Attributes:
        ground_m_s: (3,) velocity over ground, body axes.
        water_m_s: (3,) velocity through the water, body axes.
        ground_age_s: time since the last bottom lock.
        water_age_s: time since the last good ping.
    """

    ground_m_s: Array
    water_m_s: Array
    ground_age_s: float
    water_age_s: float


class Dvl:
    """Decides which readings become known; call `reset` first."""

    def __init__(self, cfg: DvlCfg) -> None:
        """Keep the settings."""
        self._cfg = cfg
        self._always = cfg == DvlCfg()

    def reset(self, rng: np.random.Generator) -> None:
        """Start an episode: the log has been running, so that the first sample is a good ping; `rng` is its own."""
        self._rng = rng
        self._next_s: float | None = None
        self._ground_s = self._water_s = 0.0
        self._ground_level, self._water_level, self._current_level = (np.zeros(3) for _ in range(3))

    def sample(
        self, time_s: float, height_m: float, euler_zyx_rad: Array, ground_m_s: Array, water_m_s: Array
    ) -> DvlReading:
        """What is given out at a sample of the sensors.

        Args:
            time_s: of the sample, not before that of the one before.
            height_m: of the log above what lies below it.
            euler_zyx_rad: (3,) attitude by the vehicle's own sensors: what is held is held in level compass axes.
            ground_m_s: (3,) what a bottom lock would read now, body axes.
            water_m_s: (3,) what the water track would read now.
        """
        if self._always:
            return DvlReading(ground_m_s, water_m_s, 0.0, 0.0)
        rotation = rotation_from_euler_zyx(*euler_zyx_rad.tolist())
        first = self._next_s is None
        if self._is_good_ping(time_s):
            self._water_level, self._water_s = rotation @ water_m_s, time_s
            if first or height_m >= self._cfg.blind_below_m:
                self._ground_level, self._ground_s = rotation @ ground_m_s, time_s
                self._current_level = self._ground_level - self._water_level
            else:
                self._ground_level = self._water_level + self._current_level
        if self._water_s == time_s and self._ground_s == time_s:
            return DvlReading(ground_m_s, water_m_s, 0.0, 0.0)
        return DvlReading(
            self._ground_level @ rotation, self._water_level @ rotation, time_s - self._ground_s, time_s - self._water_s
        )

    def _is_good_ping(self, time_s: float) -> bool:
        """Whether a ping falls on this sample and is not lost; the first one never is."""
        if self._next_s is None:
            self._next_s = time_s + self._cfg.ping_period_s
            return True
        if time_s < self._next_s - _ROUNDING_S:
            return False
        period_s = self._cfg.ping_period_s
        if period_s > 0.0:
            self._next_s += period_s * (math.floor((time_s - self._next_s + _ROUNDING_S) / period_s) + 1)
        return float(self._rng.random()) >= self._cfg.lost_share
