"""Landing on the platform."""

from __future__ import annotations

from typing import cast

from auvdock.controllers.landing.pilot import LandingPilot
from auvdock.controllers.named import PilotFactory, find_pilot, make_named_pilot
from auvdock.core.errors import located
from auvdock.envs.perceived import perceived_landing
from auvdock.episode.config import LandingEpisodeCfg
from auvdock.episode.landing_metrics import LandingMetrics
from auvdock.episode.result import stage_of

__all__ = ["LandingTask"]

_STAGES = {
    "search": "search",
    "approach": "far",
    "align": "mid",
    "descend": "near",
    "touchdown": "terminal",
    "docked": "terminal",
    "abort": "timeout",
}
"""Failure reasons by guidance mode."""


class LandingTask:
    """Implements `auvdock.episode.task.Task` for `LandingEpisodeCfg`."""

    kind = "landing"

    def __init__(self, cfg: LandingEpisodeCfg) -> None:
        """Build world, perception and pilot.

        Raises:
            ConfigError: a name that does not exist or a value that does not fit.
        """
        self.station = cfg.world.station
        self.detector = cfg.perception.detector
        with located("control."):
            find_pilot(cfg.control.controller)  # before the world, whose loops may have to be compiled
        self.world, self.perceiver = perceived_landing(cfg.world, cfg.perception)
        vehicle, camera = self.world.simulator.vehicle, self.world.camera
        own = cast(PilotFactory, LandingPilot)  # it reads more of a percept than others do; it is given no other
        dt_s = 1.0 / cfg.world.control_hz
        control = cfg.control
        with located("control."):
            self.pilot = make_named_pilot(control.controller, own, control, vehicle, self.station, camera, dt_s)

    def metrics(self) -> LandingMetrics:
        """Metrics of a new episode."""
        simulator = self.world.simulator
        return LandingMetrics(self.world.camera, simulator.vehicle, simulator.T_world_station)

    def stage(self, mode: str) -> str:
        """The failure reason of an episode that ends in a guidance mode."""
        return stage_of(mode, _STAGES)
