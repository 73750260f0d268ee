"""Guidance laws: line of sight with integral action, corridor, speed schedule and crab angle.

Everything is in approach axes: forward along the approach axis into the funnel, port and up across it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.linear_model import hydrodynamic_wrench
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import VehicleCfg

__all__ = ["GuidanceCfg", "approach_speed", "corridor_m", "crab_angle", "ilos", "sway_reach_m_s"]


@dataclass(frozen=True)
class GuidanceCfg:
    """Speeds, lookahead and corridor of the approach."""

    far_speed_m_s: float = 0.9
    """Speed over ground towards the long-range lamp."""
    mid_speed_m_s: float = 0.5
    """Speed over ground on the axis with a pose (paper A: 0.5 m/s)."""
    entry_speed_m_s: float = 0.5
    """Speed over ground through mouth and throat."""
    tube_speed_m_s: float = 0.3
    """Speed over ground past the throat, where the latch will catch the vehicle."""
    back_speed_m_s: float = 0.4
    """Speed over ground while backing off."""
    fast_beyond_m: float = 8.0
    """With a pose, farther from the mouth than this the speed rises towards `far_speed_m_s`."""
    cross_speed_m_s: float = 0.5
    """Speed U of the cross-track law: the vehicle moves across the axis at U sin χ."""
    max_cross_speed_m_s: float = 0.3
    """Greatest speed across the axis."""
    lookahead_mid_m: float = 1.8
    """Lookahead Δ with a pose."""
    lookahead_near_m: float = 1.2
    """Lookahead Δ at the mouth."""
    integral_gain: float = 0.08
    """σ of the integral line of sight, in 1/s against an integral in m s; 0 turns integral action off."""
    assumed_range_m: float = 15.0
    """Range at which the long-range lamp's height above the axis is allowed for while no range is known."""
    sight_smoothing: float = 0.08
    """Weight of a new bearing against the smoothed one: 0.08 at 30 Hz averages over some 0.4 s."""
    max_vertical_speed_m_s: float = 0.3
    """Greatest vertical speed towards a bearing."""
    corridor_m: float = 0.3
    """Allowed distance from the axis at the mouth and up to `corridor_from_m` before it."""
    corridor_from_m: float = 3.0
    """Where the corridor begins to widen."""
    corridor_slope: float = 0.35
    """How fast it widens with distance."""
    sway_share: float = 0.8
    """Part of the lateral actuators' range that may go into holding against a cross-current before the hull crabs."""
    max_crab_rad: float = 0.5
    """Greatest crab angle up to the mouth."""
    max_entry_crab_rad: float = 0.08
    """Greatest crab angle at the throat; the latch allows 10°."""
    straighten_rad_m: float = 0.25
    """How fast the crab angle falls along the last way in."""
    straight_share: float = 0.4
    """Part of the funnel after which the hull shall be straight."""
    rush_speed_m_s: float = 0.85
    """Speed over ground through the mouth in a cross-current beyond the sway thrusters' reach."""
    min_way_m_s: float = 0.35
    """Least forward speed on the axis in such a current, outside the corridor too."""
    rush_excess_m_s: float = 0.15
    """Cross-current beyond reach at which the speed is risen to that."""
    max_view_angle_rad: float = 0.5
    """The hull turns towards the mouth as far as needed to keep it within this angle of the bow."""

    def __post_init__(self) -> None:
        """All are positive, but for the integral gain."""
        for name, value in vars(self).items():
            if name == "integral_gain":
                if value < 0.0:
                    raise ConfigError(f"control.guidance.{name}", value, "a gain of 0 or more")
            elif not value > 0.0:
                raise ConfigError(f"control.guidance.{name}", value, "a value above 0")


def ilos(error_m: float, integral: float, lookahead_m: float, sigma: float, dt_s: float) -> tuple[float, float]:
    """Integral line of sight towards a straight path.

    χ = −atan((e + σ I)/Δ),  İ = Δ e / ((e + σ I)² + Δ²)
    (Børhaug, Pavlov and Pettersen 2008, equations 10 and 11; Fossen 2011, section 10.3). The denominator slows the
    integral down where the error is large: it is its own anti-windup.

    Args:
        error_m: signed distance from the path.
        integral: I so far; with Δ in m and t in s its unit is s, σ carries m/s.
        lookahead_m: Δ.
        sigma: σ.
        dt_s: period.

    Returns:
        Course angle χ relative to the path in rad, and the new integral.
    """
    pulled = error_m + sigma * integral
    rate = lookahead_m * error_m / (pulled * pulled + lookahead_m * lookahead_m)
    return -math.atan2(pulled, lookahead_m), integral + rate * dt_s


def corridor_m(distance_m: float, cfg: GuidanceCfg) -> float:
    """Allowed distance from the axis when the nose is `distance_m` before the mouth."""
    return cfg.corridor_m + cfg.corridor_slope * max(0.0, distance_m - cfg.corridor_from_m)


def approach_speed(distance_m: float, off_axis_m: float, cfg: GuidanceCfg) -> float:
    """Forward speed over ground with a pose.

    Full speed inside the corridor, falling to 0 at twice its width: the vehicle then closes in sideways first. Beyond
    `fast_beyond_m` the speed may rise by 0.2 m/s per metre, a deceleration of 0.1 to 0.2 m/s² on the way in.
    """
    speed = cfg.entry_speed_m_s + (cfg.mid_speed_m_s - cfg.entry_speed_m_s) * min(1.0, max(0.0, distance_m - 1.0))
    speed = max(speed, min(cfg.far_speed_m_s, cfg.mid_speed_m_s + 0.2 * (distance_m - cfg.fast_beyond_m)))
    allowed = corridor_m(distance_m, cfg)
    return speed * min(1.0, max(0.0, 2.0 - off_axis_m / allowed))


def sway_reach_m_s(vehicle: VehicleCfg, allocator: ThrustAllocator, surge_m_s: float, share: float) -> float:
    """Sideways speed through the water that lateral actuators can hold with `share` of their range.

    Solves max |c(v)| = share for v by bisection, c(v) being the commands that balance the hull's sideways drag and lift
    and its yaw moment at (surge, v): the Munk moment loads one thruster more than the other, so force alone will not
    do for a measure.
    """

    def load(sway_m_s: float) -> float:
        water = hydrodynamic_wrench(vehicle, np.array([surge_m_s, sway_m_s, 0.0, 0.0, 0.0, 0.0]))
        wanted = np.array([0.0, -water[1], 0.0, 0.0, 0.0, -water[5]]) / share
        _, given = allocator.solve(wanted, surge_m_s)
        return float(np.abs(wanted - given).max())

    low, high = 0.0, 2.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if load(middle) < 1e-6 else (low, middle)
    return low


def crab_angle(forward_m_s: float, port_m_s: float, reach_m_s: float, limit_rad: float) -> float:
    """Angle by which the hull turns to port of the axis so that sway through the water stays within reach.

    The wanted velocity through the water is (forward, port). With the hull at angle β its sway part is
    port cos β − forward sin β; |β| is the smallest that brings this within ± reach:
    β = atan2(port, forward) − asin(reach/speed).
    """
    if abs(port_m_s) <= reach_m_s:
        return 0.0
    speed = math.hypot(forward_m_s, port_m_s)
    beta = math.atan2(abs(port_m_s), max(forward_m_s, 0.05)) - math.asin(min(1.0, reach_m_s / speed))
    return math.copysign(min(limit_rad, max(0.0, beta)), port_m_s)
