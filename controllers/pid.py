"""Gains of a PID loop; `auvdock.controllers.control_law.pid_step` is its arithmetic."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.core.errors import ConfigError

__all__ = ["PidGains"]


@dataclass(frozen=True)
class PidGains:
    """Parallel form: τ = k_p e + k_i ∫ e dt − k_d ẏ."""

    kp: float
    ki: float = 0.0
    kd: float = 0.0

    def __post_init__(self) -> None:
        """All gains are 0 or more."""
        for name in ("kp", "ki", "kd"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(name, getattr(self, name), "a gain of 0 or more")
