"""The mode machine of paper A (far > mid > near) as one pure function with every transition documented.

| from | to | when |
|---|---|---|
| any but docked | docked | the station reports the latch closed |
| acquire | mid | the relative state rests on fresh, confirmed poses |
| acquire | far | the long-range light is seen steadily |
| far | mid | as above |
| far | acquire | no light for `sight_lost_s` |
| far | abort | a light group nearer than `min_blind_range_m` and still no pose; or `far_timeout_s` is over |
| mid | near | nose at the gate, inside the corridor, pose fresh |
| mid | far, acquire | no pose for `pose_lost_s`, still beyond `commit_distance_m`; by whether a light is seen |
| mid | abort | closer than that: no pose for `pose_lost_s`, or poses jump |
| mid | abort | held at the gate outside the corridor for `hold_s`, or in mid for `mid_timeout_s` |
| near | terminal | nose in the mouth |
| near | abort | poses jump; too uncertain across the axis; far out of the corridor; no progress |
| terminal | abort | no progress (stuck), too long, or past the tube's end by the reckoning |
| abort | mid, far, acquire | backed off, and attempts are left; by what is known then |

A pilot whose attempts are used up stays in abort and says so; docked is final.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, Positive

__all__ = [
    "ABORT",
    "ACQUIRE",
    "DOCKED",
    "FAR",
    "MID",
    "MODES",
    "NEAR",
    "TERMINAL",
    "TRANSITIONS",
    "Facts",
    "ModeCfg",
    "next_mode",
]

ACQUIRE, FAR, MID, NEAR, TERMINAL, DOCKED, ABORT = "acquire", "far", "mid", "near", "terminal", "docked", "abort"
MODES = (ACQUIRE, FAR, MID, NEAR, TERMINAL, DOCKED, ABORT)

TRANSITIONS: dict[str, frozenset[str]] = {
    ACQUIRE: frozenset({ACQUIRE, FAR, MID, DOCKED}),
    FAR: frozenset({FAR, MID, ACQUIRE, ABORT, DOCKED}),
    MID: frozenset({MID, NEAR, FAR, ACQUIRE, ABORT, DOCKED}),
    NEAR: frozenset({NEAR, TERMINAL, ABORT, DOCKED}),
    TERMINAL: frozenset({TERMINAL, ABORT, DOCKED}),
    ABORT: frozenset({ABORT, MID, FAR, ACQUIRE, DOCKED}),
    DOCKED: frozenset({DOCKED}),
}
"""Modes that may follow each mode, itself included."""


@dataclass(frozen=True)
class ModeCfg(Checked):
    """Thresholds of the mode machine."""

    confirm_sights: Count = 3
    """Frames in a row with the long-range light before far begins."""
    confirm_fixes: Count = 5
    """Accepted poses before mid begins."""
    fresh_s: Positive = 0.5
    """A pose is fresh this long."""
    sight_lost_s: Positive = 3.0
    """Far ends when no light was seen for this long."""
    far_timeout_s: Positive = 90.0
    """Longest far: a lamp that leads on for longer is none."""
    min_blind_range_m: Positive = 3.0
    """Far is aborted when the lights seem nearer than this and no pose has come."""
    pose_lost_s: Positive = 4.0
    """Mid dead-reckons this long without a pose."""
    commit_distance_m: Positive = 4.5
    """Nearer than this, trouble in mid means backing off."""
    gate_distance_m: Positive = 3.0
    """Where corridor and heading are judged before the vehicle commits itself."""
    gate_heading_rad: Positive = 0.14
    """Greatest relative heading at the gate, crab angle apart."""
    hold_s: Positive = 10.0
    """Longest wait at the gate for the corridor."""
    mid_timeout_s: Positive = 90.0
    """Longest mid."""
    max_sigma_m: Positive = 0.25
    """Greatest uncertainty across the axis in near."""
    mouth_m: Positive = 0.2
    """Terminal begins with the nose this far before the mouth."""
    stall_s: Positive = 5.0
    """Near and terminal: no progress along the axis for this long means stuck."""
    progress_m: Positive = 0.05
    """Smaller advances do not count as progress."""
    terminal_timeout_s: Positive = 25.0
    """Longest terminal."""
    standoff_m: Positive = 7.0
    """Abort backs off to here."""
    back_timeout_s: Positive = 30.0
    """Longest backing off."""
    blind_back_s: Positive = 8.0
    """Backing off when the place before the station is unknown."""
    max_attempts: Count = 3
    """Approaches before the pilot gives up."""

    def __post_init__(self) -> None:
        """The gate lies between mouth and standoff."""
        if not self.mouth_m < self.gate_distance_m <= self.commit_distance_m < self.standoff_m:
            raise ConfigError(
                "gate_distance_m",
                self.gate_distance_m,
                "mouth_m < gate_distance_m <= commit_distance_m < standoff_m",
            )


class Facts(NamedTuple):
    """What the mode machine judges by.

    Attributes:
        latched: the latch is closed.
        fixes: accepted poses since the filter started, 0 without one.
        since_fix_s: time since the last accepted pose, infinite without one.
        jumped: the filter began anew in this period because poses had disagreed for long.
        distance_m: nose before the mouth along the axis, infinite without a relative state.
        off_axis_m: nose from the axis, infinite without a relative state.
        allowed_m: half width of the corridor at this distance.
        heading_error_rad: magnitude of the relative heading less the wanted crab.
        sigma_m: uncertainty across the axis, infinite without a relative state.
        sights: frames in a row with the long-range light.
        since_sight_s: time since a light was last seen.
        range_m: rough range of the light group, None if unknown.
        in_mode_s: time in this mode.
        held_s: time at the gate without passing.
        stalled_s: time without progress along the axis.
        missed: the nose should be past the tube's end, so it cannot be in the tube.
        giving_up: no attempt is left.
    """

    latched: bool
    fixes: int
    since_fix_s: float
    jumped: bool
    distance_m: float
    off_axis_m: float
    allowed_m: float
    heading_error_rad: float
    sigma_m: float
    sights: int
    since_sight_s: float
    range_m: float | None
    in_mode_s: float
    held_s: float
    stalled_s: float
    missed: bool
    giving_up: bool


def next_mode(mode: str, facts: Facts, cfg: ModeCfg) -> str:
    """The mode of the next period; see the table at the head of this module."""
    if mode == DOCKED or facts.latched:
        return DOCKED
    has_pose = facts.fixes >= cfg.confirm_fixes and facts.since_fix_s <= cfg.fresh_s
    sees_light = facts.sights >= cfg.confirm_sights
    if mode == ACQUIRE:
        return MID if has_pose else FAR if sees_light else ACQUIRE
    if mode == FAR:
        return _after_far(facts, cfg, has_pose)
    if mode == MID:
        return _after_mid(facts, cfg, has_pose, sees_light)
    if mode == NEAR:
        lost = facts.jumped or facts.sigma_m > cfg.max_sigma_m or facts.off_axis_m > 3.0 * facts.allowed_m
        if lost or facts.stalled_s > cfg.stall_s:
            return ABORT
        return TERMINAL if facts.distance_m <= cfg.mouth_m else NEAR
    if mode == TERMINAL:
        stuck = facts.stalled_s > cfg.stall_s or facts.in_mode_s > cfg.terminal_timeout_s
        return ABORT if stuck or facts.missed else TERMINAL
    return _after_abort(facts, cfg, has_pose, sees_light)


def _after_far(facts: Facts, cfg: ModeCfg, has_pose: bool) -> str:
    if has_pose:
        return MID
    too_near = facts.range_m is not None and facts.range_m < cfg.min_blind_range_m
    if too_near or facts.in_mode_s > cfg.far_timeout_s:
        return ABORT
    return ACQUIRE if facts.since_sight_s > cfg.sight_lost_s else FAR


def _after_mid(facts: Facts, cfg: ModeCfg, has_pose: bool, sees_light: bool) -> str:
    committed = facts.distance_m < cfg.commit_distance_m
    if facts.since_fix_s > cfg.pose_lost_s:
        return ABORT if committed else FAR if sees_light else ACQUIRE
    if (facts.jumped and committed) or facts.held_s > cfg.hold_s or facts.in_mode_s > cfg.mid_timeout_s:
        return ABORT
    at_gate = facts.distance_m <= cfg.gate_distance_m
    inside = facts.off_axis_m <= facts.allowed_m and facts.heading_error_rad <= cfg.gate_heading_rad
    return NEAR if at_gate and inside and has_pose else MID


def _after_abort(facts: Facts, cfg: ModeCfg, has_pose: bool, sees_light: bool) -> str:
    known = facts.fixes > 0 and facts.distance_m < 1e6
    backed = facts.distance_m >= cfg.standoff_m or facts.in_mode_s > cfg.back_timeout_s
    if not known:
        backed = facts.in_mode_s > cfg.blind_back_s
    if facts.giving_up or not backed:
        return ABORT
    return MID if has_pose else FAR if sees_light else ACQUIRE
