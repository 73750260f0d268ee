"""Thrusters and fins between command and wrench: saturation, dead band, lag, and the power they draw."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.compiled import compiled
from auvdock.core.vehicle import VehicleCfg

__all__ = ["Actuators"]

_RHO_KG_M3 = 1025.0


class Actuators:
    """First-order actuators, stepped exactly for a command held over the step.

    A command c is clipped to [-1, 1] and set to 0 inside the dead band; the state then follows τ ẋ + x = c. A thruster
    gives max_force × x, a fin stands at max_angle × x.
    """

    def __init__(self, vehicle: VehicleCfg, dt_s: float) -> None:
        """Precompute the lag factors for a step of `dt_s`."""
        actuators = vehicle.actuators
        self.count = len(actuators)
        self.is_fin = [actuator.kind == "fin" for actuator in actuators]
        self.thrusters = [index for index, fin in enumerate(self.is_fin) if not fin]
        self._gain = np.array([1.0 - math.exp(-dt_s / actuator.time_constant_s) for actuator in actuators])
        self._band = np.array([actuator.dead_band for actuator in actuators])
        self._thrusters = np.array(self.thrusters, dtype=np.int64)
        self._max_force_n = np.array([actuators[index].max_force_n for index in self.thrusters])
        area = np.array([0.25 * math.pi * actuators[index].disc_diameter_m ** 2 for index in self.thrusters])
        self._two_over_rho_area = 2.0 / (_RHO_KG_M3 * area)
        self.reset()

    def reset(self) -> None:
        """All at rest."""
        self.state: Array = np.zeros(self.count)

    def step(self, command: Array | Sequence[float]) -> Array:
        """Advance by one step; returns the states (n,) in [-1, 1], which the next call overwrites.

        Raises:
            ValueError: wrong length, or a command that is not a number.
        """
        values = np.asarray(command, dtype=np.float64)
        if values.shape != (self.count,):
            raise ValueError(f"command has {values.size} values, expected {self.count}")
        if (index := _advance(self.state, values, self._gain, self._band)) >= 0:
            raise ValueError(f"command {index} is not a number")
        return self.state

    def power_w(self, advance_m_s: Array) -> float:
        """Hydraulic power of the thrusters at their advance speeds (k,), each along its thrust axis.

        Actuator-disc theory (Rankine and Froude): P = ½ |T| (V + √(V² + 2 |T| / (ρ A))) with V
        the advance speed in the direction of the thrust; so a hovering thruster costs power too.
        """
        return _power(self.state, advance_m_s, self._thrusters, self._max_force_n, self._two_over_rho_area)


@compiled
def _advance(state: Array, command: Array, gain: Array, band: Array) -> int:
    """Step the states (n,); the first command that is not a number, after which nothing is stepped, or -1."""
    for i in range(len(state)):
        if np.isnan(command[i]):
            return i
    for i in range(len(state)):
        value = min(max(command[i], -1.0), 1.0)
        if -band[i] < value < band[i]:
            value = 0.0
        state[i] += gain[i] * (value - state[i])
    return -1


@compiled
def _power(state: Array, advance: Array, thrusters: IntArray, max_force_n: Array, two_over_rho_area: Array) -> float:
    """`Actuators.power_w`."""
    power = 0.0
    for k in range(len(thrusters)):
        x = state[thrusters[k]]
        thrust = abs(x) * max_force_n[k]
        speed = advance[k] if x > 0.0 else -advance[k]
        power += 0.5 * thrust * (speed + math.sqrt(speed * speed + two_over_rho_area[k] * thrust))
    return power
