"""Gymnasium environment for docking by a rotating beacon.

## Description
The conical station of `auvdock/ConicalDocking-v1` carries a rotating beacon on top: a beam of 10° that turns at 0.5
revolutions a second, counter-clockwise seen from above, and points along the approach axis when the station's clock
shows a whole turn. The vehicle starts anywhere in a ring around the station with any heading, most often where no other
lamp can be seen, and must come around to the mouth and dock. It does not know the station's compass heading; the moment
at which the beam sweeps past tells its azimuth: A = 360° · 0.5 /s · t, with both clocks synchronised but for
`WorldCfg.clock`.

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

## Observation space
Chosen by `observation`; boxes are float64 and bounded by ±20,000.

`"state"` (default): `Box` of shape (19,), the true state, as in `auvdock/ConicalDocking-v1`. Privileged.

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
| `azimuth` | (7,) | last azimuth fix: sin A, cos A, σ in rad, age in s, unit ray to the beacon then; 0 if none |
| `pose` | (6,) | camera in the station frame: x, y, z, roll, pitch, yaw of the body as perception sees it |
| `pose_valid` | (1,) | 1 if measured in the newest frame, 0.5 if predicted, 0 if there is none (pose is then 0) |
| `long_range` | (4,) | unit ray to the far light in the camera frame and its score; 0 if none |
| `entrance` | (4,) | unit ray to the red entrance lamps and its score; 0 if none |
| `proprioception` | (13,) | depth; roll, pitch, yaw (datum unknown); p, q, r; velocities over ground, through water |

`"image"`: `Dict` of `image` (height, width, 3) uint8 from the bow camera, `proprioception` as above. One image does not
tell the time: the newest frame's is that of the observation. Needs `fidelity="pixels"`.

## Reward
Progress of the nose towards the latch in metres (straight, though the way leads around the station), less 0.001 times
the thruster work in joules, plus 100 on success, less 50 on collision, divergence, surfacing or being carried off;
`auvdock.envs.reward.RewardCfg` has these numbers, and a price of time, as settings.

## Starting state
Uniform within `WorldCfg.start`: radius 20 to 45 m, azimuth ±180°, ±1.5 m in depth, any heading. With
`station_heading="unknown"` each episode draws the compass' datum in ±180°.

## Episode end
As in `auvdock/ConicalDocking-v1`, with `WorldCfg.limits.max_time_s` 600 s.

## Arguments
`cfg` (`WorldCfg`, by default `auvdock.envs.config.rotating_world_cfg()`), `observation` ("state", "pose", "image"),
`fidelity` ("pixels", "beacons"; by default the `cfg`'s, without a `cfg` "pixels" for images and else "beacons"),
`start` (`StartCfg`, or a mapping of the fields to change, in place of the `cfg`'s), `reward` (`RewardCfg`, or a mapping
of the fields to change), `time_limit_s` (in place of `cfg.limits.max_time_s`), `perception` (`PerceptionCfg`, used by
"pose"), `render_mode` ("rgb_array"), `render_camera` ("chase" or "bow").

`gymnasium.make` itself takes `max_episode_steps`, a number of control periods: its own wrapper then truncates, and
`failure_reason` stays None. Any other argument that cannot be used raises `ConfigError` with its name.

## Version history
- v0: first version.
"""

from __future__ import annotations

from auvdock.envs.config import rotating_world_cfg
from auvdock.envs.docking import DockingEnv

__all__ = ["RotatingDockingEnv"]


class RotatingDockingEnv(DockingEnv):
    """`auvdock/RotatingBeaconDocking-v1`; see the module's docstring for the tables, `DockingEnv` for the arguments."""

    default_cfg = staticmethod(rotating_world_cfg)
