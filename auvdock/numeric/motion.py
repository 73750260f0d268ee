"""A vehicle's own motion as its sensors tell it, for compiled filters and laws (`estimation.senses`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record

__all__ = ["Motion", "stale_walk_m2_s"]

_ACCELERATION_M_S2 = 0.15
"""How fast a velocity that is not measured changes: as the autopilot's reference does."""
_LARGEST_CHANGE_M_S = 0.1
"""... and how far: by gusts and by what the current does on the way."""
_LONGEST_MEMORY_S = 2.0
"""For how long an error of it stays the same."""


@dataclass
class Motion(Record):
    """Attitude and velocities; body axes x forward, y port, z up. The compass heading is not among them."""

    roll_rad: float
    """Positive to starboard."""
    pitch_rad: float
    """Positive nose down."""
    rate_rad_s: Annotated[Array, 3]
    """p, q, r."""
    ground_m_s: Annotated[Array, 3]
    """Velocity over ground, body axes."""
    water_m_s: Annotated[Array, 3]
    """Velocity through the water, body axes."""
    ground_age_s: float
    """Time since the velocity over ground was last measured."""
    R_level_body: Annotated[Array, 3, 3]
    """Rotation from body axes to the level heading frame: ahead, port, up."""


@compiled
def stale_walk_m2_s(age_s: float) -> float:
    """Variance that dead reckoning by a velocity measured `age_s` ago adds to a place in a second, along each axis.

    An error σ_v = min(0.15 m/s² age, 0.1 m/s) that keeps for τ = min(age, 2 s) is a random walk of 2 σ_v² τ; 0 for a
    velocity measured just now.
    """
    error_m_s = min(_ACCELERATION_M_S2 * age_s, _LARGEST_CHANGE_M_S)
    return 2.0 * error_m_s * error_m_s * min(age_s, _LONGEST_MEMORY_S)
