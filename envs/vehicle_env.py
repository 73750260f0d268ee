"""What every docking environment shares: action, senses, reward, endings, pictures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Generic, TypeVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from auvdock.controllers.allocation import AllocationCfg
from auvdock.controllers.autopilot import AutopilotCfg
from auvdock.core.arrays import Array, Image
from auvdock.core.contracts import Command, Percept, Proprioception, Sensed
from auvdock.envs.actions import checked_action
from auvdock.envs.chase import ChaseCamera, View, from_behind
from auvdock.envs.options import check_options, reward_settings, world_settings
from auvdock.envs.reward import RewardCfg
from auvdock.envs.vehicle_world import AnyWorldCfg, VehicleWorld
from auvdock.estimation.perceiver import Perceiver
from auvdock.metrics.tick import Metrics, Tick
from auvdock.sim.simulator import Simulator
from auvdock.sim.truth import Truth

__all__ = ["BOUND", "Observation", "VehicleEnv", "box", "proprioception_vector"]

BOUND = 20_000.0
"""Bound of every observed number, in its own unit."""

Observation = Array | dict[str, Any]

W = TypeVar("W", bound=AnyWorldCfg)
S = TypeVar("S")
P = TypeVar("P")


class VehicleEnv(gymnasium.Env[Any, Any], ABC, Generic[W, S, P]):
    """A `VehicleWorld` as a Gymnasium environment; a kind of docking says what is observed and how far it is to go.

    A copy, by `copy.deepcopy` or pickle, goes on in mid-episode as the original does, bit for bit. OpenGL contexts are
    not copied: a copy makes its own at its first picture.

    Attributes:
        default_cfg: makes the world's settings (type W) where no `cfg` is given; their `start` is of the type S.
        default_perception: makes perception's settings (type P) where none are given.
        perceived: makes the world and what perceives it.
        judged: makes what gathers an episode's metrics in that world.
        own_camera: `render_camera` of the pilot's camera.
        chase_view: where the chase camera stands.
        allocation_cfg: how the action wrappers share a wrench among the actuators, as the station's own pilot does.
        autopilot_cfg: the autopilot that `SetPointAction` steers by.
        cfg: the world's settings.
        observation: one of `auvdock.envs.options.OBSERVATIONS`.
        reward_cfg: what a step pays.
        control_s: length of a step in s.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 30}  # noqa: RUF012 - each has its own

    default_cfg: Callable[[], W]
    default_perception: Callable[[], P]
    perceived: Callable[[W, P], tuple[VehicleWorld, Perceiver]]
    judged: Callable[[Any], list[Metrics]]
    own_camera = "bow"
    chase_view: Callable[[Simulator], View] = staticmethod(from_behind)
    allocation_cfg: ClassVar[AllocationCfg] = AllocationCfg()
    autopilot_cfg: ClassVar[AutopilotCfg] = AutopilotCfg()

    def __init__(
        self,
        cfg: W | None = None,
        *,
        observation: str = "state",
        fidelity: str | None = None,
        start: S | Mapping[str, Any] | None = None,
        reward: RewardCfg | Mapping[str, Any] | None = None,
        time_limit_s: float | None = None,
        perception: P | None = None,
        render_mode: str | None = None,
        render_camera: str = "chase",
    ) -> None:
        """Build the environment; no renderer is made before an image is asked for.

        Raises:
            ConfigError: an option that does not exist or does not fit the others.
        """
        self.cfg = cfg = world_settings(self.default_cfg(), cfg, observation, fidelity, start, time_limit_s)
        check_options(observation, cfg.fidelity, render_mode, render_camera, ("chase", self.own_camera))
        self.observation = observation
        self.reward_cfg = reward_settings(reward)
        self.render_mode = render_mode
        self.metadata = {**type(self).metadata, "render_fps": round(cfg.control_hz, 3)}
        self.control_s = 1.0 / cfg.control_hz
        self._takes_frames = cfg.fidelity == "pixels" and observation != "state"
        self._halt: str | None = "not begun"
        self._render_camera = render_camera
        self._world, self._perceiver = self.perceived(cfg, perception or self.default_perception())
        self._chase = ChaseCamera(self._world.simulator, self.chase_view)
        self._sensed: Sensed | None = None
        self._percept: Any = None
        """The newest frame's percept, of the kind that the station's perceiver gives; None before the first."""
        self._newest: Percept | None = None
        """The percept of this control period; None if it had no frame, or if perception does not look."""
        self._metrics: list[Metrics] = []
        self._image: Image | None = None
        self._distance_m = 0.0
        self._energy_j = 0.0
        self._actuators = len(self._world.simulator.vehicle.actuators)
        self.action_space = spaces.Box(-1.0, 1.0, (self._actuators,), np.float32)
        self.observation_space = self._make_observation_space()

    @abstractmethod
    def _pose_spaces(self) -> dict[str, spaces.Space[Any]]:
        """Spaces of what perception sees."""

    @abstractmethod
    def _pose_vectors(self) -> dict[str, Array]:
        """What perception sees."""

    @abstractmethod
    def _place(self, truth: Truth) -> Array:
        """(3,) where the vehicle is in the station frame, for the state observation."""

    @abstractmethod
    def _distance_to_go_m(self, truth: Truth) -> float:
        """Distance from where the latch closes."""

    def _forget(self) -> None:
        """Start an episode without anything perceived."""
        self._perceiver.reset()
        self._percept = self._newest = None
        self._metrics = self.judged(self._world)

    def _perceive(self, sensed: Sensed) -> None:
        """Let perception look at what was sensed."""
        self._newest = self._perceiver.perceive(sensed)
        self._percept = self._newest or self._percept

    @property
    def world(self) -> VehicleWorld:
        """The world inside, for metrics."""
        return self._world

    @property
    def proprioception(self) -> Proprioception:
        """The vehicle's own sensors at the last step; what the action wrappers steer by.

        Raises:
            ResetNeeded: the environment has not been reset.
        """
        if self._sensed is None:
            raise ResetNeeded("the episode has not begun: call env.reset() first")
        return self._sensed.proprioception

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the episode's own seed is drawn from the environment's generator."""
        super().reset(seed=seed)
        self._world.reset(int(self.np_random.integers(2**31)))
        self._forget()
        self._image = None
        self._sense()
        truth = self._world.truth
        self._distance_m = self._distance_to_go_m(truth)
        self._energy_j = 0.0
        self._halt = None
        return self._observe(truth), self._info(truth)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:  # noqa: ANN401
        """Apply actuator commands for one control period.

        Raises:
            ResetNeeded: before the first `reset`, or after the step that ended the episode.
            ValueError: an action of another shape, or one that holds something that is not a number.
        """
        if self._halt is not None:
            raise ResetNeeded(f"the episode has {self._halt}: call env.reset() before the next step")
        world = self._world
        values = checked_action(action, self._actuators)
        tick = Tick(world.truth, self.proprioception, None, self._newest, Command(values))
        for each in self._metrics:
            each.add(tick)
        world.step(values)
        self._sense()
        truth = world.truth
        end = world.end
        success = world.is_success
        truncated = not success and end == "timeout"
        terminated = success or (end is not None and not truncated)
        if terminated or truncated:
            self._halt = f"ended ({'success' if success else end})"
        info = self._info(truth)
        if self._halt is not None:
            info |= self.episode_metrics()
        return self._observe(truth), self._reward(truth, success, end), terminated, truncated, info

    def episode_metrics(self) -> dict[str, Any]:
        """The episode's metrics so far, named as in `auvdock.episode.result.EpisodeResult`; docs/metrics.md tells them.

        The `info` of the step that ends an episode has them; where a wrapper ends it (`max_episode_steps`), ask here.
        Those of perception need the observation "pose": nobody perceives otherwise.
        """
        truth = self._world.truth
        found: dict[str, Any] = {"path_length_m": truth.path_length_m}
        for each in self._metrics:
            found |= each.fields(truth)
        return found

    def render(self) -> Any:  # noqa: ANN401
        """An image (H, W, 3) uint8 from behind and above the vehicle, or what the pilot's camera sees."""
        if self.render_mode is None:
            return None
        if self._render_camera == "chase":
            return self._chase.render()
        if self._image is not None:
            return self._image
        if self._takes_frames:
            return self._blank()  # no frame has come through yet, and taking one here would change the episode
        return self._world.picture()

    def close(self) -> None:
        """Release the renderers."""
        self._world.close()
        self._chase.close()

    def _sense(self) -> None:
        if self.observation == "state":
            # Nobody looks through the camera, so no frame is made.
            self._sensed = Sensed(self._world.simulator.proprioception())
            return
        self._sensed = sensed = self._world.sense()
        if sensed.frame is not None:
            self._image = sensed.frame.image
        if self.observation == "pose":
            self._perceive(sensed)

    def _reward(self, truth: Truth, success: bool, end: str | None) -> float:
        distance_m = self._distance_to_go_m(truth)
        progress_m, work_j = self._distance_m - distance_m, truth.energy_j - self._energy_j
        self._distance_m, self._energy_j = distance_m, truth.energy_j
        return float(self.reward_cfg.of(progress_m, work_j, self.control_s, success=success, end=end))

    def _info(self, truth: Truth) -> dict[str, Any]:
        success = self._world.is_success
        return {
            "is_success": success,
            "failure_reason": None if success else self._world.end,
            "time_s": truth.time_s,
            "peak_contact_force_n": truth.peak_contact_force_n,
            "energy_j": truth.energy_j,
        }

    def _make_observation_space(self) -> spaces.Space[Any]:
        if self.observation == "state":
            return box(19)
        if self.observation == "pose":
            return spaces.Dict(self._pose_spaces())
        camera = self._world.camera
        return spaces.Dict(
            {
                "image": spaces.Box(0, 255, (camera.height_px, camera.width_px, 3), np.uint8),
                "proprioception": box(13),
            }
        )

    def _observe(self, truth: Truth) -> Observation:
        if self.observation == "state":
            return self._state(truth)
        own = proprioception_vector(self.proprioception)
        if self.observation == "image":
            image = self._image if self._image is not None else self._blank()
            return {"image": image.copy(), "proprioception": own}
        return {**self._pose_vectors(), "proprioception": own}

    def _state(self, truth: Truth) -> Array:
        R_station_world = self._world.simulator.T_world_station[:3, :3].T
        rotation = R_station_world @ truth.T_world_body[:3, :3]
        state = np.concatenate(
            [
                self._place(truth),
                rotation[:, 0],
                rotation[:, 1],
                truth.nu_body,
                R_station_world @ truth.current_world_m_s,
                [float(truth.touching_station)],
            ]
        )
        return np.clip(np.nan_to_num(state, nan=BOUND), -BOUND, BOUND)  # a diverged state must stay in its space

    def _blank(self) -> Image:
        camera = self._world.camera
        return np.zeros((camera.height_px, camera.width_px, 3), dtype=np.uint8)


def box(*shape: int) -> spaces.Box:
    """A box of the bound that all observations have."""
    return spaces.Box(-BOUND, BOUND, shape, np.float64)


def proprioception_vector(own: Proprioception) -> Array:
    """(13,) depth; roll, pitch, yaw; p, q, r; velocity over ground; velocity through the water."""
    return np.concatenate(
        [
            [own.depth_m],
            own.euler_zyx_rad,
            own.angular_velocity_rad_s,
            own.velocity_ground_m_s,
            own.velocity_water_m_s,
        ]
    )
