"""The mode machine of the landing as one pure function with every transition documented.

| from | to | when |
|---|---|---|
| any but docked | docked | the station reports the latch closed |
| search | approach | poses are confirmed and fresh, or the lights are seen steadily |
| search | abort | nothing for `search_timeout_s`; the pilot then gives up |
| approach | align | a fresh pose, near the station's axis and its standoff height |
| approach | search | neither a pose nor lights for `sight_lost_s` |
| approach | abort | `approach_timeout_s` is over |
| align | descend | inside the corridor and on heading for `settle_s`, pose fresh and sure |
| align | approach | far off again |
| align | search | up at the standoff height: no pose for `pose_lost_s`, or perception says "lost" |
| align | abort | lower down: the same; or `align_timeout_s` is over |
| descend | align | outside the corridor or off heading, and not blind: hold this height and align |
| descend | touchdown | at `touchdown_height_m`, inside the corridor, on heading, sure enough |
| descend | abort | no pose for `pose_lost_s`, perception says "lost", poses jump, or stuck above the seat |
| touchdown | abort | not latched within `touchdown_timeout_s`, stuck too high or too deep, out of place, or unsure |
| abort | approach, search | climbed to the standoff height, and attempts are left; by whether a pose is fresh |

Blind flight is bounded. Above `commit_height_m` a descent goes on without a pose for `brief_s` at most (paper C's
remark 3: keep on with the last pose for a moment), then stands still until `pose_lost_s` or until perception says
"lost", then climbs. At or below `commit_height_m`, where the tag fills or leaves the image, the descent may go on
by dead reckoning for `commit_s` at most and while the estimate is good to `max_sigma_m`. A pilot without attempts left
climbs, and says so once it is clear of the station; docked is final.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, Positive

__all__ = [
    "ABORT",
    "ALIGN",
    "APPROACH",
    "DESCEND",
    "DOCKED",
    "LANDING_MODES",
    "LANDING_TRANSITIONS",
    "SEARCH",
    "TOUCHDOWN",
    "LandingFacts",
    "LandingModeCfg",
    "next_landing_mode",
]

SEARCH, APPROACH, ALIGN, DESCEND = "search", "approach", "align", "descend"
TOUCHDOWN, DOCKED, ABORT = "touchdown", "docked", "abort"
LANDING_MODES = (SEARCH, APPROACH, ALIGN, DESCEND, TOUCHDOWN, DOCKED, ABORT)

LANDING_TRANSITIONS: dict[str, frozenset[str]] = {
    SEARCH: frozenset({SEARCH, APPROACH, ABORT, DOCKED}),
    APPROACH: frozenset({APPROACH, ALIGN, SEARCH, ABORT, DOCKED}),
    ALIGN: frozenset({ALIGN, DESCEND, APPROACH, SEARCH, ABORT, DOCKED}),
    DESCEND: frozenset({DESCEND, ALIGN, TOUCHDOWN, ABORT, DOCKED}),
    TOUCHDOWN: frozenset({TOUCHDOWN, ABORT, DOCKED}),
    ABORT: frozenset({ABORT, APPROACH, SEARCH, DOCKED}),
    DOCKED: frozenset({DOCKED}),
}
"""Modes that may follow each mode, itself included."""


@dataclass(frozen=True)
class LandingModeCfg(Checked):
    """Thresholds of the mode machine; all values are ours. Heights are of the seat above its place in the guides."""

    confirm_sights: Count = 3
    """Frames in a row with the lights before approach begins without a pose."""
    confirm_fixes: Count = 5
    """Accepted poses before they count."""
    fresh_s: Positive = 0.3
    """A pose is fresh this long."""
    sight_lost_s: Positive = 3.0
    """Approach ends when neither pose nor lights were seen for this long."""
    search_timeout_s: Positive = 150.0
    """Longest search."""
    approach_timeout_s: Positive = 60.0
    """Longest approach."""
    standoff_m: Positive = 2.0
    """Height at which the vehicle aligns: all five lights and the tag are in the image."""
    min_blind_height_m: Positive = 2.0
    """Without a fresh pose the vehicle never goes lower than this of its own will, the committed descent apart."""
    near_m: Positive = 0.5
    """Approach ends within this horizontal distance and height of the standoff point; align ends at twice that."""
    settle_s: Positive = 1.5
    """Time inside the corridor before the descent."""
    max_heading_deg: Positive = 2.5
    """Greatest heading error in the descent (paper C steers to within 3°)."""
    align_timeout_s: Positive = 60.0
    """Longest align."""
    brief_s: Positive = 0.7
    """A descent goes on this long without a pose, ever slower."""
    pose_lost_s: Positive = 3.5
    """Align and descend wait this long for a pose before they give in."""
    commit_height_m: Positive = 0.35
    """At and below this height the descent may end by dead reckoning."""
    commit_s: Positive = 10.0
    """Longest committed descent without a pose."""
    max_sigma_m: Positive = 0.03
    """Greatest horizontal standard deviation in descend, low down, and in touchdown."""
    leave_factor: Positive = 1.5
    """The descent is interrupted at this multiple of the corridor's half width, and of the heading limit."""
    touchdown_height_m: Positive = 0.12
    """Height at which the final sink begins."""
    stall_s: Positive = 2.0
    """No progress downwards for this long while sinking means that the vehicle rests on something."""
    progress_m: Positive = 0.02
    """Smaller ways down do not count as progress."""
    seated_m: Positive = 0.05
    """Resting higher than this is not on the seat; and twice as deep below it no estimate is right."""
    touchdown_timeout_s: Positive = 12.0
    """Longest touchdown."""
    abort_timeout_s: Positive = 30.0
    """Longest climb."""
    max_attempts: Count = 3
    """Landings begun before the pilot gives up."""

    def __post_init__(self) -> None:
        """Touchdown, commitment and standoff lie in this order."""
        if not self.touchdown_height_m < self.commit_height_m < self.standoff_m:
            raise ConfigError("commit_height_m", self.commit_height_m, "touchdown_height_m < it < standoff_m")
        if not self.brief_s < self.pose_lost_s:
            raise ConfigError("brief_s", self.brief_s, "less than pose_lost_s")


class LandingFacts(NamedTuple):
    """What the mode machine judges by.

    Attributes:
        latched: the latch is closed.
        fixes: accepted poses since the filter started, 0 without one.
        since_fix_s: time since the last accepted pose, infinite without one.
        lost: perception says that it has lost the station.
        jumped: the filter began anew in this period because poses had disagreed for long.
        sigma_m: horizontal standard deviation, infinite without a belief.
        height_m: of the seat above its place, by the belief or else by the pressure gauge.
        offset_m: horizontal distance of the seat from its place, infinite without a belief.
        heading_error_rad: magnitude of ψ, infinite without a belief.
        allowed_m: half width of the corridor at this height.
        sights: frames in a row with the lights.
        since_sight_s: time since lights were last seen.
        in_mode_s: time in this mode.
        inside_s: time inside the corridor and on heading without a break.
        stalled_s: time without progress downwards.
        giving_up: no attempt is left.
    """

    latched: bool
    fixes: int
    since_fix_s: float
    lost: bool
    jumped: bool
    sigma_m: float
    height_m: float
    offset_m: float
    heading_error_rad: float
    allowed_m: float
    sights: int
    since_sight_s: float
    in_mode_s: float
    inside_s: float
    stalled_s: float
    giving_up: bool


def next_landing_mode(mode: str, facts: LandingFacts, cfg: LandingModeCfg) -> str:
    """The mode of the next period; see the table at the head of this module."""
    if mode == DOCKED or facts.latched:
        return DOCKED
    has_pose = facts.fixes >= cfg.confirm_fixes and facts.since_fix_s <= cfg.fresh_s
    if mode == SEARCH:
        if has_pose or facts.sights >= cfg.confirm_sights:
            return APPROACH
        return ABORT if facts.in_mode_s > cfg.search_timeout_s else SEARCH
    if mode == APPROACH:
        return _after_approach(facts, cfg, has_pose)
    if mode == ALIGN:
        return _after_align(facts, cfg, has_pose)
    if mode == DESCEND:
        return _after_descend(facts, cfg)
    if mode == TOUCHDOWN:
        return _after_touchdown(facts, cfg)
    climbed = facts.height_m > cfg.standoff_m - 0.1 or facts.in_mode_s > cfg.abort_timeout_s
    if facts.giving_up or not climbed:
        return ABORT
    return APPROACH if has_pose else SEARCH


def _after_approach(facts: LandingFacts, cfg: LandingModeCfg, has_pose: bool) -> str:
    if has_pose and facts.offset_m < cfg.near_m and abs(facts.height_m - cfg.standoff_m) < cfg.near_m:
        return ALIGN
    if min(facts.since_fix_s, facts.since_sight_s) > cfg.sight_lost_s:
        return SEARCH
    return ABORT if facts.in_mode_s > cfg.approach_timeout_s else APPROACH


def _after_align(facts: LandingFacts, cfg: LandingModeCfg, has_pose: bool) -> str:
    if facts.since_fix_s > cfg.pose_lost_s or facts.lost:
        return SEARCH if facts.height_m > cfg.standoff_m - cfg.near_m else ABORT
    if facts.in_mode_s > cfg.align_timeout_s:
        return ABORT
    if facts.offset_m > 2.0 * cfg.near_m or facts.height_m > cfg.standoff_m + 2.0 * cfg.near_m:
        return APPROACH
    sure = facts.sigma_m < max(cfg.max_sigma_m, 0.5 * facts.allowed_m)
    return DESCEND if has_pose and sure and facts.inside_s >= cfg.settle_s else ALIGN


def _after_descend(facts: LandingFacts, cfg: LandingModeCfg) -> str:
    committed = facts.height_m <= cfg.commit_height_m
    if committed:
        if facts.since_fix_s > cfg.commit_s or facts.sigma_m > cfg.max_sigma_m:
            return ABORT
    elif facts.since_fix_s > cfg.pose_lost_s or facts.lost:
        return ABORT
    if facts.jumped:
        return ABORT
    inside = facts.offset_m <= facts.allowed_m and facts.heading_error_rad <= math.radians(cfg.max_heading_deg)
    if facts.height_m <= cfg.touchdown_height_m and inside:
        return TOUCHDOWN
    limit = math.radians(cfg.leave_factor * cfg.max_heading_deg)
    if facts.offset_m > cfg.leave_factor * facts.allowed_m or facts.heading_error_rad > limit:
        return ALIGN if facts.since_fix_s <= cfg.fresh_s or not committed else ABORT
    return ABORT if facts.stalled_s > cfg.stall_s else DESCEND


def _after_touchdown(facts: LandingFacts, cfg: LandingModeCfg) -> str:
    stuck = (facts.stalled_s > cfg.stall_s and facts.height_m > cfg.seated_m) or facts.height_m < -2.0 * cfg.seated_m
    unsure = facts.sigma_m > cfg.max_sigma_m or facts.jumped
    out = facts.offset_m > 3.0 * facts.allowed_m
    return ABORT if stuck or unsure or out or facts.in_mode_s > cfg.touchdown_timeout_s else TOUCHDOWN
