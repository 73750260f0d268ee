"""Settings of guidance, and how fast the vehicle can hold itself sideways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.linear_model import hydrodynamic_wrench
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive
from auvdock.core.vehicle import VehicleCfg

__all__ = ["GuidanceCfg", "sway_reach_m_s"]


@dataclass(frozen=True)
class GuidanceCfg(Checked):
    """Speeds, lookahead and corridor of the approach."""

    far_speed_m_s: Positive = 0.9
    """Speed over ground towards the long-range lamp."""
    mid_speed_m_s: Positive = 0.5
    """Speed over ground on the axis with a pose (paper A: 0.5 m/s)."""
    entry_speed_m_s: Positive = 0.5
    """Speed over ground through mouth and throat."""
    tube_speed_m_s: Positive = 0.3
    """Speed over ground past the throat, where the latch will catch the vehicle."""
    back_speed_m_s: Positive = 0.4
    """Speed over ground while backing off."""
    fast_beyond_m: Positive = 8.0
    """With a pose, farther from the mouth than this the speed rises towards `far_speed_m_s`."""
    cross_speed_m_s: Positive = 0.5
    """Speed U of the cross-track law: the vehicle moves across the axis at U sin χ."""
    max_cross_speed_m_s: Positive = 0.3
    """Greatest speed across the axis."""
    lookahead_mid_m: Positive = 1.8
    """Lookahead Δ with a pose."""
    lookahead_near_m: Positive = 1.2
    """Lookahead Δ at the mouth."""
    integral_gain: NotNegative = 0.08
    """σ of the integral line of sight, in 1/s against an integral in m s; 0 turns integral action off."""
    assumed_range_m: Positive = 15.0
    """Range at which the long-range lamp's height above the axis is allowed for while no range is known."""
    sight_smoothing: Positive = 0.08
    """Weight of a new bearing against the smoothed one: 0.08 at 30 Hz averages over some 0.4 s."""
    max_vertical_speed_m_s: Positive = 0.3
    """Greatest vertical speed towards a bearing."""
    corridor_m: Positive = 0.3
    """Allowed distance from the axis at the mouth and up to `corridor_from_m` before it."""
    corridor_from_m: Positive = 3.0
    """Where the corridor begins to widen."""
    corridor_slope: Positive = 0.35
    """How fast it widens with distance."""
    sway_share: Positive = 0.8
    """Part of the lateral actuators' range that may go into holding against a cross-current before the hull crabs."""
    max_crab_rad: Positive = 0.5
    """Greatest crab angle up to the mouth."""
    max_entry_crab_rad: Positive = 0.08
    """Greatest crab angle at the throat; the latch allows 10°."""
    straighten_rad_m: Positive = 0.25
    """How fast the crab angle falls along the last way in."""
    straight_share: Positive = 0.4
    """Part of the funnel after which the hull shall be straight."""
    rush_speed_m_s: Positive = 0.85
    """Speed over ground through the mouth in a cross-current beyond the sway thrusters' reach."""
    min_way_m_s: Positive = 0.35
    """Least forward speed on the axis in such a current, outside the corridor too."""
    rush_excess_m_s: Positive = 0.15
    """Cross-current beyond reach at which the speed is risen to that."""
    max_view_angle_rad: Positive = 0.5
    """The hull turns towards the mouth as far as needed to keep it within this angle of the bow."""


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
