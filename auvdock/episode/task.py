"""What an episode is made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from auvdock.controllers.pilot import Pilot
from auvdock.core.stations import StationCfg
from auvdock.envs.vehicle_world import VehicleWorld
from auvdock.episode.trace import Tick
from auvdock.perception.perceiver import Perceiver
from auvdock.sim.truth import Truth

__all__ = ["Task", "TaskMetrics"]


class TaskMetrics(Protocol):
    """Gathers an episode's metrics tick by tick."""

    def add(self, tick: Tick) -> None:
        """Take in one control period."""
        ...

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """The fields of `EpisodeResult` that this kind of docking fills, at the episode's end; the others keep None."""
        ...


class Task(Protocol):
    """One kind of docking: a world, what perceives it, who flies in it, and how it is judged."""

    @property
    def kind(self) -> str:
        """The kind of station, one of `auvdock.episode.stations.STATIONS`."""
        ...

    @property
    def station(self) -> StationCfg:
        """The station."""
        ...

    @property
    def detector(self) -> str:
        """Name of the detector."""
        ...

    @property
    def world(self) -> VehicleWorld:
        """Vehicle, station, water and camera."""
        ...

    @property
    def pilot(self) -> Pilot[Any]:
        """Flies the vehicle."""
        ...

    @property
    def perceiver(self) -> Perceiver:
        """Makes percepts of what the vehicle senses."""
        ...

    def metrics(self) -> TaskMetrics:
        """Metrics of a new episode."""
        ...

    def stage(self, mode: str) -> str:
        """The failure reason (`FAILURE_REASONS`) of an episode that ends in a guidance mode."""
        ...
