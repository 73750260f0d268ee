"""What the modes before the conical ones ask of the autopilot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from auvdock.controllers.autopilot import AutopilotSetpoint
from auvdock.controllers.steering import Line, Steering, ground_course
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive, at_least
from auvdock.estimation.senses import Senses

__all__ = ["CourseCfg", "LookAroundCfg", "look_around", "steer_course"]

_Some = Annotated[float, at_least(1e-6)]


@dataclass(frozen=True)
class LookAroundCfg(Checked):
    """The look around for the beacon; ours.

    At 0.5 rev/s the beam comes by every 2 s, and the camera sees 85°: at 0.35 rad/s (20°/s) a direction stays in the
    image for 4.2 s, in which the beam passes twice. The turn stops at the first glimpse of a light and watches it for
    `hold_s`, in which a beacon shows itself by passing again.
    """

    turn_rate_rad_s: _Some = 0.35
    """Rate of the turn."""
    hold_s: _Some = 8.0
    """Watch a light that appeared for so long: four turns of the beacon."""
    hold_gap_rad: _Some = 0.9
    """Turn on by so much after a light that was watched in vain."""
    hold_score: NotNegative = 0.3
    """Least score of a light that is worth it."""
    settle_s: NotNegative = 1.0
    """Wait before the first turn."""
    believed_s: NotNegative = 7.0
    """Look so long to where the beacon was last believed."""
    leg_m: _Some = 8.0
    """Way between two full turns; every second way is longer by this much: a square spiral."""
    leg_speed_m_s: _Some = 0.7
    """Speed on it."""
    depth_step_m: NotNegative = 1.5
    """Every second round runs so much higher, every fourth so much deeper: a beam of 10° is thin near by."""


@dataclass(frozen=True)
class CourseCfg(Checked):
    """Speeds and view on the way around; ours."""

    speed_m_s: Positive = 0.9
    """Over ground."""
    look_speed_m_s: Positive = 0.25
    """Over ground while the hull is turned towards the beacon, sideways for the most part."""
    parallax_rad: Positive = 0.55
    """Least angle between course and beacon while the range is unknown."""
    view_rad: Positive = 0.6
    """The camera's half field of view less a margin: the beacon is in sight within this angle of the bow."""
    max_blind_s: Positive = 12.0
    """Longest way without a fix before the hull turns for a look."""
    look_timeout_s: Positive = 14.0
    """Longest look, turning included."""
    max_crab_rad: Positive = 0.5
    """Greatest angle between hull and course in a current."""
    lineup_least_m: Positive = 4.0
    """In lineup the vehicle aims at a place on the axis this far before itself, or farther."""
    lineup_share: Positive = 2.0
    """So many times as far as it is off the axis."""
    depth_below_beacon_m: Positive = 0.4
    """On the way around the camera runs so much below the beacon's beam."""


def look_around(
    in_mode_s: float, heading_rad: float, depth_m: float, side: float, believed: bool, cfg: LookAroundCfg
) -> Steering:
    """Full turns on the spot over ground, and between them the legs of a square spiral.

    Args:
        in_mode_s: time since the look began.
        heading_rad: where it begins.
        depth_m: depth about which it runs.
        side: +1 turns to port, -1 to starboard.
        believed: the beacon is believed in that direction: look there longer, and let the first leg lead away from it.
        cfg: the look.
    """
    moment = in_mode_s - (cfg.believed_s if believed else cfg.settle_s)
    if moment < 0.0:
        return Steering(AutopilotSetpoint(0.0, 0.0, 0.0, 0.0, heading_rad, depth_m))
    round_s = math.tau / cfg.turn_rate_rad_s
    number = 0
    while True:
        leg_s = cfg.leg_m * (1 + number // 2) / cfg.leg_speed_m_s
        if moment < round_s + leg_s or number > 1000:
            break
        moment -= round_s + leg_s
        number += 1
    depth = depth_m + cfg.depth_step_m * (0.0, -1.0, 0.0, 1.0)[number % 4]
    base = heading_rad + side * 0.5 * math.pi * (number + (2 if believed else 0))
    if moment < round_s:
        rate = side * cfg.turn_rate_rad_s
        return Steering(AutopilotSetpoint(0.0, 0.0, 0.0, 0.0, base + rate * moment, depth, turn_rad_s=rate))
    return Steering(AutopilotSetpoint(cfg.leg_speed_m_s, 0.0, 0.0, 0.0, base, depth))


def steer_course(
    course_rad: float,
    beacon_rad: float | None,
    speed_m_s: float,
    depth_m: float,
    senses: Senses,
    current_m_s: Array,
    reach_m_s: float,
    cfg: CourseCfg,
) -> Steering:
    """Along a compass course over ground; with `beacon_rad` the hull turns no farther than the view allows from it.

    The speed falls while hull and course differ, as the hull is slow sideways.
    """
    view = (-math.pi, math.pi)
    crab = cfg.max_crab_rad
    if beacon_rad is not None:
        off = math.remainder(beacon_rad - course_rad, math.tau)
        view = (off - cfg.view_rad, off + cfg.view_rad)
    else:
        gap = abs(math.remainder(course_rad - senses.yaw_rad, math.tau))
        speed_m_s *= min(1.0, max(0.2, 1.6 - gap))
    setpoint, offset = ground_course(speed_m_s, 0.0, 0.0, course_rad, crab, senses, current_m_s, reach_m_s, view)
    return Steering(setpoint._replace(depth_m=depth_m), Line(offset_rad=offset))
