"""Guidance laws along the axis, compiled: line of sight with integral action, corridor, speed schedule and crab angle.

Everything is in approach axes: forward along the approach axis into the funnel, port and up across it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

from auvdock.controllers.guidance import GuidanceCfg
from auvdock.controllers.modes import ModeCfg
from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.numeric.scalars import Vector, limited

__all__ = [
    "AxisLaw",
    "Course",
    "Place",
    "approach_speed",
    "axis_course",
    "axis_law",
    "corridor_m",
    "crab",
    "crab_angle",
    "ilos",
]


@dataclass(frozen=True)
class AxisLaw(Record):
    """What the compiled laws along the axis need; where no unit is told, `GuidanceCfg` explains the name."""

    cross_speed_m_s: float
    max_cross_speed_m_s: float
    integral_gain: float
    corridor_m: float
    corridor_from_m: float
    corridor_slope: float
    entry_speed_m_s: float
    mid_speed_m_s: float
    far_speed_m_s: float
    fast_beyond_m: float
    tube_speed_m_s: float
    rush_excess_m_s: float
    rush_speed_m_s: float
    min_way_m_s: float
    straighten_rad_m: float
    max_crab_rad: float
    max_entry_crab_rad: float
    max_view_angle_rad: float
    mouth_m: float
    """`ModeCfg.mouth_m`."""
    gate_m: float
    """`ModeCfg.gate_distance_m`."""
    funnel_m: float
    """From mouth to throat."""
    straight_from_m: float
    """Behind the mouth by so much the hull shall be straight."""
    reach_m_s: float
    """From `sway_reach_m_s`."""
    dt_s: float
    """Control period."""


class Place(NamedTuple):
    """The nose before the mouth in approach axes (forward into the funnel, port, up).

    Attributes:
        distance_m: before the mouth; negative inside.
        port_m: to port of the axis.
        up_m: above the axis.
        axis_yaw_rad: compass heading of a vehicle that flies straight in.
        offset_rad: heading relative to that, positive to port.
        off_axis_m: distance from the axis.
    """

    distance_m: float
    port_m: float
    up_m: float
    axis_yaw_rad: float
    offset_rad: float
    off_axis_m: float


class Course(NamedTuple):
    """A velocity over ground at the present heading, and where to head.

    Attributes:
        surge_m_s: ahead.
        sway_m_s: to port.
        offset_rad: wanted heading less the course, positive to port.
    """

    surge_m_s: float
    sway_m_s: float
    offset_rad: float


def axis_law(
    cfg: GuidanceCfg, modes: ModeCfg, funnel_length_m: float, reach_m_s: float, dt_s: float
) -> Records[AxisLaw]:
    """(1,) what the compiled laws along the axis need.

    Args:
        cfg: speeds, lookahead, corridor, crab.
        modes: where mouth and gate are.
        funnel_length_m: from mouth to throat.
        reach_m_s: from `sway_reach_m_s`.
        dt_s: control period.
    """
    same = {part.name: getattr(cfg, part.name) for part in fields(AxisLaw) if hasattr(cfg, part.name)}
    return AxisLaw(
        **same,
        mouth_m=modes.mouth_m,
        gate_m=modes.gate_distance_m,
        funnel_m=funnel_length_m,
        straight_from_m=cfg.straight_share * funnel_length_m,
        reach_m_s=reach_m_s,
        dt_s=dt_s,
    ).packed()


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
def corridor_m(distance_m: float, law: Records[AxisLaw]) -> float:
    """Allowed distance from the axis when the nose is `distance_m` before the mouth."""
    return law[0].corridor_m + law[0].corridor_slope * max(0.0, distance_m - law[0].corridor_from_m)


@compiled
def approach_speed(distance_m: float, off_axis_m: float, law: Records[AxisLaw]) -> float:
    """Forward speed over ground with a pose.

    Full speed inside the corridor, falling to 0 at twice its width: the vehicle then closes in sideways first. Beyond
    `fast_beyond_m` the speed may rise by 0.2 m/s per metre, a deceleration of 0.1 to 0.2 m/s² on the way in.
    """
    cfg = law[0]
    speed = cfg.entry_speed_m_s + (cfg.mid_speed_m_s - cfg.entry_speed_m_s) * min(1.0, max(0.0, distance_m - 1.0))
    speed = max(speed, min(cfg.far_speed_m_s, cfg.mid_speed_m_s + 0.2 * (distance_m - cfg.fast_beyond_m)))
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
def crab(
    forward_m_s: float,
    port_m_s: float,
    course_rad: float,
    limit_rad: float,
    turn_rad: float,
    current_m_s: Array,
    reach_m_s: float,
    view_rad: tuple[float, float],
) -> Course:
    """Fly a velocity over ground given along and across a world direction, the hull turned into the current.

    Args:
        forward_m_s: along the course.
        port_m_s: across it.
        course_rad: compass direction of the course.
        limit_rad: greatest crab angle; 0 leaves crab out.
        turn_rad: present heading relative to the course.
        current_m_s: (3,) in world axes.
        reach_m_s: from `sway_reach_m_s`.
        view_rad: least and greatest offset of the heading, so that the lights stay in the image.
    """
    cosine, sine = math.cos(course_rad), math.sin(course_rad)
    offset = 0.0
    if limit_rad > 0.0:
        along = current_m_s[0] * cosine + current_m_s[1] * sine
        across = -current_m_s[0] * sine + current_m_s[1] * cosine
        offset = crab_angle(forward_m_s - along, port_m_s - across, reach_m_s, limit_rad)
    offset = min(view_rad[1], max(view_rad[0], offset))
    cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
    return Course(forward_m_s * cosine + port_m_s * sine, port_m_s * cosine - forward_m_s * sine, offset)


@compiled
def axis_course(
    law: Records[AxisLaw],
    place: tuple[float, float, float, float, float, float],
    integrals: tuple[float, float],
    hold: bool,
    committed: bool,
    lookahead_m: float,
    turn_rad: float,
    current_m_s: Array,
) -> tuple[Vector, float, tuple[float, float]]:
    """Along the approach axis: integral line of sight sideways and vertically, hull aligned but for crab.

    Cross-track speeds are U sin χ with χ from `ilos`; the forward speed is `approach_speed`, 0 while `hold`. Crab fades
    from `max_crab_rad` at the mouth to `max_entry_crab_rad` at the throat. A cross-current beyond the sway thrusters'
    reach raises the speed once `committed`: at more speed the same current needs less crab.

    Args:
        law: (1,) from `axis_law`.
        place: the fields of a `Place`; a named tuple would cost half a microsecond more to hand over.
        integrals: of the line of sight, port and up.
        hold: wait at the gate.
        committed: past the gate.
        lookahead_m: Δ.
        turn_rad: heading relative to the axis.
        current_m_s: (3,) in world axes.

    Returns:
        Velocity over ground in m/s, ahead, to port and up; wanted heading less the axis' in rad, positive to port; and
        the integrals after this period.
    """
    nose, cfg = Place(*place), law[0]
    distance_m, axis_yaw_rad = nose.distance_m, nose.axis_yaw_rad
    port_angle, port_after = ilos(nose.port_m, integrals[0], lookahead_m, cfg.integral_gain, cfg.dt_s)
    up_angle, up_after = ilos(nose.up_m, integrals[1], lookahead_m, cfg.integral_gain, cfg.dt_s)
    # Integral action is for what is left on the axis: not for the way there, nor for what the funnel's walls do.
    if distance_m < 0.0 or nose.off_axis_m > cfg.corridor_m:
        port_after, up_after = integrals
    port = limited(cfg.cross_speed_m_s * math.sin(port_angle), cfg.max_cross_speed_m_s)
    up = limited(cfg.cross_speed_m_s * math.sin(up_angle), cfg.max_cross_speed_m_s)
    forward = approach_speed(distance_m, nose.off_axis_m, law)
    if distance_m < cfg.mouth_m:
        forward = cfg.tube_speed_m_s if distance_m < -cfg.funnel_m else cfg.entry_speed_m_s
    elif hold:
        forward = limited(0.3 * (distance_m - cfg.gate_m), 0.2)
    across = abs(current_m_s[1] * math.cos(axis_yaw_rad) - current_m_s[0] * math.sin(axis_yaw_rad))
    excess = min(1.0, max(0.0, (across - cfg.reach_m_s) / cfg.rush_excess_m_s))
    if excess > 0.0 and committed:
        forward += excess * (cfg.rush_speed_m_s - forward)
    elif excess > 0.0 and not hold:  # without way on, the hull could not hold its place by crabbing
        forward = max(forward, excess * cfg.min_way_m_s)
    # The hull turns straight on its way through the funnel.
    turning = cfg.straighten_rad_m * max(0.0, distance_m + cfg.straight_from_m)
    limit = min(cfg.max_crab_rad, cfg.max_entry_crab_rad + turning)
    bearing, view = 0.0, math.pi
    if distance_m > 1.0:
        bearing, view = math.atan2(-nose.port_m, distance_m), cfg.max_view_angle_rad
    window = bearing - view, bearing + view
    course = crab(forward, port, axis_yaw_rad, limit, turn_rad, current_m_s, cfg.reach_m_s, window)
    return (course.surge_m_s, course.sway_m_s, up), course.offset_rad, (port_after, up_after)
