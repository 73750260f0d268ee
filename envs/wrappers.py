"""Action wrappers: command a body wrench or set-points instead of single actuators.

| Wrapper | Action (all in [-1, 1]) | Meaning at ±1 |
|---|---|---|
| `BodyWrenchAction` | surge X, sway Y, heave Z, pitch M, yaw N | the most that the thrusters give on that axis alone |
| `SetPointAction` | surge, sway, heave, heading change | 1 m/s, 0.3 m/s, 0.3 m/s, 0.5 rad |

Both use only the vehicle's own sensors, wrap the environments of all stations, and refuse what the environments refuse:
another shape, or a value that is not a number. A vehicle whose thrusters act on roll is kept level by `SetPointAction`;
`BodyWrenchAction` asks for no moment in roll.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.autopilot import Autopilot, AutopilotCfg, AutopilotSetpoint
from auvdock.core.arrays import Array
from auvdock.core.vehicle import VehicleCfg
from auvdock.envs.actions import checked_action
from auvdock.envs.vehicle_env import VehicleEnv

__all__ = ["BodyWrenchAction", "SetPointAction"]

_AXES = (0, 1, 2, 4, 5)
"""Surge, sway, heave, pitch, yaw."""


def _docking(env: gymnasium.Env[Any, Any]) -> VehicleEnv[Any, Any, Any]:
    inner = env.unwrapped
    if not isinstance(inner, VehicleEnv):
        raise TypeError(f"{type(inner).__name__} is no docking environment")
    return inner


def _reach(vehicle: VehicleCfg) -> Array:
    """(6,) greatest wrench of the thrusters on each axis by itself, N and N m."""
    thrusters = [actuator.kind == "thruster" for actuator in vehicle.actuators]
    return np.abs(vehicle.thruster_wrenches_body[:, thrusters]).sum(axis=1)


class BodyWrenchAction(gymnasium.ActionWrapper[Any, Any, Any], RecordConstructorArgs):
    """Actions are body wrenches τ = (X, Y, Z, M, N) in shares of the thrusters' reach; see the module's table.

    Positive is ahead, to port, up, nose down and to port (body axes x forward, y port, z up).
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        """Wrap a docking environment."""
        RecordConstructorArgs.__init__(self)
        gymnasium.ActionWrapper.__init__(self, env)
        inner = _docking(env)
        self._allocator = ThrustAllocator(inner.world.simulator.vehicle, inner.allocation_cfg)
        self._reach = _reach(inner.world.simulator.vehicle)
        self.action_space = spaces.Box(-1.0, 1.0, (len(_AXES),), np.float32)

    def action(self, action: Any) -> Any:  # noqa: ANN401
        """Actuator commands for a wrench.

        Raises:
            ValueError: another shape, or a value that is not a number.
            ResetNeeded: the environment has not been reset.
        """
        wrench = np.zeros(6)
        wrench[list(_AXES)] = checked_action(action, len(_AXES))
        surge_m_s = float(_docking(self.env).proprioception.velocity_water_m_s[0])
        return self._allocator.allocate(wrench * self._reach, surge_m_s).astype(np.float32)


class SetPointAction(gymnasium.ActionWrapper[Any, Any, Any], RecordConstructorArgs):
    """Actions are set-points of the vehicle's autopilot, level and over ground; see the module's table.

    The heading set-point is the heading now plus the action's change.
    """

    SCALE = np.array([1.0, 0.3, 0.3, 0.5])
    """m/s ahead, m/s to port, m/s up, rad to port."""

    def __init__(self, env: gymnasium.Env[Any, Any], cfg: AutopilotCfg | None = None) -> None:
        """Wrap a docking environment.

        Args:
            env: the environment.
            cfg: the autopilot; by default the station's own pilot's.
        """
        RecordConstructorArgs.__init__(self, cfg=cfg)
        gymnasium.ActionWrapper.__init__(self, env)
        inner = _docking(env)
        self._autopilot = Autopilot(inner.world.simulator.vehicle, cfg or inner.autopilot_cfg, inner.control_s)
        self._allocator = ThrustAllocator(inner.world.simulator.vehicle, inner.allocation_cfg)
        self._state = self._autopilot.initial_state()
        self.action_space = spaces.Box(-1.0, 1.0, (4,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset the environment and the autopilot."""
        self._state = self._autopilot.initial_state()
        return super().reset(seed=seed, options=options)

    def action(self, action: Any) -> Any:  # noqa: ANN401
        """Actuator commands for set-points.

        Raises:
            ValueError: another shape, or a value that is not a number.
            ResetNeeded: the environment has not been reset.
        """
        own = _docking(self.env).proprioception
        share = checked_action(action, len(self.SCALE)) * self.SCALE
        surge, sway, heave, turn = (float(part) for part in share)
        setpoint = AutopilotSetpoint(surge, sway, heave, 0.0, float(own.euler_zyx_rad[2]) + turn)
        wrench, self._state = self._autopilot.step(self._state, setpoint, own)
        values, achieved = self._allocator.solve(wrench, float(own.velocity_water_m_s[0]))
        self._state = self._autopilot.settle(self._state, wrench, achieved)
        return values.astype(np.float32)
