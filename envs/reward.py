"""What an environment pays for a control period."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative

__all__ = ["RewardCfg"]

_FREE_OF_CHARGE = ("timeout", "terminal")
"""Endings that do not cost `RewardCfg.failure`: nothing went wrong but that the vehicle did not dock."""


@dataclass(frozen=True)
class RewardCfg(Checked):
    """r = progress_per_m Δd − energy_per_j ΔW − time_per_s Δt, plus or less what the end of the episode is worth.

    Δd is the way made towards where the latch closes in m, ΔW the thrusters' hydraulic work in J, Δt the control period
    in s. The end is paid in the episode's last step, and there is no step after it.
    """

    progress_per_m: NotNegative = 1.0
    """For each metre nearer to where the latch closes."""
    energy_per_j: NotNegative = 0.001
    """Taken off for each joule of thruster work."""
    time_per_s: NotNegative = 0.0
    """Taken off for each second."""
    success: NotNegative = 100.0
    """For docking."""
    failure: NotNegative = 50.0
    """Taken off where an episode ends early without success, a latch that closed on a bad entry apart."""

    def of(self, progress_m: float, work_j: float, period_s: float, *, success: bool, end: str | None) -> float:
        """Reward of one control period.

        Args:
            progress_m: way made towards where the latch closes.
            work_j: thruster work.
            period_s: length of the period.
            success: whether the vehicle docked in it.
            end: why else the episode ended in it, a failure reason; None if it goes on.
        """
        reward = self.progress_per_m * progress_m - self.energy_per_j * work_j - self.time_per_s * period_s
        if success:
            reward += self.success
        elif end is not None and end not in _FREE_OF_CHARGE:
            reward -= self.failure
        return reward
