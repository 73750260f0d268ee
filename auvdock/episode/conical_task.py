"""Docking into the conical station."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from auvdock.controllers.named import find_pilot, make_named_pilot
from auvdock.controllers.pilot import ConicalPilot, Pilot
from auvdock.controllers.rotating.pilot import RotatingPilot
from auvdock.core.errors import located
from auvdock.envs.perceived import perceived_docking
from auvdock.envs.world import DockingWorld
from auvdock.episode.config import EpisodeCfg
from auvdock.episode.metrics import GuidanceMetrics
from auvdock.episode.result import stage_of
from auvdock.episode.rotating_metrics import RotatingMetrics
from auvdock.episode.trace import Tick
from auvdock.sim.truth import Truth

__all__ = ["ConicalTask"]

_STAGES = {"acquire": "search", "abort": "timeout", "docked": "terminal"}
"""Guidance modes whose failure cause has another name."""


class ConicalTask:
    """Implements `auvdock.episode.task.Task` for `EpisodeCfg`."""

    def __init__(self, cfg: EpisodeCfg) -> None:
        """Build world, perception and pilot.

        Raises:
            ConfigError: a name that does not exist or a value that does not fit.
        """
        self.station = cfg.world.station
        self.kind = "conical" if self.station.rotating is None else "rotating"
        self.detector = cfg.perception.detector
        with located("control."):
            find_pilot(cfg.control.controller)  # before the world, whose loops may have to be compiled
        self.world, self.perceiver = perceived_docking(cfg.world, cfg.perception)
        with located("control."):
            self.pilot = make_pilot(cfg, self.world)

    def metrics(self) -> ConicalMetrics:
        """Metrics of a new episode."""
        camera, T_world_station = self.world.camera, self.world.simulator.T_world_station
        rotating = None
        if isinstance(self.pilot, RotatingPilot):
            rotating = RotatingMetrics(camera, T_world_station, self.station.rotating)
        return ConicalMetrics(GuidanceMetrics(camera, self.station, T_world_station), rotating)

    def stage(self, mode: str) -> str:
        """The failure reason of an episode that ends in a guidance mode."""
        return stage_of(mode, _STAGES)


class ConicalMetrics:
    """Precise guidance as paper A counts it, how the nose passed the throat, and how the rotating beacon led."""

    def __init__(self, guidance: GuidanceMetrics, rotating: RotatingMetrics | None = None) -> None:
        """Start empty."""
        self._guidance, self._rotating = guidance, rotating

    def add(self, tick: Tick) -> None:
        """Count one control period; for guidance those without a frame count nothing."""
        if self._rotating is not None:
            self._rotating.add(tick)
        if tick.percept is not None:
            self._guidance.add(tick.truth, tick.percept)

    def fields(self, truth: Truth) -> Mapping[str, Any]:
        """Guidance and entry, named as in `EpisodeResult`."""
        return {
            **vars(self._guidance.summary()),
            "lateral_error_m": truth.entry_lateral_m,
            "vertical_error_m": truth.entry_vertical_m,
            "heading_error_rad": truth.entry_angle_rad,
            "entry_speed_m_s": truth.entry_speed_m_s,
            **(self._rotating.fields() if self._rotating is not None else {}),
        }


def make_pilot(cfg: EpisodeCfg, world: DockingWorld) -> Pilot[Any]:
    """The pilot that the settings name, or the station's own.

    That is the rotating beacon's if there is one or the station's heading is unknown, else the conical one.
    """
    found_anywhere = cfg.world.station.rotating is not None or cfg.world.station_heading == "unknown"
    kind = RotatingPilot if found_anywhere else ConicalPilot
    vehicle, dt_s = world.simulator.vehicle, 1.0 / cfg.world.control_hz
    return make_named_pilot(cfg.control.controller, kind, cfg.control, vehicle, cfg.world.station, world.camera, dt_s)
