"""Gymnasium environment for landing.

## Description
An autonomous underwater vehicle with a belly camera must find a lit platform below it, line up with its centre line,
come down into V-shaped guides and stay slow until an arm closes over it. Five lights lead from afar, an AprilTag near
by. Success is defined in `auvdock.core.landing_station.LandingLatchCfg`.

## Action space
`Box(-1, 1, (n,), float32)`, one command per actuator of the vehicle that `LandingWorldCfg.sim.vehicle` names. For
`bluerov2_heavy`, the default, n = 8:

| Num | Action | Min | Max | Actuator | Unit at ±1 |
|---|---|---|---|---|---|
| 0 | thrust forward and to port | -1 | 1 | fore_starboard | thrust, N |
| 1 | thrust forward and to starboard | -1 | 1 | fore_port | thrust, N |
| 2 | thrust aft and to port | -1 | 1 | aft_starboard | thrust, N |
| 3 | thrust aft and to starboard | -1 | 1 | aft_port | thrust, N |
| 4 | upward thrust, fore starboard | -1 | 1 | fore_starboard_vertical | thrust, N |
| 5 | upward thrust, fore port | -1 | 1 | fore_port_vertical | thrust, N |
| 6 | upward thrust, aft starboard | -1 | 1 | aft_starboard_vertical | thrust, N |
| 7 | upward thrust, aft port | -1 | 1 | aft_port_vertical | thrust, N |

For `remus_hybrid` they are those of `auvdock/ConicalDocking-v1`, n = 7. Limits, places and directions stand in
`assets/vehicles/`.

## Observation space
Chosen by `observation`. "Seat" is the middle of the round that comes to rest in the guides, of the hull or of a keel.

All boxes are float64 and bounded by ±20,000, more than the greatest depth or start range that a world may have.

`"state"` (default): `Box` of shape (19,), the true state. Privileged: no real vehicle has it.

| Num | Observation | Unit |
|---|---|---|
| 0-2 | seat less its place in the guides, station frame: along (ξ), across to port (η), up (ζ) | m |
| 3-8 | first two columns of the rotation body to station | - |
| 9-14 | velocity over ground ν: surge, sway (to port), heave (up), roll, pitch, yaw rates | m/s, rad/s |
| 15-17 | current in the station frame | m/s |
| 18 | 1 while touching the station | - |

`"pose"`: `Dict` of what perception and the vehicle's own sensors give; no truth in it.

| Key | Shape | Content |
|---|---|---|
| `pose` | (6,) | ξ, η, ζ of the seat; roll, pitch, yaw of the body in the station frame, as perception sees them |
| `pose_valid` | (1,) | 1 if measured in the newest frame, 0.5 if held, 0 if there is none (pose is then 0) |
| `level` | (1,) | what the newest frame's pose rests on: 0 nothing, 1 lights, 2 tag, 3 both |
| `long_range` | (4,) | unit ray to the group of lights in the camera frame and its score; 0 if none or with a pose |
| `proprioception` | (13,) | depth; roll, pitch, yaw; p, q, r; velocity over ground; velocity through water |

`"image"`: `Dict` of `image` (height, width, 3) uint8 from the belly camera (up is forward, right is starboard) and
`proprioception` as above. Needs `fidelity="pixels"`.

## Reward
Progress of the seat towards its place in metres, less 0.001 times the thruster work in joules, plus 100 on success,
less 50 on collision, divergence, surfacing or being carried off. `auvdock.envs.reward.RewardCfg` has these numbers, and
a price of time, as settings.

## Starting state
Uniform within `LandingWorldCfg.start`: 3 to 6 m above the seat's place, ±1.5 m along and across, ±45° of heading, at
rest in the water.

## Episode end
Terminated by success, a collision harder than `LandingWorldCfg.limits.collision_force_n`, divergence, an arm that
closed after a touchdown that was too hard (`terminal`), a hull that has been partly out of the water for
`limits.surfaced_s` in all (`surfaced`), or a vehicle `limits.carried_off_m` further from the station than at the start
(`carried_off`). Truncated after `LandingWorldCfg.limits.max_time_s`, 240 s. `info` always has `is_success` (bool) and
`failure_reason` (str or None). A step after the end, or before the first reset, raises `gymnasium.error.ResetNeeded`.
The last `info` of an episode has its metrics too, by the names of `EpisodeResult` (docs/metrics.md).

## Arguments
`cfg` (`LandingWorldCfg`), `observation` ("state", "pose", "image"), `fidelity` ("pixels", "beacons"; by default the
`cfg`'s, without a `cfg` "pixels" for images and else "beacons"), `start` (`LandingStartCfg`, or a mapping of the fields
to change, in place of the `cfg`'s), `reward` (`RewardCfg`, or a mapping of the fields to change), `time_limit_s` (in
place of `cfg.limits.max_time_s`), `perception` (`LandingPerceptionCfg`, used by "pose"), `render_mode` ("rgb_array"),
`render_camera` ("chase" or "belly").

`gymnasium.make` itself takes `max_episode_steps`, a number of control periods: its own wrapper then truncates, and
`failure_reason` stays None. Any other argument that cannot be used raises `ConfigError` with its name.

## Version history
- v0: first version.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from auvdock.controllers.landing.config import HoverAllocationCfg, HoverAutopilotCfg
from auvdock.core.arrays import Array
from auvdock.core.transforms import euler_zyx_from_rotation, invert
from auvdock.envs.chase import from_the_side
from auvdock.envs.landing_config import LandingStartCfg, LandingWorldCfg
from auvdock.envs.perceived import landing_metrics, perceived_landing
from auvdock.envs.vehicle_env import VehicleEnv, box
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.perception.landing.config import LandingPerceptionCfg
from auvdock.sim.truth import Truth

__all__ = ["LandingEnv"]

_LEVELS = {"none": 0.0, "lights": 1.0, "tag": 2.0, "fused": 3.0}


class LandingEnv(VehicleEnv[LandingWorldCfg, LandingStartCfg, LandingPerceptionCfg]):
    """`auvdock/LandingDocking-v1`; see the module's docstring for the tables."""

    default_cfg = staticmethod(LandingWorldCfg)
    default_perception = staticmethod(LandingPerceptionCfg)
    perceived = staticmethod(perceived_landing)
    judged = staticmethod(landing_metrics)
    own_camera = "belly"
    chase_view = staticmethod(from_the_side)
    allocation_cfg = HoverAllocationCfg()
    autopilot_cfg = HoverAutopilotCfg()

    def _place(self, truth: Truth) -> Array:
        return truth.landing.seat_error_m if truth.landing is not None else np.zeros(3)

    def _distance_to_go_m(self, truth: Truth) -> float:
        return truth.range_m

    def _pose_spaces(self) -> dict[str, spaces.Space[Any]]:
        return {
            "pose": box(6),
            "pose_valid": spaces.Box(0.0, 1.0, (1,), np.float64),
            "level": spaces.Box(0.0, 3.0, (1,), np.float64),
            "long_range": box(4),
            "proprioception": box(13),
        }

    def _pose_vectors(self) -> dict[str, Array]:
        pose, valid, level, ray = np.zeros(6), np.zeros(1), np.zeros(1), np.zeros(4)
        percept: LandingPercept | None = self._percept
        if percept is not None:
            level[0] = _LEVELS[percept.level]
            if percept.pose is not None:
                T_station_body = percept.pose.T_station_camera @ invert(self._world.camera.T_body_camera)
                pose[:3] = (T_station_body @ np.append(self._world.simulator.vehicle.seat_body_m, 1.0))[:3]
                pose[2] -= self.cfg.station.guide.seat_height_m
                pose[3:] = euler_zyx_from_rotation(T_station_body[:3, :3])
                valid[0] = 1.0 if percept.pose.measured else 0.5
            if percept.long_range is not None:
                ray = np.append(percept.long_range.ray_camera, percept.long_range.score)
        return {"pose": pose, "pose_valid": valid, "level": level, "long_range": ray}
