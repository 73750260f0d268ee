"""Any docking station."""

from __future__ import annotations

from typing import TypeAlias

from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.station import ConicalStationCfg

__all__ = ["StationCfg"]

StationCfg: TypeAlias = ConicalStationCfg | LandingStationCfg
"""What the simulator can hold: each has `depth_m`, `floor_below_m`, `latch.hold_s` and a `layout` of lights."""
