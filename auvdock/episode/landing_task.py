"""Landing on the platform."""

from __future__ import annotations

from typing import cast

from auvdock.controllers.landing.pilot import LandingPilot
from auvdock.controllers.named import PilotFactory, find_pilot, make_named_pilot
from auvdock.core.contracts import Percept
from auvdock.core.errors import located
from auvdock.envs.landing_world import LandingWorld
from auvdock.envs.vehicle_world import Sensed
from auvdock.episode.config import LandingEpisodeCfg
from auvdock.episode.landing_metrics import LandingMetrics
from auvdock.episode.result import stage_of
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.perception.detectors import make_detector
from auvdock.perception.landing.tag_detectors import make_tag_detector

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

    name = "landing station"

    def __init__(self, cfg: LandingEpisodeCfg) -> None:
        """Build world, detectors, perception and pilot.

        Raises:
            ConfigError: a name that does not exist or a value that does not fit.
        """
        self.station = cfg.world.station
        self.detector = cfg.perception.detector
        with located("perception."):
            self._detector = make_detector(self.detector)
            self._tag_detector = make_tag_detector(cfg.perception.tag_detector, (self.station.tag.tag_id,))
        with located("control."):
            find_pilot(cfg.control.controller)  # before the world, whose loops may have to be compiled
        self.world = LandingWorld(cfg.world, self.detector, cfg.perception.tag_detector)
        vehicle, camera = self.world.simulator.vehicle, self.world.camera
        self._perception = LandingEstimator(cfg.perception, camera, self.station)
        # It reads more of a percept than other pilots do; `perceive` gives it no other.
        own = cast(PilotFactory, LandingPilot)
        dt_s = 1.0 / cfg.world.control_hz
        control = cfg.control
        with located("control."):
            self.pilot = make_named_pilot(control.controller, own, control, vehicle, self.station, camera, dt_s)

    def reset(self) -> None:
        """Forget the pose and its filter."""
        self._perception.reset()

    def perceive(self, sensed: Sensed) -> Percept | None:
        """Perception's answer to what was sensed; None if there was no new frame."""
        own = sensed.proprioception
        if sensed.frame is not None:
            tags = self._tag_detector.detect(sensed.frame, self._perception.tag_regions(own))
            return self._perception.update(self._detector.detect(sensed.frame), tags, own)
        if sensed.detections is not None:
            return self._perception.update(sensed.detections, sensed.tags, own)
        return None

    def metrics(self) -> LandingMetrics:
        """Metrics of a new episode."""
        simulator = self.world.simulator
        return LandingMetrics(self.world.camera, simulator.vehicle, simulator.T_world_station)

    def stage(self, mode: str) -> str:
        """The failure reason of an episode that ends in a guidance mode."""
        return stage_of(mode, _STAGES)
