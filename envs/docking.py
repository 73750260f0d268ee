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

All boxes are float64 and bounded by ±20,000, more than the greatest depth or start range that a world may have.

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
less 50 on collision, divergence, surfacing or being carried off. `auvdock.envs.reward.RewardCfg` has these numbers, and
a price of time, as settings.

## Starting state
Uniform within `WorldCfg.start`: 15 to 30 m in front of the mouth, ±3 m sideways, ±1.5 m in depth, ±30° of heading.

## Episode end
Terminated by success, a collision harder than `WorldCfg.limits.collision_force_n`, divergence, a latch that closed on
an entry outside its limits (`terminal`), a hull that has been partly out of the water for `limits.surfaced_s` in all
(`surfaced`), or a vehicle `limits.carried_off_m` further from the station than at the start (`carried_off`). Truncated
after `WorldCfg.limits.max_time_s`, 240 s. `info` always has `is_success` (bool) and `failure_reason` (str or None). A
step after the end, or before the first reset, raises `gymnasium.error.ResetNeeded`.
The last `info` of an episode has its metrics too, by the names of `EpisodeResult` (docs/metrics.md).

## Arguments
`cfg` (`WorldCfg`), `observation` ("state", "pose", "image"), `fidelity` ("pixels", "beacons"; by default the `cfg`'s,
without a `cfg` "pixels" for images and else "beacons"), `start` (`StartCfg`, or a mapping of the fields to change, in
place of the `cfg`'s), `reward` (`RewardCfg`, or a mapping of the fields to change), `time_limit_s` (in place of
`cfg.limits.max_time_s`), `perception` (`PerceptionCfg`, used by "pose"), `render_mode` ("rgb_array"), `render_camera`
("chase" or "bow").

`gymnasium.make` itself takes `max_episode_steps`, a number of control periods: its own wrapper then truncates, and
`failure_reason` stays None. Any other argument that cannot be used raises `ConfigError` with its name.

For training, something like `gymnasium.make("auvdock/ConicalDocking-v1", start={"min_range_m": 3, "max_range_m": 5},
time_limit_s=30)`, wrapped in `auvdock.envs.wrappers.SetPointAction`: the default's 240 s are 7,200 steps.

## Version history
- v0: first version.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from auvdock.core.arrays import Array
from auvdock.core.contracts import AzimuthFix, Percept, Sensed
from auvdock.core.transforms import euler_zyx_from_rotation, invert
from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.envs.perceived import docking_metrics, perceived_docking
from auvdock.envs.vehicle_env import BOUND, VehicleEnv, box
from auvdock.perception.pipeline import PerceptionCfg
from auvdock.sim.truth import Truth

__all__ = ["DockingEnv"]


class DockingEnv(VehicleEnv[WorldCfg, StartCfg, PerceptionCfg]):
    """`auvdock/ConicalDocking-v1`; see the module's docstring for the tables."""

    default_cfg = staticmethod(WorldCfg)
    default_perception = staticmethod(PerceptionCfg)
    perceived = staticmethod(perceived_docking)
    judged = staticmethod(docking_metrics)
    _fix: AzimuthFix | None = None

    def _forget(self) -> None:
        super()._forget()
        self._fix = None

    def _perceive(self, sensed: Sensed) -> None:
        super()._perceive(sensed)
        if self._percept is not None:
            self._fix = self._percept.azimuth or self._fix

    def _place(self, truth: Truth) -> Array:
        return truth.nose_station_m

    def _distance_to_go_m(self, truth: Truth) -> float:
        goal = np.array([-self.cfg.station.inside_m, 0.0, 0.0])
        return float(np.linalg.norm(truth.nose_station_m - goal))

    def _pose_spaces(self) -> dict[str, spaces.Space[Any]]:
        parts: dict[str, spaces.Space[Any]] = {
            "pose": box(6),
            "pose_valid": spaces.Box(0.0, 1.0, (1,), np.float64),
            "long_range": box(4),
            "entrance": box(4),
            "proprioception": box(13),
        }
        if self.cfg.station.rotating is not None:
            parts["azimuth"] = box(7)
        return parts

    def _pose_vectors(self) -> dict[str, Array]:
        seen = _percept_vectors(self._percept, self._world.camera.T_body_camera)
        if self.cfg.station.rotating is not None:
            seen["azimuth"] = _azimuth_vector(self._fix, self.proprioception.time_s)
        return seen


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
