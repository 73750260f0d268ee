"""Which dock a station's data makes."""

from __future__ import annotations

from auvdock.core.station import ConicalStationCfg
from auvdock.core.stations import StationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.sim.conical_dock import ConicalDock
from auvdock.sim.dock import Dock
from auvdock.sim.landing_dock import LandingDock

__all__ = ["make_dock"]


def make_dock(station: StationCfg, vehicle: VehicleCfg) -> Dock:
    """The station in the simulator."""
    if isinstance(station, ConicalStationCfg):
        return ConicalDock(station, vehicle)
    return LandingDock(station, vehicle)
