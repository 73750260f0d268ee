"""Thrusters and fins between command and wrench: what is constant about them, and their states."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.core.vehicle import VehicleCfg

__all__ = ["Actuators"]

_RHO_KG_M3 = 1025.0


class Actuators:
    """First-order actuators, stepped exactly for a command held over the step (`stepping.respond`).

    A command c is clipped to [-1, 1] and set to 0 inside the dead band; the state then follows τ ẋ + x = c. A thruster
    gives max_force × x, a fin stands at max_angle × x.

    Attributes:
        thrusters: which of them are thrusters.
        state: (n,) in [-1, 1].
        table: (4, n) per actuator 1 − e^(−dt/τ), dead band, greatest force in N (−1 for a fin) and 2 / (ρ A) in m/kg
            (0 for a fin).
    """

    def __init__(self, vehicle: VehicleCfg, dt_s: float) -> None:
        """Precompute the lag factors for a step of `dt_s`."""
        actuators = vehicle.actuators
        fins = [actuator.kind == "fin" for actuator in actuators]
        self.thrusters = [index for index, fin in enumerate(fins) if not fin]
        self.table: Array = np.zeros((4, len(actuators)))
        for index, actuator in enumerate(actuators):
            self.table[:2, index] = 1.0 - math.exp(-dt_s / actuator.time_constant_s), actuator.dead_band
            self.table[2, index] = -1.0
            if not fins[index]:
                area_m2 = 0.25 * math.pi * actuator.disc_diameter_m**2
                self.table[2:, index] = actuator.max_force_n, 2.0 / (_RHO_KG_M3 * area_m2)
        self.reset()

    def reset(self) -> None:
        """All at rest."""
        self.state: Array = np.zeros(self.table.shape[1])

    def checked(self, command: Array | Sequence[float]) -> Array:
        """A command as an array (n,).

        Raises:
            ValueError: another shape.
        """
        values = np.asarray(command, dtype=np.float64)
        check_shape("command", values, self.state.shape)
        return values
