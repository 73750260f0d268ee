"""What every docking world shares: simulator and camera behind one reset, step and sense. No controller inside."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from auvdock.assets import asset_names
from auvdock.core.arrays import Array, Image
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.contracts import Proprioception, Sensed
from auvdock.core.errors import ConfigError, located
from auvdock.core.marine import flip_vector
from auvdock.core.stations import StationCfg
from auvdock.core.strict import load_toml
from auvdock.core.vehicle import MountCfg, VehicleCfg, load_vehicle
from auvdock.envs.config import WorldCfg
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.latency import CommandLink
from auvdock.optics.detection_model import DetectionModelCfg, load_detection_model
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.water import water_of
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.simulator import Simulator
from auvdock.sim.truth import Truth

__all__ = ["AnyWorldCfg", "Start", "VehicleWorld", "detection_model", "mounted_camera"]


@dataclass(frozen=True, eq=False)
class Start:
    """How an episode starts.

    Attributes:
        position_m: (3,) of the body in the world.
        quat_wxyz: (4,) attitude.
        current: the water's motion in this episode.
        compass_datum_rad: added to every compass reading of the episode.
    """

    position_m: Array
    quat_wxyz: Array
    current: CurrentCfg
    compass_datum_rad: float = 0.0


AnyWorldCfg: TypeAlias = WorldCfg | LandingWorldCfg
"""Configuration of any world."""


class VehicleWorld(ABC):
    """A vehicle, a station, the water between them and a camera.

    Randomness is split by purpose: start pose and current, physics and sensors, camera, clock and lost frames. Changing
    what one of them draws leaves the others as they were. A world for another kind of docking says where it starts and
    how it looks.

    Attributes:
        simulator: the truth.
        camera: the camera that the pilot looks through.
        water: the water.
    """

    def __init__(self, cfg: AnyWorldCfg, station: StationCfg, make_camera: Callable[[VehicleCfg], Camera]) -> None:
        """Build simulator, camera and water.

        Args:
            cfg: the world.
            station: its station.
            make_camera: makes the camera that the pilot looks through, where the vehicle's data puts it.

        Raises:
            ConfigError: a preset that does not exist or a value that does not fit.
        """
        with located("world.station."):
            _ = station.layout  # before whoever uses it: here it is known where its settings lie
        with located("world.sim."):
            vehicle = load_vehicle(cfg.sim.vehicle, cfg.sim.battery_v)
        with located("world.camera."):
            self.camera = make_camera(vehicle)
        with located("world."):
            self.water = water_of(cfg.water, cfg.attenuation_per_m, cfg.turbidity_per_m)
        self.simulator = Simulator(cfg.sim, station, vehicle)  # last: its loops may have to be compiled
        self._limits, self._hold_s, self._control_s = cfg.limits, station.latch.hold_s, 1.0 / cfg.control_hz
        self._steps_per_control = round(cfg.sim.physics_hz / cfg.control_hz)
        self._steps_per_frame = round(cfg.sim.physics_hz / self.camera.rate_hz)
        self._link = CommandLink(cfg.latency, len(vehicle.actuators), cfg.sim.physics_hz)
        self._step_count = 0
        self._last_frame_step = -1
        self._latched_at_s: float | None = None
        self._station_m: list[float] = self.simulator.T_world_station[:3, 3].tolist()
        self._start_distance_m = 0.0
        self._truth: Truth | None = None
        self._renders_apart = cfg.fidelity == "beacons"
        self._seed, self._pictured = 0, False
        self._camera_rng: np.random.Generator | None = None

    @abstractmethod
    def _draw_start(self, rng: np.random.Generator) -> Start:
        """Draw an episode's start."""

    @abstractmethod
    def _reset_camera(self, rng: np.random.Generator) -> None:
        """Start an episode's optics."""

    def _reset_link(self, rng: np.random.Generator) -> None:  # noqa: B027 - most worlds have none
        """Start an episode's clock error and what gets lost on the way to the computer; nothing by default."""

    @abstractmethod
    def _look(self, truth: Truth, proprioception: Proprioception) -> Sensed:
        """Take a frame, or what stands in for it."""

    @abstractmethod
    def _rendered_camera(self) -> UnderwaterCamera:
        """The camera that the pilot looks through, as one that renders."""

    def picture(self) -> Image:
        """(H, W, 3) uint8 RGB of what the pilot's camera sees now, in whatever fidelity.

        In `beacons` a camera that the episode does without takes it, under the same lights: which pictures an episode
        shows follows from its seed and from when they were asked for, and the episode does not depend on them.
        """
        camera = self._rendered_camera()
        if not self._renders_apart:
            self._start_camera()
        elif not self._pictured:
            self._pictured = True
            camera.reset(_streams(self._seed)[2])
        truth = self.truth
        return camera.capture(truth.T_world_body, truth.time_s).image

    @abstractmethod
    def close(self) -> None:
        """Release the renderer."""

    def reset(self, seed: int) -> None:
        """Start a new episode; the seed alone decides everything that is drawn in it."""
        start, physics, camera, link = _streams(seed)
        drawn = self._draw_start(start)
        self.simulator.reset(
            drawn.position_m,
            drawn.quat_wxyz,
            physics,
            current=drawn.current,
            compass_datum_rad=drawn.compass_datum_rad,
        )
        self._camera_rng = camera
        self._link.reset()
        self._reset_link(link)
        self._step_count = 0
        self._last_frame_step = -self._steps_per_frame
        self._latched_at_s = None
        self._truth = None
        self._start_distance_m = self._distance_m()
        self._seed, self._pictured = seed, False

    def step(self, values: Array) -> None:
        """Give actuator commands (n,) in [-1, 1], which act after the latency, and fly on for one control period."""
        for acting, steps in self._link.segments(values, self._steps_per_control):
            self.simulator.step(acting, steps)
        self._link.sensed()  # an observation of the state alone does without `sense`
        self._step_count += self._steps_per_control
        self._truth = None
        if self._latched_at_s is None and self.truth.latched:
            self._latched_at_s = self.truth.time_s

    def sense(self) -> Sensed:
        """Sample the sensors now; once per control period."""
        sensed = self._sense()
        self._link.sensed()
        return sensed

    def _sense(self) -> Sensed:
        proprioception = self.simulator.proprioception()
        if self._step_count - self._last_frame_step < self._steps_per_frame:
            return Sensed(proprioception)
        self._last_frame_step = self._step_count
        self._start_camera()
        return self._look(self.truth, proprioception)

    def _start_camera(self) -> None:
        """Start the episode's optics when the first frame is due: an episode in which nobody looks does without."""
        if self._camera_rng is not None:
            self._reset_camera(self._camera_rng)
            self._camera_rng = None

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
        if truth.peak_contact_force_n > self._limits.collision_force_n:
            return "collision"
        if self._latched_at_s is not None and not truth.docked:
            held_s = truth.time_s - self._latched_at_s
            if held_s > self._hold_s + self._control_s:
                return "terminal"  # held, but entered too fast or too far askew: that will not change any more
        if truth.broached_s >= self._limits.surfaced_s:
            return "surfaced"
        if self._distance_m() - self._start_distance_m > self._limits.carried_off_m:
            return "carried_off"
        if truth.time_s >= self._limits.max_time_s - 1e-9:
            return "timeout"
        return None

    def _distance_m(self) -> float:
        """Of the vehicle from the station."""
        return math.dist(self.truth.T_world_body[:3, 3].tolist(), self._station_m)

    @property
    def is_success(self) -> bool:
        """Latched, held, and within the limits of the station's latch."""
        return self.truth.docked


def _streams(seed: int) -> list[np.random.Generator]:
    """Generators of an episode: start, physics and sensors, camera, clock and lost frames."""
    return [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4)]


def detection_model(path: str | None, detector: str) -> DetectionModelCfg:
    """The fitted behaviour that the `beacons` fidelity draws from: of a file, or the detector's own.

    Raises:
        ConfigError: nothing was fitted for that detector.
    """
    if path is not None:
        return load_toml(DetectionModelCfg, Path(path))
    if detector not in asset_names("detection"):
        remedy = "world.detection_model a file that `auvdock fit-detector` wrote for it, or fidelity 'pixels'"
        raise ConfigError(
            "perception.detector", detector, f"{remedy}: the beacons fidelity knows only fitted detectors"
        )
    return load_detection_model(detector)


def mounted_camera(cfg: CameraCfg, mount: MountCfg) -> Camera:
    """A camera where the vehicle's data puts it."""
    return make_camera(
        cfg,
        flip_vector(np.array(mount.position_m)),
        flip_vector(np.array(mount.direction)),
        flip_vector(np.array(mount.up)),
    )
