"""Thrusters and fins between command and wrench: saturation, dead band, lag, and the power they draw."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array
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
        self._gain = [1.0 - math.exp(-dt_s / actuator.time_constant_s) for actuator in actuators]
        self._dead_band = [actuator.dead_band for actuator in actuators]
        self._max_force_n = [actuators[index].max_force_n for index in self.thrusters]
        area = [0.25 * math.pi * actuators[index].disc_diameter_m ** 2 for index in self.thrusters]
        self._two_over_rho_area = [2.0 / (_RHO_KG_M3 * a) for a in area]
        self.reset()

    def reset(self) -> None:
        """All at rest."""
        self.state = [0.0] * self.count

    def step(self, command: Array | Sequence[float]) -> list[float]:
        """Advance by one step; returns the states in [-1, 1].

        Raises:
            ValueError: wrong length, or a command that is not a number.
        """
        values: list[float] = command.tolist() if isinstance(command, np.ndarray) else list(command)
        if len(values) != self.count:
            raise ValueError(f"command has {len(values)} values, expected {self.count}")
        state = self.state
        for index, value in enumerate(values):
            if -self._dead_band[index] < value < self._dead_band[index]:
                value = 0.0
            elif value > 1.0:
                value = 1.0
            elif value < -1.0:
                value = -1.0
            elif value != value:
                raise ValueError(f"command {index} is not a number")
            state[index] += self._gain[index] * (value - state[index])
        return state

    def power_w(self, advance_m_s: Sequence[float]) -> float:
        """Hydraulic power of the thrusters at the given advance speeds (one per thruster, along its thrust axis).

        Actuator-disc theory (Rankine and Froude): P = ½ |T| (V + √(V² + 2 |T| / (ρ A))) with V
        the advance speed in the direction of the thrust; so a hovering thruster costs power too.
        """
        power = 0.0
        for slot, index in enumerate(self.thrusters):
            x = self.state[index]
            if x != 0.0:
                speed = advance_m_s[slot] if x > 0.0 else -advance_m_s[slot]
                thrust = abs(x) * self._max_force_n[slot]
                power += 0.5 * thrust * (speed + math.sqrt(speed * speed + self._two_over_rho_area[slot] * thrust))
        return power
