"""The latch: watches the nose pass the throat, closes when `LatchCfg` says so, and counts how long it has held."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.station import FunnelCfg, LatchCfg

__all__ = ["Entry", "Latch"]


@dataclass(frozen=True)
class Entry:
    """How the nose passed the throat."""

    speed_m_s: float
    """Along the tube, inwards."""
    angle_rad: float
    """Between hull and tube axis."""
    lateral_m: float
    """Sideways offset from the tube's axis, + to the right as the entering vehicle sees it."""
    vertical_m: float
    """Upward offset."""


class Latch:
    """State machine of the latch; all arguments are in the station frame."""

    def __init__(self, cfg: LatchCfg, funnel: FunnelCfg) -> None:
        """Precompute limits."""
        self._cfg = cfg
        self._max_angle_rad = math.radians(cfg.max_angle_deg)
        self._throat_x_m = -funnel.length_m
        self._close_x_m = -funnel.length_m - cfg.depth_m
        self._radius_m = funnel.tube_radius_m
        self.reset()

    def reset(self) -> None:
        """Open, nothing seen."""
        self.entry: Entry | None = None
        self.closed_at_s: float | None = None
        self.docked = False
        self._last_x_m = -math.inf

    def update(
        self, time_s: float, nose_m: tuple[float, float, float], inward_speed_m_s: float, angle_rad: float
    ) -> bool:
        """Take in one step; True exactly when the latch closes in it.

        Args:
            time_s: simulated time.
            nose_m: tip of the nose.
            inward_speed_m_s: its speed along the tube, positive inwards.
            angle_rad: angle between hull and tube axis.
        """
        x, y, z = nose_m
        last_x, self._last_x_m = self._last_x_m, x
        if self.closed_at_s is not None:
            held = time_s - self.closed_at_s >= self._cfg.hold_s - 1e-9
            self.docked = self.docked or (held and self._entry_within_limits())
            return False
        if x > self._throat_x_m or math.hypot(y, z) > self._radius_m:
            return False
        if last_x > self._throat_x_m:
            self.entry = Entry(inward_speed_m_s, angle_rad, y, z)
        if (
            x <= self._close_x_m
            and angle_rad <= self._max_angle_rad
            and abs(inward_speed_m_s) <= self._cfg.max_speed_m_s
        ):
            self.closed_at_s = time_s
            return True
        return False

    def _entry_within_limits(self) -> bool:
        entry = self.entry
        return (
            entry is not None
            and entry.speed_m_s <= self._cfg.max_entry_speed_m_s
            and entry.angle_rad <= self._max_angle_rad
        )
