"""Any docking station."""

from __future__ import annotations

from typing import TypeAlias

from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.station import ConicalStationCfg

__all__ = ["StationCfg"]

StationCfg: TypeAlias = ConicalStationCfg | LandingStationCfg
"""What the simulator can hold: its `depth_m`, `floor_below_m`, `inside_m`, `latch.hold_s`, `layout` of lights."""
