"""Looking for the station from above: hold, climb, and spiral around the place where it was last thought to be.

Two spirals grow by turns, one high, one low: in turbid water the marks are seen only from near by.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive

__all__ = ["SpiralCfg", "spiral", "spiral_pass"]


@dataclass(frozen=True)
class SpiralCfg(Checked):
    """The search pattern; all values are ours."""

    settle_s: NotNegative = 2.0
    """Wait on the spot before the first turn: perception needs some frames."""
    height_m: Positive = 4.5
    """The seat is taken at least so high above its place on the station: the view widens with height."""
    high_s: Positive = 60.0
    """Time on the high spiral, at that height, before the low one has its turn."""
    low_s: Positive = 30.0
    """Time on the low one, at the least height that is allowed without a pose."""
    climb_m_s: Positive = 0.2
    """Vertical speed between them."""
    pitch_m: Positive = 1.2
    """Distance between two turns of the spiral."""
    speed_m_s: Positive = 0.25
    """Speed along it."""
    max_radius_m: Positive = 5.0
    """The spiral ends in a circle of this radius."""


def spiral_pass(time_s: float, cfg: SpiralCfg) -> tuple[bool, float]:
    """Whether the high spiral has its turn at a time since the search began, and for how long that spiral was flown."""
    turns, rest_s = divmod(max(0.0, time_s), cfg.high_s + cfg.low_s)
    if rest_s < cfg.high_s:
        return True, turns * cfg.high_s + rest_s
    return False, turns * cfg.low_s + rest_s - cfg.high_s


def spiral(time_s: float, cfg: SpiralCfg) -> tuple[float, float]:
    """Where to be on the spiral, relative to its centre, m.

    An Archimedean spiral r = p θ/2π flown at speed v has the arc s ≈ p θ²/4π = v t, hence θ = √(4π v t/p); beyond the
    greatest radius R it goes on as a circle with θ̇ = v/R.

    Args:
        time_s: time for which this spiral was flown.
        cfg: the pattern.
    """
    flown_s = max(0.0, time_s - cfg.settle_s)
    last_rad = math.tau * cfg.max_radius_m / cfg.pitch_m
    last_s = cfg.pitch_m * last_rad**2 / (4.0 * math.pi * cfg.speed_m_s)
    if flown_s <= last_s:
        angle = math.sqrt(4.0 * math.pi * cfg.speed_m_s * flown_s / cfg.pitch_m)
        radius = cfg.pitch_m * angle / math.tau
    else:
        angle = last_rad + (flown_s - last_s) * cfg.speed_m_s / cfg.max_radius_m
        radius = cfg.max_radius_m
    return radius * math.cos(angle), radius * math.sin(angle)
