"""Guidance laws: line of sight with integral action, corridor, speed schedule and crab angle.

Everything is in approach axes: forward along the approach axis into the funnel, port and up across it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.linear_model import hydrodynamic_wrench
from auvdock.controllers.modes import ModeCfg
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive
from auvdock.core.vehicle import VehicleCfg
from auvdock.numeric.compiled import compiled
from auvdock.numeric.scalars import limited

__all__ = [
    "GuidanceCfg",
    "approach_speed",
    "axis_course",
    "axis_law",
    "corridor_m",
    "crab_angle",
    "crabbed",
    "ilos",
    "sway_reach_m_s",
]

# Places in the array that `axis_law` makes.
_CROSS, _MAX_CROSS, _SIGMA, _CORRIDOR, _CORRIDOR_FROM, _CORRIDOR_SLOPE = 0, 1, 2, 3, 4, 5
_ENTRY_SPEED, _MID_SPEED, _FAR_SPEED, _FAST_BEYOND, _TUBE_SPEED, _MOUTH, _GATE = 6, 7, 8, 9, 10, 11, 12
_RUSH_EXCESS, _RUSH_SPEED, _MIN_WAY, _STRAIGHTEN, _STRAIGHT_FROM, _FUNNEL = 13, 14, 15, 16, 17, 18
_MAX_CRAB, _MAX_ENTRY_CRAB, _VIEW, _REACH, _DT = 19, 20, 21, 22, 23


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


def axis_law(cfg: GuidanceCfg, modes: ModeCfg, funnel_length_m: float, reach_m_s: float, dt_s: float) -> Array:
    """What the compiled laws along the axis need, as one array.

    Args:
        cfg: speeds, lookahead, corridor, crab.
        modes: where mouth and gate are.
        funnel_length_m: from mouth to throat.
        reach_m_s: from `sway_reach_m_s`.
        dt_s: control period.
    """
    law = np.zeros(24)
    law[_CROSS], law[_MAX_CROSS], law[_SIGMA] = cfg.cross_speed_m_s, cfg.max_cross_speed_m_s, cfg.integral_gain
    law[_CORRIDOR], law[_CORRIDOR_FROM] = cfg.corridor_m, cfg.corridor_from_m
    law[_CORRIDOR_SLOPE] = cfg.corridor_slope
    law[_ENTRY_SPEED], law[_MID_SPEED], law[_FAR_SPEED] = cfg.entry_speed_m_s, cfg.mid_speed_m_s, cfg.far_speed_m_s
    law[_FAST_BEYOND], law[_TUBE_SPEED] = cfg.fast_beyond_m, cfg.tube_speed_m_s
    law[_MOUTH], law[_GATE] = modes.mouth_m, modes.gate_distance_m
    law[_RUSH_EXCESS], law[_RUSH_SPEED] = cfg.rush_excess_m_s, cfg.rush_speed_m_s
    law[_MIN_WAY], law[_STRAIGHTEN] = cfg.min_way_m_s, cfg.straighten_rad_m
    law[_STRAIGHT_FROM], law[_FUNNEL] = cfg.straight_share * funnel_length_m, funnel_length_m
    law[_MAX_CRAB], law[_MAX_ENTRY_CRAB], law[_VIEW] = cfg.max_crab_rad, cfg.max_entry_crab_rad, cfg.max_view_angle_rad
    law[_REACH], law[_DT] = reach_m_s, dt_s
    return law


@compiled
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


@compiled
def corridor_m(distance_m: float, law: Array) -> float:
    """Allowed distance from the axis when the nose is `distance_m` before the mouth; `law` is from `axis_law`."""
    return law[_CORRIDOR] + law[_CORRIDOR_SLOPE] * max(0.0, distance_m - law[_CORRIDOR_FROM])


@compiled
def approach_speed(distance_m: float, off_axis_m: float, law: Array) -> float:
    """Forward speed over ground with a pose; `law` is from `axis_law`.

    Full speed inside the corridor, falling to 0 at twice its width: the vehicle then closes in sideways first. Beyond
    `fast_beyond_m` the speed may rise by 0.2 m/s per metre, a deceleration of 0.1 to 0.2 m/s² on the way in.
    """
    entry, middle = law[_ENTRY_SPEED], law[_MID_SPEED]
    speed = entry + (middle - entry) * min(1.0, max(0.0, distance_m - 1.0))
    speed = max(speed, min(law[_FAR_SPEED], middle + 0.2 * (distance_m - law[_FAST_BEYOND])))
    return speed * min(1.0, max(0.0, 2.0 - off_axis_m / corridor_m(distance_m, law)))


@compiled
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


@compiled
def crabbed(
    forward_m_s: float,
    port_m_s: float,
    course_rad: float,
    crab_limit_rad: float,
    turn_rad: float,
    current_x_m_s: float,
    current_y_m_s: float,
    reach_m_s: float,
    view_low_rad: float,
    view_high_rad: float,
) -> tuple[float, float, float]:
    """A velocity over ground given along and across a world direction, and the hull's heading offset in it.

    Args:
        forward_m_s: along the course.
        port_m_s: across it.
        course_rad: compass direction of the course.
        crab_limit_rad: greatest crab angle; 0 leaves crab out.
        turn_rad: present heading relative to the course.
        current_x_m_s: of the current in world axes.
        current_y_m_s: of the current in world axes.
        reach_m_s: from `sway_reach_m_s`.
        view_low_rad: least offset of the heading, so that the lights stay in the image.
        view_high_rad: greatest offset.

    Returns:
        Surge and sway over ground at the present heading, and the wanted offset of the heading from the course.
    """
    cosine, sine = math.cos(course_rad), math.sin(course_rad)
    offset = 0.0
    if crab_limit_rad > 0.0:
        along = current_x_m_s * cosine + current_y_m_s * sine
        across = -current_x_m_s * sine + current_y_m_s * cosine
        offset = crab_angle(forward_m_s - along, port_m_s - across, reach_m_s, crab_limit_rad)
    offset = min(view_high_rad, max(view_low_rad, offset))
    cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
    return forward_m_s * cosine + port_m_s * sine, port_m_s * cosine - forward_m_s * sine, offset


@compiled
def axis_course(
    law: Array,
    distance_m: float,
    port_m: float,
    up_m: float,
    off_axis_m: float,
    axis_yaw_rad: float,
    port_integral: float,
    up_integral: float,
    hold: bool,
    committed: bool,
    lookahead_m: float,
    turn_rad: float,
    current_x_m_s: float,
    current_y_m_s: float,
) -> tuple[float, float, float, float, float, float]:
    """Along the approach axis: integral line of sight sideways and vertically, hull aligned but for crab.

    Cross-track speeds are U sin χ with χ from `ilos`; the forward speed is `approach_speed`, 0 while `hold`. Crab fades
    from `max_crab_rad` at the mouth to `max_entry_crab_rad` at the throat. A cross-current beyond the sway thrusters'
    reach raises the speed once `committed`: at more speed the same current needs less crab.

    Args:
        law: from `axis_law`.
        distance_m: nose before the mouth.
        port_m: nose to port of the axis.
        up_m: nose above the axis.
        off_axis_m: nose from the axis.
        axis_yaw_rad: compass heading straight in.
        port_integral: of the line of sight sideways.
        up_integral: of the line of sight vertically.
        hold: wait at the gate.
        committed: past the gate.
        lookahead_m: Δ.
        turn_rad: heading relative to the axis.
        current_x_m_s: of the current in world axes.
        current_y_m_s: of the current in world axes.

    Returns:
        Surge, sway and heave over ground in m/s, offset of the heading from the axis, the two new integrals.
    """
    port_angle, port_after = ilos(port_m, port_integral, lookahead_m, law[_SIGMA], law[_DT])
    up_angle, up_after = ilos(up_m, up_integral, lookahead_m, law[_SIGMA], law[_DT])
    # Integral action is for what is left on the axis: not for the way there, nor for what the funnel's walls do.
    if distance_m < 0.0 or off_axis_m > law[_CORRIDOR]:
        port_after, up_after = port_integral, up_integral
    port = limited(law[_CROSS] * math.sin(port_angle), law[_MAX_CROSS])
    up = limited(law[_CROSS] * math.sin(up_angle), law[_MAX_CROSS])
    forward = approach_speed(distance_m, off_axis_m, law)
    if distance_m < law[_MOUTH]:
        forward = law[_TUBE_SPEED] if distance_m < -law[_FUNNEL] else law[_ENTRY_SPEED]
    elif hold:
        forward = limited(0.3 * (distance_m - law[_GATE]), 0.2)
    across = abs(current_y_m_s * math.cos(axis_yaw_rad) - current_x_m_s * math.sin(axis_yaw_rad))
    excess = min(1.0, max(0.0, (across - law[_REACH]) / law[_RUSH_EXCESS]))
    if excess > 0.0 and committed:
        forward += excess * (law[_RUSH_SPEED] - forward)
    elif excess > 0.0 and not hold:  # without way on, the hull could not hold its place by crabbing
        forward = max(forward, excess * law[_MIN_WAY])
    # The hull turns straight on its way through the funnel.
    turning = law[_STRAIGHTEN] * max(0.0, distance_m + law[_STRAIGHT_FROM])
    limit = min(law[_MAX_CRAB], law[_MAX_ENTRY_CRAB] + turning)
    bearing, view = 0.0, math.pi
    if distance_m > 1.0:
        bearing, view = math.atan2(-port_m, distance_m), law[_VIEW]
    surge, sway, offset = crabbed(
        forward,
        port,
        axis_yaw_rad,
        limit,
        turn_rad,
        current_x_m_s,
        current_y_m_s,
        law[_REACH],
        bearing - view,
        bearing + view,
    )
    return surge, sway, up, offset, port_after, up_after


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
