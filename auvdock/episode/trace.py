"""What an episode shows to whoever watches it: recorders, progress displays, plots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.stations import StationCfg
from auvdock.core.vehicle import VehicleCfg
from auvdock.episode.result import EpisodeResult
from auvdock.metrics.tick import Tick

__all__ = ["EpisodeObserver", "EpisodeSetup"]


@dataclass(frozen=True, eq=False)
class EpisodeSetup:
    """What stays the same for a whole episode.

    Attributes:
        title: station, seed and fidelity in a few words.
        kind: of the station, one of `auvdock.episode.stations.STATIONS`.
        station: the station with its lights.
        vehicle: the vehicle.
        camera: the camera that the pilot looks through.
        T_world_station: (4, 4).
        detector: name of the detector.
        water: name of the water.
    """

    title: str
    kind: str
    station: StationCfg
    vehicle: VehicleCfg
    camera: Camera
    T_world_station: Array
    detector: str
    water: str


class EpisodeObserver(Protocol):
    """Watches an episode."""

    def on_start(self, setup: EpisodeSetup) -> None:
        """Called once, before the first tick."""
        ...

    def on_tick(self, tick: Tick) -> None:
        """Called after each control period."""
        ...

    def on_end(self, result: EpisodeResult) -> None:
        """Called once, however the episode ended."""
        ...

    def close(self) -> None:
        """Release files; called even if the episode was interrupted."""
        ...
