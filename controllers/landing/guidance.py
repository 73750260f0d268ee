"""From where the vehicle is above the station to the speeds that it should have."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive

__all__ = ["Flat", "LandingGuidanceCfg", "Place", "corridor_m", "sink_m_s", "station_keeping"]

Flat = tuple[float, float]
"""Horizontal vector: east-like and north-like compass axes, or along and across the station."""


@dataclass(frozen=True)
class LandingGuidanceCfg(Checked):
    """Speeds, corridor and station keeping; all values are ours."""

    position_gain_1_s: Positive = 0.7
    """Station keeping: speed per metre of offset, a third of the velocity loops' crossover."""
    integral_gain_1_s2: Positive = 0.01
    """Station keeping: speed per metre and second of offset, against what the velocity loops leave of the current."""
    integral_zone_m: Positive = 0.1
    """Offsets beyond this are not integrated."""
    max_integral_m_s: Positive = 0.03
    """Greatest speed that the integral may ask for."""
    approach_speed_m_s: Positive = 0.3
    """Greatest horizontal speed on the way to the station."""
    align_speed_m_s: Positive = 0.15
    """Greatest horizontal speed above it."""
    touchdown_speed_m_s: Positive = 0.05
    """Greatest horizontal speed between the guides, where the hull may already touch."""
    height_gain_1_s: Positive = 0.5
    """Vertical speed per metre of height error when a height is held."""
    climb_speed_m_s: Positive = 0.25
    """Greatest vertical speed, up or down, apart from the descent."""
    sink_gain_1_s: Positive = 0.3
    """Descent: sink speed per metre of height above the seat."""
    max_sink_m_s: Positive = 0.25
    """Greatest sink speed (paper C gives none)."""
    touchdown_sink_m_s: Positive = 0.07
    """Sink speed onto the guides, the least of the descent."""
    corridor_m: Positive = 0.03
    """Half width of the corridor at touchdown: inside what the latch can catch."""
    corridor_slope: Positive = 0.12
    """The corridor widens by this with height."""
    max_corridor_m: Positive = 0.3
    """Greatest half width."""

    def __post_init__(self) -> None:
        """Refuse a descent that does not slow down, or a corridor that narrows with height."""
        if self.touchdown_sink_m_s > self.max_sink_m_s:
            raise ConfigError("touchdown_sink_m_s", self.touchdown_sink_m_s, "at most max_sink_m_s")
        if self.corridor_m > self.max_corridor_m:
            raise ConfigError("corridor_m", self.corridor_m, "at most max_corridor_m")


class Place(NamedTuple):
    """Where the vehicle's seat is relative to its place in the guides: paper C's ξ, η, ζ and ψ, station axes.

    Attributes:
        ahead_m: ξ, towards the station's head.
        port_m: η, to the station's port side.
        height_m: ζ, upwards.
        heading_rad: ψ, of the hull from the station's axis, positive to port.
    """

    ahead_m: float
    port_m: float
    height_m: float
    heading_rad: float

    @property
    def offset_m(self) -> float:
        """Horizontal distance."""
        return math.hypot(self.ahead_m, self.port_m)


def corridor_m(height_m: float, cfg: LandingGuidanceCfg) -> float:
    """Half width of the vertical corridor at a height above the seat: r₀ + slope h, bounded."""
    return min(cfg.max_corridor_m, cfg.corridor_m + cfg.corridor_slope * max(0.0, height_m))


def sink_m_s(place: Place, cfg: LandingGuidanceCfg) -> float:
    """Sink speed of the descent, 0 or more.

    w = clip(k h, w_touchdown, w_max) × clip(2 (1 − offset/corridor), 0, 1): full speed in the inner half of the
    corridor, none at its edge.
    """
    speed = min(cfg.max_sink_m_s, max(cfg.touchdown_sink_m_s, cfg.sink_gain_1_s * place.height_m))
    margin = 2.0 * (1.0 - place.offset_m / corridor_m(place.height_m, cfg))
    return speed * min(1.0, max(0.0, margin))


def station_keeping(
    error_m: Flat, integral_m_s: Flat, max_speed_m_s: float, cfg: LandingGuidanceCfg, dt_s: float
) -> tuple[Flat, Flat]:
    """Horizontal velocity over ground that brings the vehicle to a point: v = k_p e + I, |v| bounded, İ = k_i e.

    The direction of v is kept when it is shortened. The integral stands still far from the point (integral separation)
    and while v is at its bound.

    Args:
        error_m: the point minus where the vehicle is, in axes that do not turn.
        integral_m_s: I so far, same axes.
        max_speed_m_s: bound.
        cfg: gains.
        dt_s: control period.

    Returns:
        The velocity and the new integral.
    """
    x, y = error_m
    ix, iy = integral_m_s
    vx, vy = cfg.position_gain_1_s * x + ix, cfg.position_gain_1_s * y + iy
    speed = math.hypot(vx, vy)
    if speed > max_speed_m_s:
        return (vx * max_speed_m_s / speed, vy * max_speed_m_s / speed), integral_m_s
    if math.hypot(x, y) < cfg.integral_zone_m:
        step = cfg.integral_gain_1_s2 * dt_s
        ix, iy = ix + step * x, iy + step * y
        size = math.hypot(ix, iy)
        if size > cfg.max_integral_m_s:
            ix, iy = ix * cfg.max_integral_m_s / size, iy * cfg.max_integral_m_s / size
    return (vx, vy), (ix, iy)
