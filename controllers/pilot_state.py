"""What the conical station's pilot remembers from one control period to the next."""

from __future__ import annotations

from typing import NamedTuple

from auvdock.controllers.autopilot import AutopilotState
from auvdock.controllers.steering import Sight
from auvdock.estimation.relative_state import RelativeState

__all__ = ["PilotState"]


class PilotState(NamedTuple):
    """All that the pilot remembers; immutable.

    Attributes:
        mode: current mode.
        since_s: when it began; None before the first step.
        attempts: approaches begun.
        giving_up: no attempt is left.
        relative: place before the station, None before the first pose.
        sight: last far light, None before the first.
        autopilot: integrals and references of the loops.
        integrals: of the cross-track laws, port and up.
        offset_rad: wanted heading relative to the axis.
        anchor_rad, anchor_depth_m: heading and depth when the mode began.
        side: where a search turns first, +1 is port.
        best_m, best_s: least distance in near or terminal, and when it was reached.
        gate_s: when the vehicle came to the gate in mid, None if it is not there.
    """

    mode: str
    since_s: float | None
    attempts: int
    giving_up: bool
    relative: RelativeState | None
    sight: Sight | None
    autopilot: AutopilotState
    integrals: tuple[float, float]
    offset_rad: float
    anchor_rad: float
    anchor_depth_m: float
    side: float
    best_m: float
    best_s: float
    gate_s: float | None
