"""The water that a vehicle swims in: its velocity at a height, and the gusts in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record
from auvdock.numeric.scalars import Vector

__all__ = ["Water", "advance_gust", "water_velocity"]


@dataclass
class Water(Record):
    """A horizontal current with gusts, uniform in space but for a shear with depth; world frame."""

    mean_m_s: Annotated[Array, 2]
    """Mean velocity at the reference depth."""
    shear_1_m: float
    """Relative change of the mean per metre upwards."""
    reference_depth_m: float
    """Depth of the station's mouth, where the mean holds."""
    gust_decay: float
    """e^(−dt/T) of a physics step dt and the gusts' correlation time T."""
    gust_drive_m_s: float
    """σ √(1 − e^(−2 dt/T)) of the gusts' standard deviation σ."""
    gust_m_s: Annotated[Array, 2]
    """Present gust, advanced in place."""
    gust_m_s2: Annotated[Array, 2]
    """Its mean acceleration over the last step."""


@compiled
def water_velocity(water: Water, z_world_m: float) -> Vector:
    """Velocity in the world frame in m/s at a height z: (1 + shear × height above the mouth) × mean + gust.

    Args:
        water: the water now.
        z_world_m: height, 0 at the surface, negative below.
    """
    factor = 1.0
    if water.shear_1_m != 0.0:
        factor = max(0.0, 1.0 + water.shear_1_m * (z_world_m + water.reference_depth_m))
    return factor * water.mean_m_s[0] + water.gust_m_s[0], factor * water.mean_m_s[1] + water.gust_m_s[1], 0.0


@compiled
def advance_gust(water: Water, noise: Array, dt_s: float) -> None:
    """Advance the gust by one step: g[k+1] = e^(−dt/T) g[k] + σ √(1 − e^(−2 dt/T)) n[k], per axis.

    Args:
        water: whose gust and its acceleration are advanced in place.
        noise: (2,) normal numbers n[k].
        dt_s: length of the step.
    """
    for axis in range(2):
        after = water.gust_decay * water.gust_m_s[axis] + water.gust_drive_m_s * noise[axis]
        water.gust_m_s2[axis] = (after - water.gust_m_s[axis]) / dt_s
        water.gust_m_s[axis] = after
