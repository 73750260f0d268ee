"""The computer on board takes its time: a command acts some time after the frame that it follows from."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.limits import between

__all__ = ["CommandLink", "LatencyCfg"]


@dataclass(frozen=True)
class LatencyCfg(Checked):
    """Time from a frame and the senses taken with it to the moment at which the command that they led to acts.

    Until then the actuators follow the commands before it; at the start of an episode, none. Paper A's embedded
    computer needs 28 ms a frame (table 8).
    """

    time_s: Annotated[float, between(0.0, 2.0)] = 0.0
    """Counted in whole physics steps, the nearest number of them."""
    measured: bool = False
    """Take the time that really passes between sensing and commanding, in place of `time_s`. What an episode does then
    hangs on the machine, so it does not repeat bit for bit."""


class CommandLink:
    """Commands on their way to the actuators."""

    def __init__(self, cfg: LatencyCfg, actuators: int, physics_hz: float) -> None:
        """Start with actuators at rest.

        Args:
            cfg: how long a command takes.
            actuators: number of values in a command.
            physics_hz: physics steps a second.
        """
        self._measured, self._physics_hz = cfg.measured, physics_hz
        self._steps = round(cfg.time_s * physics_hz)
        self._rest = np.zeros(actuators)
        self.reset()

    def reset(self) -> None:
        """Forget all commands."""
        self._acting: Array = self._rest
        self._pending: deque[tuple[int, Array]] = deque()
        self._sensed_at = time.perf_counter()

    def sensed(self) -> None:
        """Note that the senses were read now."""
        self._sensed_at = time.perf_counter()

    def segments(self, values: Array, steps: int) -> Iterator[tuple[Array, int]]:
        """What acts for how many physics steps in a control period of `steps`, at whose start `values` (n,) is given.

        A command is never overtaken by one given before it.
        """
        wait = round((time.perf_counter() - self._sensed_at) * self._physics_hz) if self._measured else self._steps
        if wait == 0 and not self._pending:  # the way of every episode without latency
            self._acting = values.copy()
            yield values, steps
            return
        while self._pending and self._pending[-1][0] > wait:
            self._pending.pop()  # the newer command is there first
        self._pending.append((wait, values.copy()))
        done = 0
        while done < steps:
            while self._pending and self._pending[0][0] <= done:
                self._acting = self._pending.popleft()[1]
            until = min(self._pending[0][0], steps) if self._pending else steps
            yield self._acting, until - done
            done = until
        self._pending = deque((due - steps, waiting) for due, waiting in self._pending)
