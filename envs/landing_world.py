"""The world of landing: the vehicle looks down on the platform with its belly camera."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.calibrated_camera import CalibratedCameraCfg, make_calibrated_camera
from auvdock.core.camera import Camera
from auvdock.core.contracts import Proprioception, Sensed
from auvdock.core.errors import located
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.marine import flip_vector
from auvdock.core.strict import load_toml
from auvdock.core.transforms import quat_wxyz_from_euler_zyx
from auvdock.core.vehicle import VehicleCfg
from auvdock.envs.landing_config import LandingStartCfg, LandingWorldCfg
from auvdock.envs.vehicle_world import Start, VehicleWorld
from auvdock.optics.detection_model import DetectionModelCfg
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.landing_sensing import LandingSensor
from auvdock.optics.setup import OpticalSetup
from auvdock.sim.truth import Truth

__all__ = ["LandingWorld", "belly_camera", "draw_landing_start"]


def draw_landing_start(
    cfg: LandingStartCfg, station: LandingStationCfg, vehicle: VehicleCfg, rng: np.random.Generator
) -> tuple[Array, Array]:
    """A start pose: position (3,) of the body in the world and quaternion wxyz (4,), drawn uniformly within `cfg`."""
    x = rng.uniform(-cfg.lateral_m, cfg.lateral_m)
    y = rng.uniform(-cfg.lateral_m, cfg.lateral_m)
    height = rng.uniform(cfg.min_height_m, cfg.max_height_m)
    yaw = math.radians(rng.uniform(-cfg.heading_deg, cfg.heading_deg))
    up, side = math.cos(yaw), math.sin(yaw)
    seat_x, seat_y, seat_z = vehicle.seat_body_m.tolist()
    seat = np.array([up * seat_x - side * seat_y, side * seat_x + up * seat_y, seat_z])
    place = np.array([x, y, station.guide.seat_height_m + height - station.depth_m])
    return place - seat, quat_wxyz_from_euler_zyx(0.0, 0.0, yaw)


class LandingWorld(VehicleWorld):
    """A vehicle, a platform on the floor, the water between them and a belly camera with lamps."""

    def __init__(self, cfg: LandingWorldCfg, detector: str = "cores", tag_detector: str = "apriltag") -> None:
        """Build the world; no OpenGL context is made before a frame is asked for.

        Args:
            cfg: the world.
            detector: name of the detector of lights that the `beacons` fidelity draws from; unused in `pixels`.
            tag_detector: likewise of tags.

        Raises:
            ConfigError: a preset that does not exist or a value that does not fit.
        """
        super().__init__(cfg, cfg.station, lambda vehicle: belly_camera(cfg.camera, vehicle))
        self.cfg = cfg
        optics = OpticalSetup(
            self.camera,
            self.water,
            cfg.station.layout,
            self.simulator.T_world_station,
            cfg.imaging,
            cfg.nuisance,
            lamp=cfg.lamp,
            tag=cfg.station.tag,
            faults=cfg.faults,
            seen_from="above",
        )
        with located("world.faults."):
            self.imager = UnderwaterCamera(optics, self.simulator)
        self._sensor: LandingSensor | None = None
        if cfg.fidelity == "beacons":
            path = cfg.detection_model
            model = None if path is None else load_toml(DetectionModelCfg, Path(path))
            with located("perception."):
                self._sensor = LandingSensor(
                    optics, cfg.station, detector_name=detector, tag_detector_name=tag_detector, model=model
                )

    def _draw_start(self, rng: np.random.Generator) -> Start:
        cfg = self.cfg
        position_m, quat_wxyz = draw_landing_start(cfg.start, cfg.station, self.simulator.vehicle, rng)
        direction_deg = float(rng.uniform(0.0, 360.0))
        current = cfg.sim.current
        if cfg.start.random_current_direction:
            current = dataclasses.replace(current, direction_deg=direction_deg)
        return Start(position_m, quat_wxyz, current)

    def _reset_camera(self, rng: np.random.Generator) -> None:
        (self._sensor or self.imager).reset(rng)

    def _look(self, truth: Truth, proprioception: Proprioception) -> Sensed:
        if self._sensor is not None:
            detections, tags = self._sensor.detect(truth.T_world_body, truth.time_s)
            return Sensed(proprioception, detections=detections, tags=tags)
        return Sensed(proprioception, self.imager.capture(truth.T_world_body, truth.time_s))

    def _rendered_camera(self) -> UnderwaterCamera:
        return self.imager

    def close(self) -> None:
        """Release the renderer."""
        self.imager.close()


def belly_camera(cfg: CalibratedCameraCfg, vehicle: VehicleCfg) -> Camera:
    """The belly camera where the vehicle's data puts it."""
    mount = vehicle.belly_camera
    return make_calibrated_camera(
        cfg,
        flip_vector(np.array(mount.position_m)),
        flip_vector(np.array(mount.direction)),
        flip_vector(np.array(mount.up)),
    )
