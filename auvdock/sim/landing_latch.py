"""The landing station's active latch: an arm that closes over a vehicle which has touched the guides and is slow."""

from __future__ import annotations

import math
from typing import NamedTuple

from auvdock.core.landing_station import LandingLatchCfg

__all__ = ["LandingLatch", "Posture"]


class Posture(NamedTuple):
    """How the vehicle stands to its place in the guides, in the station frame."""

    seat_error_m: tuple[float, float, float]
    """Along (to the head), across (to port), up."""
    heading_rad: float
    """Of the hull to the centre line."""
    tilt_rad: float
    """Between the vehicle's z and the world's."""
    speed_m_s: float
    """Over ground, of the seat."""


class LandingLatch:
    """State machine of the arm and of the touchdown that goes before it."""

    def __init__(self, cfg: LandingLatchCfg) -> None:
        """Precompute limits."""
        self._cfg = cfg
        self._max_heading_rad = math.radians(cfg.max_heading_deg)
        self._max_tilt_rad = math.radians(cfg.max_tilt_deg)
        self.reset()

    def reset(self) -> None:
        """Open, nothing touched."""
        self.touchdown_speed_m_s: float | None = None
        self.touchdown_time_s: float | None = None
        self.touchdown_force_n: float | None = None
        self.closed_at_s: float | None = None
        self.docked = False

    def touch(self, time_s: float, down_m_s: float, force_n: float) -> None:
        """Take in a step in which the station is touched.

        Args:
            time_s: simulated time.
            down_m_s: downward speed of the seat before the step.
            force_n: force of the station on the vehicle in it.
        """
        if self.touchdown_time_s is None:
            self.touchdown_time_s, self.touchdown_speed_m_s, self.touchdown_force_n = time_s, down_m_s, 0.0
        if self.closed_at_s is None:
            self.touchdown_force_n = max(self.touchdown_force_n or 0.0, force_n)

    def update(self, time_s: float, posture: Posture) -> bool:
        """Take in one step; True exactly when the latch closes in it."""
        if self.closed_at_s is not None:
            held = time_s - self.closed_at_s >= self._cfg.hold_s - 1e-9
            self.docked = self.docked or (held and self._touched_gently())
            return False
        if not self._within_reach(posture):
            return False
        self.closed_at_s = time_s
        return True

    def _within_reach(self, posture: Posture) -> bool:
        cfg = self._cfg
        along, across, up = posture.seat_error_m
        return (
            self.touchdown_time_s is not None
            and abs(along) <= cfg.along_m
            and abs(across) <= cfg.across_m
            and abs(up) <= cfg.height_m
            and abs(posture.heading_rad) <= self._max_heading_rad
            and posture.tilt_rad <= self._max_tilt_rad
            and posture.speed_m_s <= cfg.max_speed_m_s
        )

    def _touched_gently(self) -> bool:
        speed = self.touchdown_speed_m_s
        return speed is not None and speed <= self._cfg.max_touchdown_m_s
