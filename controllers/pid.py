"""PID as a pure function: integral in, command and integral out."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.core.errors import ConfigError

__all__ = ["PidGains", "pid_step"]


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
                raise ConfigError(f"pid.{name}", getattr(self, name), "a gain of 0 or more")


def pid_step(
    gains: PidGains,
    integral: float,
    error: float,
    rate: float,
    feed_forward: float,
    limit: float,
    dt_s: float,
) -> tuple[float, float]:
    """One step: τ = clip(k_p e + I + feed-forward − k_d ẏ, ± limit), İ = k_i e.

    The derivative acts on the measured rate ẏ, so a step of the set-point gives no kick. Anti-windup is conditional
    integration (Åström and Hägglund 2006, section 3.5): the integral stands still while the output is at its limit and
    the error would drive it further, and it never exceeds the limit itself.

    Args:
        gains: the gains.
        integral: integral part I so far, in the unit of the output.
        error: set-point minus measurement.
        rate: measured time derivative of the controlled quantity.
        feed_forward: output known beforehand.
        limit: greatest magnitude of the output.
        dt_s: period.

    Returns:
        The output and the new integral.
    """
    candidate = integral + gains.ki * error * dt_s
    candidate = min(limit, max(-limit, candidate))
    wanted = gains.kp * error + candidate + feed_forward - gains.kd * rate
    if wanted > limit:
        return limit, candidate if error < 0.0 else integral
    if wanted < -limit:
        return -limit, candidate if error > 0.0 else integral
    return wanted, candidate
