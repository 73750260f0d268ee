"""The modes before the conical ones: find the beacon, learn its range, go around to the front, line up.

| from | to | when |
|---|---|---|
| any | mid | the array's poses are fresh, confirmed and agree with the beacon, within `pose_cone_rad` of the axis |
| acquire | approach | the beacon has passed `confirm_fixes` times |
| acquire | lineup | the same, and the vehicle lies in the cone before the mouth |
| acquire | far | the station has no rotating beacon and a fixed lamp is seen steadily |
| approach | circle | the range is known to `range_share`, or `approach_timeout_s` is over |
| approach, circle | lineup | in the cone before the mouth |
| lineup | circle | outside of twice that cone |
| lineup | far | no fix for `lineup_blind_s`, but a fixed lamp is seen steadily where the station should be |
| lineup | abort | surely nearer than `min_blind_m` and still no pose, or `lineup_timeout_s` is over |
| approach, circle, lineup | acquire | no fix for `lost_s` |

From far, mid and on the conical table (`auvdock.controllers.modes`) holds, but for its way back to acquire, which leads
here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from auvdock.controllers.modes import ABORT, ACQUIRE, FAR, MID
from auvdock.core.checked import Checked
from auvdock.core.limits import Count, Positive

__all__ = ["APPROACH", "CIRCLE", "LINEUP", "ROTATING_MODES", "RotatingFacts", "RotatingModeCfg", "next_rotating_mode"]

APPROACH, CIRCLE, LINEUP = "approach", "circle", "lineup"
ROTATING_MODES = (ACQUIRE, APPROACH, CIRCLE, LINEUP)
"""Modes in which the rotating beacon leads."""


@dataclass(frozen=True)
class RotatingModeCfg(Checked):
    """Thresholds of these modes; all ours."""

    confirm_fixes: Count = 2
    """Fixes before the vehicle sets off."""
    range_share: Positive = 0.15
    """The range is known when its standard deviation is this share of it."""
    approach_timeout_s: Positive = 60.0
    """Longest approach."""
    lineup_blind_s: Positive = 6.0
    """Lineup without a fix before a fixed lamp may lead instead."""
    lineup_timeout_s: Positive = 120.0
    """Longest lineup."""
    min_blind_m: Positive = 5.0
    """Nearer than this before the mouth there must have been a pose."""
    lost_s: Positive = 30.0
    """Without a fix for so long, the beacon is searched for again."""
    pose_cone_rad: Positive = 0.35
    """Half angle about the axis within which poses take over: from farther aside the array is seen too obliquely."""
    steady_sights: Count = 15
    """Frames in a row with a fixed lamp that make it steady."""


class RotatingFacts(NamedTuple):
    """What these modes are judged by.

    Attributes:
        has_beacon: the station has a rotating beacon.
        has_pose: confirmed, fresh poses of the array that agree with the beacon.
        lamp: a fixed lamp is seen steadily where the station should be.
        in_mode_s: time in this mode.
        fixes: accepted azimuth fixes, 0 without any.
        since_fix_s: time since the last one, infinite without.
        missed: a look for the beacon where it should be has failed.
        range_share: standard deviation of the range over the range.
        off_axis_rad: magnitude of the vehicle's azimuth, infinite without a beacon.
        cone_rad: half angle of the cone before the mouth.
        ahead_m: camera before the mouth along the axis, at most: two standard deviations farther than believed.
    """

    has_beacon: bool
    has_pose: bool
    lamp: bool
    in_mode_s: float
    fixes: int = 0
    since_fix_s: float = math.inf
    missed: bool = False
    range_share: float = math.inf
    off_axis_rad: float = math.inf
    cone_rad: float = 0.0
    ahead_m: float = math.inf


def next_rotating_mode(mode: str, facts: RotatingFacts, cfg: RotatingModeCfg) -> str:
    """The mode of the next period; see the table at the head of this module."""
    if facts.has_pose and (facts.fixes == 0 or facts.off_axis_rad < cfg.pose_cone_rad):
        return MID
    inside = facts.off_axis_rad <= facts.cone_rad
    if mode == ACQUIRE:
        if facts.fixes >= cfg.confirm_fixes and facts.since_fix_s < cfg.lineup_blind_s:
            return LINEUP if inside else APPROACH
        return FAR if facts.lamp and not facts.has_beacon else ACQUIRE
    if facts.fixes == 0 or facts.missed or facts.since_fix_s > cfg.lost_s:
        return FAR if mode == LINEUP and facts.lamp else ACQUIRE
    if mode == APPROACH:
        if inside:
            return LINEUP
        known = facts.range_share <= cfg.range_share or facts.in_mode_s > cfg.approach_timeout_s
        return CIRCLE if known else APPROACH
    if mode == CIRCLE:
        return LINEUP if inside else CIRCLE
    if facts.off_axis_rad > 2.0 * facts.cone_rad:
        return CIRCLE
    if facts.ahead_m < cfg.min_blind_m or facts.in_mode_s > cfg.lineup_timeout_s:
        return ABORT
    blind_s = min(facts.since_fix_s, facts.in_mode_s)  # the last stride of the way around may have been a blind one
    return FAR if facts.lamp and blind_s > cfg.lineup_blind_s else LINEUP
