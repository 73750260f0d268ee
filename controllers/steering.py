"""What each mode asks of the autopilot: from where the vehicle is to a set-point."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from auvdock.controllers.autopilot import AutopilotSetpoint
from auvdock.controllers.axis_guidance import AxisLaw, Place, axis_course, crab
from auvdock.controllers.guidance import GuidanceCfg
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive
from auvdock.estimation.senses import Senses
from auvdock.numeric.records import Records
from auvdock.numeric.scalars import limited

__all__ = [
    "Line",
    "SearchCfg",
    "Sight",
    "Steering",
    "along_axis",
    "back_off",
    "ground_course",
    "search",
    "search_pattern",
    "towards_light",
    "update_sight",
]


@dataclass(frozen=True)
class SearchCfg(Checked):
    """The look around while no light is seen."""

    turn_rate_rad_s: Positive = 0.3
    """Rate of the sweep in heading."""
    settle_s: float = 1.5
    """Wait before the first turn."""
    amplitudes_rad: tuple[Positive, ...] = (0.7, 1.4)
    """The sweep widens to these headings on either side."""
    advance_m: float = 5.0
    """Way ahead between two sweeps, if the place before the station is unknown."""
    advance_speed_m_s: Positive = 0.5
    """Speed on that way."""
    depth_step_m: float = 1.0
    """Every second sweep runs so much deeper, every fourth so much higher."""

    def __post_init__(self) -> None:
        """Refuse no sweep."""
        if not self.amplitudes_rad:
            raise ConfigError("amplitudes_rad", self.amplitudes_rad, "one or more angles above 0 rad")


class Sight(NamedTuple):
    """Last seen light of the far stage.

    Attributes:
        frames: frames in a row with it.
        time_s: when it was last seen.
        azimuth_rad: world direction to it, positive to port, smoothed.
        elevation_rad: positive up, smoothed.
        range_m: rough range, smoothed, None if unknown.
        widest_m: the greatest smoothed range since the light was found.
        looks: frames that the means rest on; gaps of up to 3 s do not end them.
    """

    frames: int
    time_s: float
    azimuth_rad: float
    elevation_rad: float
    range_m: float | None
    widest_m: float = 0.0
    looks: int = 1

    def trusted_range_m(self, least_m: float) -> float | None:
        """The range if it was once twice `least_m`: drifting particles look like a group that is always near."""
        return self.range_m if self.widest_m >= 2.0 * least_m else None


def update_sight(
    last: Sight | None, time_s: float, azimuth_rad: float, elevation_rad: float, range_m: float | None, smoothing: float
) -> Sight:
    """The sight after one more frame: a running mean that turns into an exponential one with weight `smoothing`.

    The range, the noisier part, is averaged four times as long, and judged (`widest_m`) only once the mean has settled.
    """
    if last is None or time_s - last.time_s > 3.0:
        return Sight(1, time_s, azimuth_rad, elevation_rad, range_m)
    looks, mean_m = last.looks + 1, last.range_m
    share = 1.0 / looks
    weight = max(smoothing, share)
    azimuth = last.azimuth_rad + weight * math.remainder(azimuth_rad - last.azimuth_rad, math.tau)
    if range_m is not None:
        mean_m = range_m if mean_m is None else mean_m + max(0.25 * smoothing, share) * (range_m - mean_m)
    return Sight(
        last.frames + 1,
        time_s,
        math.remainder(azimuth, math.tau),
        last.elevation_rad + weight * (elevation_rad - last.elevation_rad),
        mean_m,
        max(last.widest_m, mean_m or 0.0) if looks * smoothing > 2.0 else 0.0,
        looks,
    )


class Line(NamedTuple):
    """What guidance remembers.

    Attributes:
        integrals: of the integral line of sight, port and up.
        offset_rad: wanted heading relative to the axis.
    """

    integrals: tuple[float, float] = (0.0, 0.0)
    offset_rad: float = 0.0


class Steering(NamedTuple):
    """A set-point, and what guidance remembers of it."""

    setpoint: AutopilotSetpoint
    line: Line = Line()


def search_pattern(cfg: SearchCfg) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times in s and heading offsets in rad of the widening sweep's corners; it starts and ends at 0."""
    corners = [0.0]
    for amplitude in cfg.amplitudes_rad:
        corners += [amplitude, -amplitude]
    corners.append(0.0)
    times = [cfg.settle_s]
    for before, after in pairwise(corners):
        times.append(times[-1] + abs(after - before) / cfg.turn_rate_rad_s)
    return tuple(times), tuple(corners)


def search(
    in_mode_s: float,
    heading_rad: float,
    depth_m: float,
    side: float,
    advance: bool,
    pattern: tuple[tuple[float, ...], tuple[float, ...]],
    cfg: SearchCfg,
) -> Steering:
    """Sweep the heading about `heading_rad`, holding place over ground; then go ahead and sweep again.

    Args:
        in_mode_s: time since the search began.
        heading_rad: centre of the sweep.
        depth_m: depth about which the search runs.
        side: +1 turns to port first, -1 to starboard.
        advance: whether to go ahead between sweeps.
        pattern: from `search_pattern`.
        cfg: the search.
    """
    times, corners = pattern
    ahead_s = cfg.advance_m / cfg.advance_speed_m_s if advance else 0.0
    cycle, moment = divmod(in_mode_s, times[-1] + ahead_s)
    depth = depth_m + cfg.depth_step_m * (0.0, 1.0, 0.0, -1.0)[int(cycle) % 4]
    offset, rate, speed = 0.0, 0.0, 0.0
    if moment >= times[-1]:
        speed = cfg.advance_speed_m_s
    elif moment > times[0]:
        leg = bisect_right(times, moment) - 1
        rate = math.copysign(cfg.turn_rate_rad_s, corners[leg + 1] - corners[leg])
        offset = corners[leg] + rate * (moment - times[leg])
    heading = heading_rad + side * offset
    return Steering(AutopilotSetpoint(speed, 0.0, 0.0, 0.0, heading, depth, turn_rad_s=side * rate))


def towards_light(
    sight: Sight,
    lamp_height_m: float,
    senses: Senses,
    current_m_s: Array,
    reach_m_s: float,
    least_range_m: float,
    cfg: GuidanceCfg,
) -> Steering:
    """Pure pursuit of a bearing: course along its azimuth over ground, height by its elevation.

    A lone lamp hangs `lamp_height_m` above the axis, so at range R the wanted elevation is atan(h/R); R is the rough
    range if known, else `assumed_range_m`. A group whose range is known is the array about the axis itself.
    """
    range_m = sight.trusted_range_m(least_range_m)
    wanted = 0.0 if range_m is not None else math.atan2(lamp_height_m, cfg.assumed_range_m)
    turn = math.remainder(sight.azimuth_rad - senses.yaw_rad, math.tau)
    speed = cfg.far_speed_m_s * min(1.0, max(0.0, 1.6 - 1.5 * abs(turn)))
    if range_m is not None:
        speed = min(speed, max(0.15, 0.12 * (range_m - 2.0)))
    elif sight.range_m is not None:
        speed = min(speed, cfg.mid_speed_m_s)
    climb = max(speed, 0.3) * math.tan(min(0.7, max(-0.7, sight.elevation_rad - wanted)))
    climb = limited(climb, cfg.max_vertical_speed_m_s)
    setpoint, offset = ground_course(
        speed, 0.0, climb, sight.azimuth_rad, cfg.max_crab_rad, senses, current_m_s, reach_m_s
    )
    return Steering(setpoint, Line(offset_rad=offset))


def along_axis(
    place: Place,
    integrals: tuple[float, float],
    hold: bool,
    committed: bool,
    lookahead_m: float,
    senses: Senses,
    current_m_s: Array,
    law: Records[AxisLaw],
) -> Steering:
    """Along the approach axis; see `axis_guidance.axis_course`.

    Args:
        place: the nose before the mouth.
        integrals: of the line of sight, port and up.
        hold: wait at the gate.
        committed: past the gate.
        lookahead_m: of the line of sight.
        senses: the vehicle's own.
        current_m_s: (3,) in world axes.
        law: from `axis_guidance.axis_law`.
    """
    turn = math.remainder(senses.yaw_rad - place.axis_yaw_rad, math.tau)
    (surge, sway, heave), offset, integrals = axis_course(
        law, place[:], integrals, hold, committed, lookahead_m, turn, current_m_s
    )
    setpoint = AutopilotSetpoint(surge, sway, heave, 0.0, place.axis_yaw_rad + offset)
    return Steering(setpoint, Line(integrals, offset))


def back_off(place: Place, senses: Senses, current_m_s: Array, reach_m_s: float, cfg: GuidanceCfg) -> Steering:
    """Backwards along the axis with the hull aligned; inside the funnel straight back."""
    port = up = 0.0
    if place.distance_m > 0.0:
        port = limited(-0.25 * place.port_m, cfg.max_cross_speed_m_s)
        up = limited(-0.25 * place.up_m, cfg.max_cross_speed_m_s)
    setpoint, offset = ground_course(
        -cfg.back_speed_m_s, port, up, place.axis_yaw_rad, 0.0, senses, current_m_s, reach_m_s
    )
    return Steering(setpoint, Line(offset_rad=offset))


def ground_course(
    forward_m_s: float,
    port_m_s: float,
    up_m_s: float,
    course_rad: float,
    crab_limit_rad: float,
    senses: Senses,
    current_m_s: Array,
    reach_m_s: float,
    view_rad: tuple[float, float] = (-math.pi, math.pi),
) -> tuple[AutopilotSetpoint, float]:
    """Set-point for a velocity over ground given along and across a world direction, and the heading offset in it.

    The offset is the crab angle, kept within `view_rad` so that the lights stay in the image.
    """
    turn = math.remainder(senses.yaw_rad - course_rad, math.tau)
    surge, sway, offset = crab(
        forward_m_s, port_m_s, course_rad, crab_limit_rad, turn, current_m_s, reach_m_s, view_rad
    )
    return AutopilotSetpoint(surge, sway, up_m_s, 0.0, course_rad + offset), offset
