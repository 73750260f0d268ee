"""The world of conical docking: the vehicle looks ahead with its bow camera."""

from __future__ import annotations

import dataclasses
import math
from functools import cached_property

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.contracts import Proprioception, Sensed
from auvdock.core.transforms import quat_wxyz_from_euler_zyx
from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.envs.vehicle_world import Start, VehicleWorld, detection_model, mounted_camera
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.sensing import BeaconSensor
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.station_clock import StationClock
from auvdock.sim.truth import Truth

__all__ = ["DockingWorld", "draw_start"]


def draw_start(cfg: StartCfg, station_depth_m: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A start pose: position (3,) in the world and quaternion wxyz (4,), drawn uniformly within `cfg`."""
    if cfg.ring:
        radius = rng.uniform(cfg.min_range_m, cfg.max_range_m)
        azimuth = math.radians(rng.uniform(-cfg.azimuth_deg, cfg.azimuth_deg))
        z = rng.uniform(-cfg.vertical_m, cfg.vertical_m) - station_depth_m
        yaw = azimuth + math.pi + math.radians(rng.uniform(-cfg.heading_deg, cfg.heading_deg))
        place = np.array([radius * math.cos(azimuth), radius * math.sin(azimuth), z])
        return place, quat_wxyz_from_euler_zyx(0.0, 0.0, yaw)
    x = rng.uniform(cfg.min_range_m, cfg.max_range_m)
    y = rng.uniform(-cfg.lateral_m, cfg.lateral_m)
    z = rng.uniform(-cfg.vertical_m, cfg.vertical_m) - station_depth_m
    yaw = math.pi + math.radians(rng.uniform(-cfg.heading_deg, cfg.heading_deg))
    return np.array([x, y, z]), quat_wxyz_from_euler_zyx(0.0, 0.0, yaw)


class DockingWorld(VehicleWorld):
    """A vehicle, a conical station, the water between them and a bow camera."""

    def __init__(self, cfg: WorldCfg, detector: str = "threshold") -> None:
        """Build the world; no OpenGL context is made before a frame is asked for.

        Args:
            cfg: the world.
            detector: name of the detector whose behaviour the `beacons` fidelity draws from; unused in `pixels`.

        Raises:
            ConfigError: a preset that does not exist or a value that does not fit.
        """
        model = detection_model(cfg.detection_model, detector) if cfg.fidelity == "beacons" else None
        super().__init__(cfg, cfg.station, lambda vehicle: mounted_camera(cfg.camera, vehicle.bow_camera))
        self.cfg = cfg
        self._clock: StationClock | None = None
        self._loss_rng = np.random.default_rng(0)
        self._optics = OpticalSetup(
            self.camera,
            self.water,
            BeaconLayout(cfg.station.layout.beacons + cfg.extra_lights),
            self.simulator.T_world_station,
            cfg.imaging,
            cfg.nuisance,
            cfg.station.rotating,
        )
        self._beacon_sensor: BeaconSensor | None = None
        if model is not None:
            self._beacon_sensor = BeaconSensor(self._optics, model=model)

    @cached_property
    def imager(self) -> UnderwaterCamera:
        """The camera that renders; made when first asked for, since the `beacons` fidelity does without."""
        return UnderwaterCamera(self._optics, self.simulator)

    def _draw_start(self, rng: np.random.Generator) -> Start:
        position_m, quat_wxyz = draw_start(self.cfg.start, self.cfg.station.depth_m, rng)
        direction_deg = float(rng.uniform(0.0, 360.0))
        current = self.cfg.sim.current
        if self.cfg.start.random_current_direction:
            current = dataclasses.replace(current, direction_deg=direction_deg)
        datum_rad = 0.0
        if self.cfg.station_heading == "unknown":
            datum_rad = float(rng.uniform(-math.pi, math.pi))
        return Start(position_m, quat_wxyz, current, datum_rad)

    def _reset_camera(self, rng: np.random.Generator) -> None:
        (self._beacon_sensor or self.imager).reset(rng)

    def _reset_link(self, rng: np.random.Generator) -> None:
        clock_rng, self._loss_rng = rng.spawn(2)
        self._clock = StationClock(self.cfg.clock, clock_rng) if self.cfg.station.rotating is not None else None

    def _look(self, truth: Truth, proprioception: Proprioception) -> Sensed:
        if self.cfg.frame_drop_share > 0.0 and self._loss_rng.random() < self.cfg.frame_drop_share:
            return Sensed(proprioception)
        station_s = self._clock.station_time_s(truth.time_s) if self._clock is not None else None
        if self._beacon_sensor is not None:
            detections = self._beacon_sensor.detect(truth.T_world_body, truth.time_s, station_s)
            return Sensed(proprioception, detections=detections)
        return Sensed(proprioception, self.imager.capture(truth.T_world_body, truth.time_s, station_s))

    def _rendered_camera(self) -> UnderwaterCamera:
        return self.imager

    def close(self) -> None:
        """Release the renderer."""
        if "imager" in vars(self):
            self.imager.close()
