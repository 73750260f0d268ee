"""Fossen's 6-DOF hydrodynamics relative to the water, as what MuJoCo lacks: the constants of one vehicle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.vehicle import VehicleCfg

__all__ = ["GRAVITY_M_S2", "Hydrodynamics"]

GRAVITY_M_S2 = 9.81
"""Standard of the vehicle data: weight = mass × 9.81."""


class Hydrodynamics:
    """The water's forces on one vehicle, as constants for `stepping.wrench` and `stepping.add_mass`.

    With the body's acceleration ν̇ over ground, the accelerating water's u̇_c and v_r = v − Rᵀ u_c, Fossen (2011,
    chapters 6 and 8) reads, for the free joint's coordinates (a, ω̇) with a = R (v̇ + ω × v):

        (M_RB + M_A) ν̇ + … = −C_A(ν_r) ν_r + M_A (ω × v_r + Rᵀ u̇_c, 0) + m_d Rᵀ u̇_c + D-terms + actuators

    The second term turns MuJoCo's world-frame acceleration into the body-frame derivative that M_A multiplies; the
    third is the Froude-Krylov force of accelerating water on the displaced mass m_d. Only gusts accelerate the water:
    shear is taken as quasi-steady.

    All is one matrix product W z: z stacks ν_r, |ν_r|ν_r, |u_r|ν_r, that acceleration and the actuators; W ν gives the
    damping and actuator wrench, the momentum M_A ν_r and the thrusters' advance speeds at once.

    Attributes:
        weights: (12 + k, 21 + n) W, for k thrusters among n actuators.
        added: (6, 6) M_A.
        displaced_kg: m_d.
        buoyancy_n: buoyancy.
    """

    def __init__(self, vehicle: VehicleCfg, thrusters: Sequence[int]) -> None:
        """Assemble W; `thrusters` lists which actuators need an advance speed."""
        added = vehicle.added_mass_body
        wrenches = vehicle.thruster_wrenches_body
        count = wrenches.shape[1]
        weights = np.zeros((12 + len(thrusters), 21 + count))
        weights[:6, :6] = vehicle.linear_damping_body
        weights[:6, 6:12] = vehicle.quadratic_damping_body
        weights[:6, 12:18] = vehicle.lift_damping_body
        weights[:6, 18:21] = added[:, :3]
        weights[:6, 21:] = wrenches
        weights[6:12, :6] = added
        for slot, index in enumerate(thrusters):
            column = wrenches[:, index]
            thrust = float(np.linalg.norm(column[:3]))
            weights[12 + slot, :6] = column / thrust if thrust > 0.0 else 0.0
        self.weights = weights
        self.added: Array = np.ascontiguousarray(added)
        self.displaced_kg = vehicle.buoyancy_n / GRAVITY_M_S2
        self.buoyancy_n = vehicle.buoyancy_n
