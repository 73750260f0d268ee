"""The docking world: simulator and camera behind one reset, step and sense. No controller inside."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from auvdock.assets import asset_names
from auvdock.core.arrays import Array
from auvdock.core.camera import Camera, make_camera
from auvdock.core.contracts import Detections, Frame, Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.marine import flip_vector
from auvdock.core.strict import load_toml
from auvdock.core.transforms import quat_wxyz_from_euler_zyx
from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.optics.detection_model import DetectionModelCfg, load_detection_model
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.sensing import BeaconSensor
from auvdock.optics.water import load_water, with_attenuation
from auvdock.sim.simulator import Simulator
from auvdock.sim.truth import Truth

__all__ = ["DockingWorld", "Sensed", "draw_start"]


@dataclass(frozen=True, eq=False)
class Sensed:
    """What the vehicle can know at one moment.

    Attributes:
        proprioception: its own sensors.
        frame: a new camera frame, None between frames or where `detections` stands in for it.
        detections: in the `beacons` fidelity, the detections of a new frame, else None.
    """

    proprioception: Proprioception
    frame: Frame | None
    detections: Detections | None


def draw_start(cfg: StartCfg, station_depth_m: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A start pose: position (3,) in the world and quaternion wxyz (4,), drawn uniformly within `cfg`."""
    x = rng.uniform(cfg.min_range_m, cfg.max_range_m)
    y = rng.uniform(-cfg.lateral_m, cfg.lateral_m)
    z = rng.uniform(-cfg.vertical_m, cfg.vertical_m) - station_depth_m
    yaw = math.pi + math.radians(rng.uniform(-cfg.heading_deg, cfg.heading_deg))
    return np.array([x, y, z]), quat_wxyz_from_euler_zyx(0.0, 0.0, yaw)


class DockingWorld:
    """A vehicle, a station, the water between them and a camera.

    Randomness is split by purpose: start pose and current, physics and sensors, camera. Changing what one of them
    draws leaves the others as they were.
    """

    def __init__(self, cfg: WorldCfg, detector: str = "threshold") -> None:
        """Build the world; no OpenGL context is made before a frame is asked for.

        Args:
            cfg: the world.
            detector: name of the detector whose behaviour the `beacons` fidelity draws from; unused in `pixels`.

        Raises:
            ConfigError: a preset that does not exist or a value that does not fit.
        """
        self.cfg = cfg
        self.simulator = Simulator(cfg.sim, cfg.station)
        self.camera = bow_camera(cfg, self.simulator)
        self.water = load_water(cfg.water)
        if cfg.attenuation_per_m is not None:
            self.water = with_attenuation(self.water, cfg.attenuation_per_m)
        optics = (
            self.camera,
            self.water,
            cfg.station.layout,
            cfg.nuisance,
            cfg.imaging,
            self.simulator.T_world_station,
        )
        self.imager = UnderwaterCamera(*optics, scene=self.simulator)
        self._beacon_sensor: BeaconSensor | None = None
        if cfg.fidelity == "beacons":
            self._beacon_sensor = BeaconSensor(*optics, detector, model=_detection_model(cfg, detector))
        self._steps_per_control = round(cfg.sim.physics_hz / cfg.control_hz)
        self._steps_per_frame = round(cfg.sim.physics_hz / cfg.camera.rate_hz)
        self._step_count = 0
        self._last_frame_step = -1
        self._latched_at_s: float | None = None
        self._truth: Truth | None = None

    def reset(self, seed: int) -> None:
        """Start a new episode; the seed alone decides everything that is drawn in it."""
        start, physics, camera = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3))
        position_m, quat_wxyz = draw_start(self.cfg.start, self.cfg.station.depth_m, start)
        direction_deg = float(start.uniform(0.0, 360.0))
        current = self.cfg.sim.current
        if self.cfg.start.random_current_direction:
            current = dataclasses.replace(current, direction_deg=direction_deg)
        self.simulator.reset(position_m, quat_wxyz, physics, current=current)
        (self._beacon_sensor or self.imager).reset(camera)
        self._step_count = 0
        self._last_frame_step = -self._steps_per_frame
        self._latched_at_s = None
        self._truth = None

    def step(self, values: Array) -> None:
        """Apply actuator commands (n,) in [-1, 1] for one control period."""
        for _ in range(self._steps_per_control):
            self.simulator.step(values)
        self._step_count += self._steps_per_control
        self._truth = None
        if self._latched_at_s is None and self.truth.latched:
            self._latched_at_s = self.truth.time_s

    def sense(self) -> Sensed:
        """Sample the sensors now; once per control period."""
        proprioception = self.simulator.proprioception()
        if self._step_count - self._last_frame_step < self._steps_per_frame:
            return Sensed(proprioception, None, None)
        self._last_frame_step = self._step_count
        truth = self.truth
        if self._beacon_sensor is not None:
            return Sensed(proprioception, None, self._beacon_sensor.detect(truth.T_world_body, truth.time_s))
        return Sensed(proprioception, self.imager.capture(truth.T_world_body, truth.time_s), None)

    @property
    def truth(self) -> Truth:
        """The simulator's state, for metrics and rewards; read once a control period, however often it is asked for."""
        if self._truth is None:
            self._truth = self.simulator.truth
        return self._truth

    @property
    def end(self) -> str | None:
        """Why the episode is over, apart from success and the pilot's own decision: a failure reason, or None."""
        truth = self.truth
        if truth.diverged:
            return "diverged"
        if truth.peak_contact_force_n > self.cfg.limits.collision_force_n:
            return "collision"
        if self._latched_at_s is not None and not truth.docked:
            held_s = truth.time_s - self._latched_at_s
            if held_s > self.cfg.station.latch.hold_s + 1.0 / self.cfg.control_hz:
                return "terminal"  # held, but entered too fast or too far askew: that will not change any more
        if truth.time_s >= self.cfg.limits.max_time_s - 1e-9:
            return "timeout"
        return None

    @property
    def is_success(self) -> bool:
        """Latched, held, and within the entry limits of `LatchCfg`."""
        return self.truth.docked

    def close(self) -> None:
        """Release the renderer."""
        self.imager.close()


def _detection_model(cfg: WorldCfg, detector: str) -> DetectionModelCfg:
    if cfg.detection_model is not None:
        return load_toml(DetectionModelCfg, Path(cfg.detection_model))
    if detector not in asset_names("detection"):
        remedy = "world.detection_model a file that `auvdock fit-detector` wrote for it, or fidelity 'pixels'"
        raise ConfigError("detector", detector, f"{remedy}: the beacons fidelity knows only fitted detectors")
    return load_detection_model(detector)


def bow_camera(cfg: WorldCfg, simulator: Simulator) -> Camera:
    """The bow camera where the vehicle's data puts it."""
    mount = simulator.vehicle.bow_camera
    return make_camera(
        cfg.camera,
        flip_vector(np.array(mount.position_m)),
        flip_vector(np.array(mount.direction)),
        flip_vector(np.array(mount.up)),
    )
