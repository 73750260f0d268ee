"""What an episode is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from auvdock.controllers.named import PilotFactory, make_named_pilot
from auvdock.controllers.pilot import Pilot
from auvdock.core.errors import located
from auvdock.core.stations import StationCfg
from auvdock.envs.vehicle_world import VehicleWorld
from auvdock.episode.config import AnyEpisodeCfg
from auvdock.estimation.perceiver import Perceiver
from auvdock.metrics.tick import Metrics

__all__ = ["Task", "make_pilot"]


@dataclass(frozen=True, eq=False)
class Task:
    """One kind of docking: a world, what perceives it, who flies in it, and how it is judged.

    Attributes:
        kind: of the station, one of `auvdock.episode.stations.STATIONS`.
        station: the station.
        detector: name of the detector.
        world: vehicle, station, water and camera.
        perceiver: makes percepts of what the vehicle senses.
        pilot: flies the vehicle.
        metrics: makes the metrics of a new episode.
        stages: failure reasons of guidance modes that have another name (`auvdock.episode.result.stage_of`).
    """

    kind: str
    station: StationCfg
    detector: str
    world: VehicleWorld
    perceiver: Perceiver
    pilot: Pilot[Any]
    metrics: Callable[[], Sequence[Metrics]]
    stages: Mapping[str, str]


def make_pilot(cfg: AnyEpisodeCfg, world: VehicleWorld, own: PilotFactory) -> Pilot[Any]:
    """The pilot that the settings name; `own` makes the package's.

    Raises:
        ConfigError: nothing of that name, or an object that is no pilot.
    """
    vehicle, station, control = world.simulator.vehicle, cfg.world.station, cfg.control
    with located("control."):
        period_s = 1.0 / cfg.world.control_hz
        return make_named_pilot(control.controller, own, control, vehicle, station, world.camera, period_s)
