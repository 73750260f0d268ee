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
        # For each actuator: index, gain of the step, dead band.
        self._lags = [
            (index, 1.0 - math.exp(-dt_s / actuator.time_constant_s), actuator.dead_band)
            for index, actuator in enumerate(actuators)
        ]
        area = {index: 0.25 * math.pi * actuators[index].disc_diameter_m ** 2 for index in self.thrusters}
        # For each thruster: index, greatest force, 2 / (ρ A).
        self._discs = [
            (index, actuators[index].max_force_n, 2.0 / (_RHO_KG_M3 * area[index])) for index in self.thrusters
        ]
        self.reset()

    def reset(self) -> None:
        """All at rest."""
        self.state = [0.0] * self.count

    def step(self, command: Array | Sequence[float]) -> list[float]:
        """Advance by one step; returns the states in [-1, 1].

        Raises:
            ValueError: wrong length, or a command that is not a number.
        """
        values: Sequence[float] = command.tolist() if isinstance(command, np.ndarray) else command
        if len(values) != self.count:
            raise ValueError(f"command has {len(values)} values, expected {self.count}")
        state = self.state
        for value, (index, gain, band) in zip(values, self._lags, strict=True):
            if -band < value < band:
                value = 0.0
            elif value > 1.0:
                value = 1.0
            elif value < -1.0:
                value = -1.0
            elif value != value:
                raise ValueError(f"command {index} is not a number")
            state[index] += gain * (value - state[index])
        return state

    def power_w(self, advance_m_s: Sequence[float]) -> float:
        """Hydraulic power of the thrusters at the given advance speeds (one per thruster, along its thrust axis).

        Actuator-disc theory (Rankine and Froude): P = ½ |T| (V + √(V² + 2 |T| / (ρ A))) with V
        the advance speed in the direction of the thrust; so a hovering thruster costs power too.
        """
        power, state = 0.0, self.state
        for speed, (index, max_force_n, two_over_rho_area) in zip(advance_m_s, self._discs, strict=True):
            x = state[index]
            if x == 0.0:
                continue
            if x < 0.0:
                x, speed = -x, -speed
            thrust = x * max_force_n
            power += 0.5 * thrust * (speed + math.sqrt(speed * speed + two_over_rho_area * thrust))
        return power
