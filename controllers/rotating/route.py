"""The way around the station: the shortest path to the gate before the mouth that keeps off a disc about the station.

Everything is in the station's horizontal plane; the station frame's x points out of the mouth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive

__all__ = ["Leg", "RouteCfg", "route"]


@dataclass(frozen=True)
class RouteCfg(Checked):
    """Sizes of the way around; all ours."""

    centre_x_m: float = -1.35
    """Middle of the station's body: mouth at 0, end of the tube at -2.7 m."""
    radius_m: Positive = 12.0
    """The way around keeps so far off that middle."""
    gate_m: Positive = 15.0
    """Where the way around ends: on the axis, so far before the mouth."""
    cone_rad: Positive = 0.14
    """Half angle about the axis, seen from the beacon, in which the way around is over."""
    push: Positive = 0.25
    """Inside the disc the course turns outwards by so many radians per metre."""
    side_from_rad: Positive = 2.4
    """Beyond this azimuth the side once chosen is kept: noise about ±180° must not turn the vehicle back and forth."""

    def __post_init__(self) -> None:
        """Refuse a gate inside the disc."""
        if self.gate_m - self.centre_x_m <= self.radius_m:
            raise ConfigError("gate_m", self.gate_m, "a place outside the disc about centre_x_m")


class Leg(NamedTuple):
    """What to do now.

    Attributes:
        course_rad: course in the station frame.
        side: +1 if the station is to starboard on the way around (the azimuth falls), -1 if to port.
        distance_m: from the disc's middle.
        left_m: way that is left to the gate.
        direct: the gate lies in free sight.
    """

    course_rad: float
    side: float
    distance_m: float
    left_m: float
    direct: bool


def route(x_m: float, y_m: float, side: float, cfg: RouteCfg, caution_m: float = 0.0) -> Leg:
    """Course from (x, y) to the gate around the disc: straight, or along the tangent and the rim.

    From a place at distance d outside a disc of radius r the tangent leaves the line to its middle by asin(r/d). The
    vehicle goes round the side on which it is: with a positive azimuth that makes it fall.

    Args:
        x_m: place in the station frame.
        y_m: place in the station frame.
        side: last chosen side, 0.0 if none.
        cfg: sizes.
        caution_m: the disc counts as so much nearer: uncertainty of the range.
    """
    dx, dy = cfg.centre_x_m - x_m, -y_m
    distance = math.hypot(dx, dy)
    sight = math.atan2(dy, dx)
    angle = math.remainder(sight + math.pi, math.tau)
    if side == 0.0 or abs(angle) < cfg.side_from_rad:
        side = 1.0 if angle >= 0.0 else -1.0
    gate_x, gate_y = cfg.gate_m - x_m, -y_m
    gate = math.hypot(gate_x, gate_y)
    off = math.remainder(math.atan2(gate_y, gate_x) - sight, math.tau)
    least = max(distance - caution_m, 0.0)
    if least <= cfg.radius_m:
        tangent, free = 0.5 * math.pi, 0.0
        outwards = min(0.9, cfg.push * (cfg.radius_m - least))
    else:
        tangent, outwards = math.asin(cfg.radius_m / least), 0.0
        free = math.sqrt(least * least - cfg.radius_m * cfg.radius_m)
    direct = abs(off) >= tangent + outwards or (least > cfg.radius_m and gate <= free)
    if direct:
        return Leg(sight + off, side, distance, gate, True)
    # Tangent, arc, tangent: the arc spans what is left of the angle between the two places.
    reach = cfg.gate_m - cfg.centre_x_m
    arc = max(
        0.0,
        abs(angle) - math.acos(min(1.0, cfg.radius_m / max(distance, cfg.radius_m))) - math.acos(cfg.radius_m / reach),
    )
    left = free + cfg.radius_m * arc + math.sqrt(reach * reach - cfg.radius_m**2)
    return Leg(math.remainder(sight + side * (tangent + outwards), math.tau), side, distance, left, False)
