"""What each mode of the landing asks for: a point to be at, a vertical speed, a heading."""

from __future__ import annotations

import math
from typing import NamedTuple

from auvdock.controllers.landing.guidance import Flat, LandingGuidanceCfg, Place, sink_m_s
from auvdock.controllers.landing.modes import ABORT, ALIGN, APPROACH, DESCEND, TOUCHDOWN, LandingModeCfg
from auvdock.controllers.landing.search import SpiralCfg, spiral, spiral_pass

__all__ = ["Demand", "Situation", "demand"]


class Situation(NamedTuple):
    """What steering goes by.

    Attributes:
        mode: current mode.
        place: seat relative to its place, None without a belief.
        height_m: of the seat above its place, by the belief or the pressure gauge.
        to_station_m: from the vehicle to the station, compass axes, None if nothing is known of it.
        from_anchor_m: from where the mode began to the vehicle, compass axes.
        anchor_height_m: height when the mode began.
        anchor_rad: compass heading when the mode began.
        axis_yaw_rad: compass heading of the station's axis, None while unknown.
        since_fix_s: time since the last pose.
        lost: perception has lost the station.
        in_mode_s: time in this mode.
    """

    mode: str
    place: Place | None
    height_m: float
    to_station_m: Flat | None
    from_anchor_m: Flat
    anchor_height_m: float
    anchor_rad: float
    axis_yaw_rad: float | None
    since_fix_s: float
    lost: bool
    in_mode_s: float


class Demand(NamedTuple):
    """What the vehicle shall do.

    Attributes:
        error_m: from the vehicle to the point where it shall be, compass axes.
        max_speed_m_s: greatest horizontal speed towards it.
        heave_m_s: vertical speed, positive up.
        heading_rad: compass heading.
        integrate: whether station keeping's integral may move.
    """

    error_m: Flat
    max_speed_m_s: float
    heave_m_s: float
    heading_rad: float
    integrate: bool


def demand(now: Situation, guidance: LandingGuidanceCfg, modes: LandingModeCfg, pattern: SpiralCfg) -> Demand:
    """The demand of the current mode (docked has none)."""
    heading = now.anchor_rad if now.axis_yaw_rad is None else now.axis_yaw_rad
    fresh = now.since_fix_s <= modes.pose_lost_s
    target = now.to_station_m
    back = (-now.from_anchor_m[0], -now.from_anchor_m[1])
    if now.mode == ABORT:
        climb = _hold(now, modes.standoff_m + 0.2, guidance)
        return Demand(target or back, guidance.align_speed_m_s, max(0.0, climb), heading, integrate=False)
    if now.place is not None and target is not None and fresh and now.mode != "search":
        if now.mode == APPROACH:
            heave = _towards_standoff(now, guidance, modes)
            return Demand(target, guidance.approach_speed_m_s, heave, heading, integrate=False)
        if now.mode == ALIGN:
            height = max(min(now.anchor_height_m, modes.standoff_m), modes.touchdown_height_m)
            return Demand(target, guidance.align_speed_m_s, _hold(now, height, guidance), heading, integrate=True)
        if now.mode == DESCEND:
            sink = _sink(now, now.place, guidance, modes)
            return Demand(target, guidance.align_speed_m_s, -sink, heading, integrate=True)
        if now.mode == TOUCHDOWN:
            sink = guidance.touchdown_sink_m_s
            return Demand(target, guidance.touchdown_speed_m_s, -sink, heading, integrate=False)
    # Descend and touchdown by dead reckoning alone: committed, or standing still until the mode machine decides.
    if now.mode in (DESCEND, TOUCHDOWN) and now.place is not None and target is not None:
        committed = now.place.height_m <= modes.commit_height_m
        sink = guidance.touchdown_sink_m_s if committed else 0.0
        return Demand(target, guidance.touchdown_speed_m_s, -sink, heading, integrate=False)
    if now.mode in (APPROACH, ALIGN):
        # Lights or memory without a pose: go there first, then down, but not far.
        above = target is not None and math.hypot(*target) < 0.25 * now.height_m
        least = modes.min_blind_height_m
        height = least if above else max(now.height_m, least)
        heave = max(-guidance.align_speed_m_s, _hold(now, height, guidance))
        return Demand(target or back, guidance.approach_speed_m_s, heave, heading, integrate=False)
    return _search(now, heading, guidance, modes, pattern)


def _search(
    now: Situation, heading_rad: float, guidance: LandingGuidanceCfg, modes: LandingModeCfg, pattern: SpiralCfg
) -> Demand:
    """Circle outwards, high and low by turns, around the station's last known place or where the search began."""
    high, flown_s = spiral_pass(now.in_mode_s, pattern)
    least = modes.min_blind_height_m
    height = max(now.anchor_height_m, pattern.height_m, least) if high else least
    x, y = spiral(flown_s, pattern)
    around = now.to_station_m or (-now.from_anchor_m[0], -now.from_anchor_m[1])
    heave = min(pattern.climb_m_s, max(-pattern.climb_m_s, _hold(now, height, guidance)))
    return Demand((around[0] + x, around[1] + y), guidance.approach_speed_m_s, heave, heading_rad, False)


def _towards_standoff(now: Situation, guidance: LandingGuidanceCfg, modes: LandingModeCfg) -> float:
    """Vertical speed of the approach: down only inside a cone, so that the station stays in the image."""
    place = now.place
    far_off = place is None or place.offset_m > max(0.5 * modes.near_m, 0.25 * place.height_m)
    if (far_off or now.since_fix_s > modes.fresh_s) and now.height_m > modes.standoff_m:
        return 0.0
    return _hold(now, modes.standoff_m, guidance)


def _sink(now: Situation, place: Place, guidance: LandingGuidanceCfg, modes: LandingModeCfg) -> float:
    """Sink speed of the descent: less and less without a pose, and none off heading."""
    speed = sink_m_s(place, guidance)
    if place.height_m > modes.commit_height_m:
        speed *= 0.0 if now.lost else max(0.0, 1.0 - now.since_fix_s / modes.brief_s)
    if place.height_m <= modes.touchdown_height_m or abs(place.heading_rad) > math.radians(modes.max_heading_deg):
        return 0.0
    return speed


def _hold(now: Situation, height_m: float, guidance: LandingGuidanceCfg) -> float:
    """Vertical speed towards a height."""
    speed = guidance.height_gain_1_s * (height_m - now.height_m)
    return min(guidance.climb_speed_m_s, max(-guidance.climb_speed_m_s, speed))
