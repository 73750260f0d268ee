"""A vehicle's own motion as its sensors tell it, for compiled filters and laws (`estimation.senses`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.numeric.arrays import Array
from auvdock.numeric.records import Record

__all__ = ["Motion"]


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
    R_level_body: Annotated[Array, 3, 3]
    """Rotation from body axes to the level heading frame: ahead, port, up."""
