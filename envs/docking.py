"""Gymnasium environment for conical docking.

## Description
An autonomous underwater vehicle with a bow camera must find a lit funnel, line up with it and drive into its tube
until a latch closes. Physics, water and light are described in the package's README; success is defined in
`auvdock.core.station.LatchCfg`.

## Action space
`Box(-1, 1, (7,), float32)`, one command per actuator of the vehicle `remus_hybrid`:

| Num | Action | Min | Max | Actuator | Unit at ±1 |
|---|---|---|---|---|---|
| 0 | surge thrust | -1 | 1 | stern | thrust, N |
| 1 | starboard thrust forward | -1 | 1 | fore_lateral | thrust, N |
| 2 | starboard thrust aft | -1 | 1 | aft_lateral | thrust, N |
| 3 | downward thrust forward | -1 | 1 | fore_vertical | thrust, N |
| 4 | downward thrust aft | -1 | 1 | aft_vertical | thrust, N |
| 5 | rudder | -1 | 1 | rudder | angle, rad |
| 6 | elevator | -1 | 1 | elevator | angle, rad |

The limits in newtons and radians stand in `assets/vehicles/remus_hybrid.toml`.

## Observation space
Chosen by `observation`:

All boxes are float64 and bounded by ±1000, which nothing reaches before the episode ends as `diverged`.

`"state"` (default): `Box` of shape (19,), the true state. Privileged: no real vehicle has it.

| Num | Observation | Unit |
|---|---|---|
| 0-2 | nose tip in the station frame, x out of the mouth, y, z | m |
| 3-8 | first two columns of the rotation body to station | - |
| 9-14 | velocity over ground ν: surge, sway (to port), heave (up), roll, pitch, yaw rates | m/s, rad/s |
| 15-17 | current in the station frame | m/s |
| 18 | 1 while touching the station | - |

`"pose"`: `Dict` of what perception and the vehicle's own sensors give; no truth in it.

| Key | Shape | Content |
|---|---|---|
| `pose` | (6,) | camera in the station frame: x, y, z, roll, pitch, yaw of the body as perception sees it |
| `pose_valid` | (1,) | 1 if measured in the newest frame, 0.5 if predicted, 0 if there is none (pose is then 0) |
| `long_range` | (4,) | unit ray to the far light in the camera frame and its score; 0 if none |
| `entrance` | (4,) | unit ray to the red entrance lamps and its score; 0 if none |
| `proprioception` | (13,) | depth; roll, pitch, yaw; p, q, r; velocity over ground; velocity through water |

`"image"`: `Dict` of `image` (height, width, 3) uint8 from the bow camera and `proprioception` as above. Needs
`fidelity="pixels"`.

## Reward
Progress of the nose towards the latch in metres, less 0.001 times the thruster work in joules, plus 100 on success,
less 50 on collision or divergence.

## Starting state
Uniform within `WorldCfg.start`: 15 to 30 m in front of the mouth, ±3 m sideways, ±1.5 m in depth, ±30° of heading.

## Episode end
Terminated by success, a collision harder than `WorldCfg.limits.collision_force_n`, divergence, or a latch that closed
on an entry outside its limits (`terminal`). Truncated after `WorldCfg.limits.max_time_s`. `info` always has
`is_success` (bool) and `failure_reason` (str or None).

## Arguments
`cfg` (`WorldCfg`), `observation` ("state", "pose", "image"), `fidelity` ("pixels", "beacons"), `perception`
(`PerceptionCfg`, used by "pose"), `render_mode` ("rgb_array"), `render_camera` ("chase" or "bow").

## Version history
- v0: first version.
"""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces

from auvdock.core.arrays import Array, Image
from auvdock.core.contracts import AzimuthFix, Percept, Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import euler_zyx_from_rotation, invert
from auvdock.envs.chase import ChaseCamera
from auvdock.envs.config import WorldCfg
from auvdock.envs.world import DockingWorld, Sensed
from auvdock.perception.detectors import make_station_detector
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg
from auvdock.sim.truth import Truth

__all__ = ["OBSERVATIONS", "DockingEnv"]

OBSERVATIONS = ("state", "pose", "image")
BOUND = 1000.0
"""Bound of every observed number, in its own unit."""

Observation = Array | dict[str, Any]


class DockingEnv(gymnasium.Env[Any, Any]):
    """`auvdock/ConicalDocking-v0`; see the module's docstring for the tables."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 30}

    def __init__(
        self,
        cfg: WorldCfg | None = None,
        *,
        observation: str = "state",
        fidelity: str = "beacons",
        perception: PerceptionCfg | None = None,
        render_mode: str | None = None,
        render_camera: str = "chase",
    ) -> None:
        """Build the environment; no renderer is made before an image is asked for.

        Raises:
            ConfigError: an option that does not exist or does not fit the others.
        """
        if observation not in OBSERVATIONS:
            raise ConfigError("observation", observation, f"one of {', '.join(OBSERVATIONS)}")
        if render_mode not in (None, "rgb_array"):
            raise ConfigError("render_mode", render_mode, "'rgb_array' or None")
        if render_camera not in ("chase", "bow"):
            raise ConfigError("render_camera", render_camera, "'chase' or 'bow'")
        if observation == "image" and fidelity != "pixels":
            raise ConfigError("fidelity", fidelity, "'pixels', image observations need rendered frames")
        self.cfg = dataclasses.replace(cfg or WorldCfg(), fidelity=fidelity)
        self.observation = observation
        self.render_mode = render_mode
        self._render_camera = render_camera
        self._perception_cfg = perception or PerceptionCfg()
        self._world = DockingWorld(self.cfg, self._perception_cfg.detector)
        self._detector = make_station_detector(self._perception_cfg.detector, self.cfg.station)
        self._perception = BeaconPerception(
            self._perception_cfg,
            self._world.camera,
            self.cfg.station.layout,
            self.cfg.station.rotating,
            heading_surveyed=self.cfg.station_heading == "surveyed",
        )
        self._chase = ChaseCamera(self._world.simulator)
        self._percept: Percept | None = None
        self._fix: AzimuthFix | None = None
        self._sensed: Sensed | None = None
        self._image: Image | None = None
        self._distance_m = 0.0
        self._energy_j = 0.0
        actuators = len(self._world.simulator.vehicle.actuators)
        self.action_space = spaces.Box(-1.0, 1.0, (actuators,), np.float32)
        self.observation_space = self._make_observation_space()

    @property
    def world(self) -> DockingWorld:
        """The world inside, for metrics."""
        return self._world

    @property
    def proprioception(self) -> Proprioception:
        """The vehicle's own sensors at the last step; what the action wrappers steer by.

        Raises:
            ConfigError: the environment has not been reset.
        """
        if self._sensed is None:
            raise ConfigError("env", "not reset", "env.reset() before the first step")
        return self._sensed.proprioception

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the episode's own seed is drawn from the environment's generator."""
        super().reset(seed=seed)
        self._world.reset(int(self.np_random.integers(2**31)))
        self._perception.reset()
        self._percept = None
        self._fix = None
        self._image = None
        self._sense()
        truth = self._world.truth
        self._distance_m = self._distance_to_latch(truth)
        self._energy_j = 0.0
        return self._observe(truth), self._info(truth)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:  # noqa: ANN401
        """Apply actuator commands for one control period."""
        values = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        self._world.step(values)
        self._sense()
        truth = self._world.truth
        end = self._world.end
        success = self._world.is_success
        truncated = not success and end == "timeout"
        terminated = success or (end is not None and not truncated)
        return self._observe(truth), self._reward(truth, success, end), terminated, truncated, self._info(truth)

    def render(self) -> Any:  # noqa: ANN401
        """An image (H, W, 3) uint8 from behind and above the vehicle, or what its bow camera sees."""
        if self.render_mode is None:
            return None
        if self._render_camera == "chase":
            return self._chase.render()
        truth = self._world.truth
        if self._image is not None:
            return self._image
        return self._world.imager.capture(truth.T_world_body, truth.time_s).image

    def close(self) -> None:
        """Release the renderers."""
        self._world.close()
        self._chase.close()

    def _sense(self) -> None:
        if self.observation == "state":
            # Nobody looks through the camera, so no frame is made.
            self._sensed = Sensed(self._world.simulator.proprioception(), None, None)
            return
        self._sensed = sensed = self._world.sense()
        if sensed.frame is not None:
            self._image = sensed.frame.image
        if self.observation == "pose":
            detections = self._detector.detect(sensed.frame) if sensed.frame is not None else sensed.detections
            if detections is not None:
                self._percept = self._perception.update(detections, sensed.proprioception)
                self._fix = self._percept.azimuth or self._fix

    def _reward(self, truth: Truth, success: bool, end: str | None) -> float:
        distance_m = self._distance_to_latch(truth)
        reward = self._distance_m - distance_m - 0.001 * (truth.energy_j - self._energy_j)
        self._distance_m, self._energy_j = distance_m, truth.energy_j
        if success:
            reward += 100.0
        elif end in ("diverged", "collision"):
            reward -= 50.0
        return float(reward)

    def _distance_to_latch(self, truth: Truth) -> float:
        funnel, latch = self.cfg.station.funnel, self.cfg.station.latch
        goal = np.array([-(funnel.length_m + latch.depth_m), 0.0, 0.0])
        return float(np.linalg.norm(truth.nose_station_m - goal))

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
        def box(*shape: int) -> spaces.Box:
            return spaces.Box(-BOUND, BOUND, shape, np.float64)

        if self.observation == "state":
            return box(19)
        if self.observation == "pose":
            parts: dict[str, spaces.Space[Any]] = {
                "pose": box(6),
                "pose_valid": spaces.Box(0.0, 1.0, (1,), np.float64),
                "long_range": box(4),
                "entrance": box(4),
                "proprioception": box(13),
            }
            if self.cfg.station.rotating is not None:
                parts["azimuth"] = box(7)
            return spaces.Dict(parts)
        camera = self.cfg.camera
        return spaces.Dict(
            {
                "image": spaces.Box(0, 255, (camera.height_px, camera.width_px, 3), np.uint8),
                "proprioception": box(13),
            }
        )

    def _observe(self, truth: Truth) -> Observation:
        if self.observation == "state":
            return self._state(truth)
        own = _proprioception_vector(self.proprioception)
        if self.observation == "image":
            image = self._image if self._image is not None else self._blank()
            return {"image": image.copy(), "proprioception": own}
        seen = {**_percept_vectors(self._percept, self._world.camera.T_body_camera), "proprioception": own}
        if self.cfg.station.rotating is not None:
            seen["azimuth"] = _azimuth_vector(self._fix, self.proprioception.time_s)
        return seen

    def _state(self, truth: Truth) -> Array:
        R_station_world = self._world.simulator.T_world_station[:3, :3].T
        rotation = R_station_world @ truth.T_world_body[:3, :3]
        state = np.concatenate(
            [
                truth.nose_station_m,
                rotation[:, 0],
                rotation[:, 1],
                truth.nu_body,
                R_station_world @ truth.current_world_m_s,
                [float(truth.touching_station)],
            ]
        )
        return np.clip(np.nan_to_num(state, nan=BOUND), -BOUND, BOUND)  # a diverged state must stay in its space

    def _blank(self) -> Image:
        return np.zeros((self.cfg.camera.height_px, self.cfg.camera.width_px, 3), dtype=np.uint8)


def _proprioception_vector(own: Proprioception) -> Array:
    return np.concatenate(
        [
            [own.depth_m],
            own.euler_zyx_rad,
            own.angular_velocity_rad_s,
            own.velocity_ground_m_s,
            own.velocity_water_m_s,
        ]
    )


def _percept_vectors(percept: Percept | None, T_body_camera: Array) -> dict[str, Array]:
    pose, valid = np.zeros(6), np.zeros(1)
    rays = {"long_range": np.zeros(4), "entrance": np.zeros(4)}
    if percept is not None:
        if percept.pose is not None:
            rotation = percept.pose.T_station_camera[:3, :3] @ invert(T_body_camera)[:3, :3]
            pose = np.concatenate([percept.pose.T_station_camera[:3, 3], euler_zyx_from_rotation(rotation)])
            valid[0] = 1.0 if percept.pose.measured else 0.5
        for name, bearing in (("long_range", percept.long_range), ("entrance", percept.entrance)):
            if bearing is not None:
                rays[name] = np.append(bearing.ray_camera, bearing.score)
    return {"pose": pose, "pose_valid": valid, **rays}


def _azimuth_vector(fix: AzimuthFix | None, now_s: float) -> Array:
    """Last azimuth fix: sin A, cos A, sigma in rad, age in s, unit ray to the beacon at that time; 0 before any."""
    if fix is None:
        return np.zeros(7)
    azimuth = [np.sin(fix.azimuth_rad), np.cos(fix.azimuth_rad), fix.sigma_rad, now_s - fix.time_s]
    return np.clip(np.concatenate([azimuth, fix.bearing.ray_camera]), -BOUND, BOUND)
