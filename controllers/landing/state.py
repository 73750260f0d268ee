"""What the landing pilot remembers between two periods."""

from __future__ import annotations

from typing import NamedTuple

from auvdock.controllers.autopilot import AutopilotState
from auvdock.controllers.landing.belief import Belief
from auvdock.controllers.landing.guidance import Flat

__all__ = ["LandingState"]


class LandingState(NamedTuple):
    """All that the pilot remembers; immutable.

    Horizontal places are dead-reckoned from where the pilot began, in compass axes.

    Attributes:
        mode: current mode.
        since_s: when it began; None before the first step.
        attempts: landings begun.
        giving_up: no attempt is left.
        belief: where the vehicle is, None before the first pose.
        lost: perception's last word was "lost".
        autopilot: integrals and references of the loops.
        track_m: where the vehicle is.
        spot_m: where the station was last thought to be, None as long as nothing was seen.
        sights: frames in a row with the lights.
        sight_s: when they were last seen, minus infinity before.
        integral_m_s: station keeping's integral.
        anchor_m: where the mode began.
        anchor_height_m: height of the seat above its place when it began.
        anchor_rad: compass heading when it began.
        inside_s: since when the vehicle is inside the corridor and on heading, None if it is not.
        best_m, best_s: least height since sinking began, and when it was reached.
    """

    mode: str
    since_s: float | None
    attempts: int
    giving_up: bool
    belief: Belief | None
    lost: bool
    autopilot: AutopilotState
    track_m: Flat
    spot_m: Flat | None
    sights: int
    sight_s: float
    integral_m_s: Flat
    anchor_m: Flat
    anchor_height_m: float
    anchor_rad: float
    inside_s: float | None
    best_m: float
    best_s: float
