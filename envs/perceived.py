"""Worlds together with what perceives and what judges in them, made alike for environments and for episodes."""

from __future__ import annotations

from auvdock.core.errors import ConfigError, located
from auvdock.envs.config import WorldCfg
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.landing_world import LandingWorld
from auvdock.envs.world import DockingWorld
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.estimation.perceiver import BeaconPerceiver, LandingPerceiver
from auvdock.metrics.guidance import ConicalMetrics
from auvdock.metrics.landing import LandingMetrics
from auvdock.metrics.rotating import RotatingMetrics
from auvdock.metrics.tick import Metrics
from auvdock.perception.detectors import make_detector, make_station_detector
from auvdock.perception.landing.config import LandingPerceptionCfg
from auvdock.perception.landing.tag_detectors import make_tag_detector
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg

__all__ = ["docking_metrics", "landing_metrics", "perceived_docking", "perceived_landing"]

_DRAWN_FAMILY = "36h11"


def perceived_docking(cfg: WorldCfg, perception: PerceptionCfg) -> tuple[DockingWorld, BeaconPerceiver]:
    """The world of docking into a funnel, with or without a rotating beacon, and what perceives its lights.

    Raises:
        ConfigError: a name that does not exist or a value that does not fit.
    """
    station = cfg.station
    with located("perception."):  # before the world, whose loops may have to be compiled
        detector = make_station_detector(perception.detector, station)
    world = DockingWorld(cfg, perception.detector)
    surveyed = cfg.station_heading == "surveyed"
    lights = BeaconPerception(perception, world.camera, station.layout, station.rotating, heading_surveyed=surveyed)
    return world, BeaconPerceiver(detector, lights)


def perceived_landing(cfg: LandingWorldCfg, perception: LandingPerceptionCfg) -> tuple[LandingWorld, LandingPerceiver]:
    """The world of landing and what perceives its lights and its tag.

    Raises:
        ConfigError: a name that does not exist or a value that does not fit.
    """
    with located("perception."):
        detector = make_detector(perception.detector)
        tag = perception.tag
        if tag.family != _DRAWN_FAMILY:
            raise ConfigError("tag.family", tag.family, f"{_DRAWN_FAMILY}, the one that the world draws")
        tag_detector = make_tag_detector(perception.tag_detector, (cfg.station.tag.tag_id,), tag.family, tag.clahe)
    world = LandingWorld(cfg, perception.detector, perception.tag_detector)
    return world, LandingPerceiver(detector, tag_detector, LandingEstimator(perception, world.camera, cfg.station))


def docking_metrics(world: DockingWorld) -> list[Metrics]:
    """What judges an episode of docking into a funnel, and how a beacon led there where it has to be found first."""
    cfg, camera, T_world_station = world.cfg, world.camera, world.simulator.T_world_station
    metrics: list[Metrics] = [ConicalMetrics(camera, cfg.station, T_world_station)]
    found_anywhere = cfg.station.rotating is not None or cfg.station_heading == "unknown"
    return [*metrics, RotatingMetrics(camera, T_world_station, cfg.station.rotating)] if found_anywhere else metrics


def landing_metrics(world: LandingWorld) -> list[Metrics]:
    """What judges a landing."""
    return [LandingMetrics(world.camera, world.simulator.vehicle, world.simulator.T_world_station)]
