"""What the conical station's pilot remembers from one control period to the next."""

from __future__ import annotations

import math
from typing import NamedTuple

from auvdock.controllers.autopilot import AutopilotState
from auvdock.controllers.modes import ACQUIRE
from auvdock.controllers.steering import Line, Sight
from auvdock.estimation.relative_state import RelativeState

__all__ = ["PilotState", "Progress", "Stage"]


class Stage(NamedTuple):
    """The mode, and what held when it began.

    Attributes:
        mode: current mode.
        since_s: when it began; None before the first step.
        attempts: approaches begun.
        giving_up: no attempt is left.
        anchor_rad, anchor_depth_m: heading and depth when the mode began.
        side: where a search turns first, +1 is port.
    """

    mode: str = ACQUIRE
    since_s: float | None = None
    attempts: int = 1
    giving_up: bool = False
    anchor_rad: float = 0.0
    anchor_depth_m: float = 0.0
    side: float = 1.0


class Progress(NamedTuple):
    """How the approach comes on.

    Attributes:
        best_m, best_s: least distance since the mode began, and when it was reached.
        gate_s: when the vehicle came to the gate in mid, None if it is not there.
    """

    best_m: float = math.inf
    best_s: float = 0.0
    gate_s: float | None = None


class PilotState(NamedTuple):
    """All that the pilot remembers; immutable.

    Attributes:
        autopilot: integrals and references of the loops.
        relative: place before the station, None before the first pose.
        sight: last far light, None before the first.
        stage: the mode, and what held when it began.
        progress: how the approach comes on.
        line: of guidance along the axis.
    """

    autopilot: AutopilotState
    relative: RelativeState | None = None
    sight: Sight | None = None
    stage: Stage = Stage()
    progress: Progress = Progress()
    line: Line = Line()

    @property
    def mode(self) -> str:
        """Current mode."""
        return self.stage.mode
