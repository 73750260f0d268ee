"""How much room a vehicle takes."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from auvdock.core.vehicle import load_vehicle

__all__ = ["HullRoom", "hull_room"]


class HullRoom(NamedTuple):
    """How far the solid parts of a level vehicle reach from its origin, m."""

    above_m: float
    below_m: float
    around_m: float
    """Sideways, with any heading."""
    below_seat_m: float
    """Below the middle of what rests in a landing station's guides."""
    above_seat_m: float
    """Above it."""


@lru_cache(maxsize=16)
def hull_room(vehicle: str) -> HullRoom:
    """The room of a vehicle preset.

    Raises:
        ConfigError: no such preset.
    """
    data = load_vehicle(vehicle)
    (low_x, low_y, low_z), (high_x, high_y, high_z) = data.hull_box_body_m.tolist()
    seat_z = float(data.seat_body_m[2])
    around_m = float(np.hypot(max(-low_x, high_x), max(-low_y, high_y)))
    return HullRoom(high_z, -low_z, around_m, seat_z - low_z, high_z - seat_z)
