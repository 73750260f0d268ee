"""Gains of a PID loop; `auvdock.controllers.control_law.pid_step` is its arithmetic."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative

__all__ = ["PidGains"]


@dataclass(frozen=True)
class PidGains(Checked):
    """Parallel form: τ = k_p e + k_i ∫ e dt − k_d ẏ."""

    kp: NotNegative
    ki: NotNegative = 0.0
    kd: NotNegative = 0.0
