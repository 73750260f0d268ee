"""Fossen's 6-DOF hydrodynamics relative to the water, as what MuJoCo lacks.

MuJoCo integrates M_RB, rigid-body Coriolis, weight and contacts. This module adds the water: added mass M_A into the
mass matrix itself (so that contacts feel it), and the forces −C_A(ν_r) ν_r − D(ν_r) ν_r, buoyancy and actuators.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.compiled import compiled
from auvdock.core.vehicle import VehicleCfg

__all__ = ["GRAVITY_M_S2", "Hydrodynamics"]

GRAVITY_M_S2 = 9.81
"""Standard of the vehicle data: weight = mass × 9.81."""


class Hydrodynamics:
    """The water's forces on one vehicle.

    With the body's acceleration ν̇ over ground, the accelerating water's u̇_c and v_r = v − Rᵀ u_c, Fossen (2011,
    chapters 6 and 8) reads, for the free joint's coordinates (a, ω̇) with a = R (v̇ + ω × v):

        (M_RB + M_A) ν̇ + … = −C_A(ν_r) ν_r + M_A (ω × v_r + Rᵀ u̇_c, 0) + m_d Rᵀ u̇_c + D-terms + actuators

    The second term turns MuJoCo's world-frame acceleration into the body-frame derivative that M_A multiplies; the
    third is the Froude-Krylov force of accelerating water on the displaced mass m_d. Only gusts accelerate the water:
    shear is taken as quasi-steady.

    All is one matrix product W z: z stacks ν_r, |ν_r|ν_r, |u_r|ν_r, that acceleration and the actuators; W ν gives the
    damping and actuator wrench, the momentum M_A ν_r and the thrusters' advance speeds at once.
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
        displaced_kg = vehicle.buoyancy_n / GRAVITY_M_S2
        self._displaced_kg = displaced_kg
        weights[:6, 21:] = wrenches
        weights[6:12, :6] = added
        for slot, index in enumerate(thrusters):
            column = wrenches[:, index]
            thrust = float(np.linalg.norm(column[:3]))
            weights[12 + slot, :6] = column / thrust if thrust > 0.0 else 0.0
        self._weights = weights
        fins = [21 + index for index, actuator in enumerate(vehicle.actuators) if actuator.kind == "fin"]
        self._fins = np.array(fins, dtype=np.int64)
        """Their places in z."""
        self._buoyancy_n = vehicle.buoyancy_n
        self._added = np.ascontiguousarray(added)

    def add_mass(self, rows: Array, rotation: Array) -> None:
        """Add T M_A Tᵀ with T = diag(R, 1), M_A in a free joint's coordinates, to its mass matrix.

        A free joint's velocity is (linear in the world frame, angular in the body frame).

        Args:
            rows: (21,) lower triangle of the mass matrix, row by row.
            rotation: (3, 3) R, body to world.
        """
        _add_mass(rows, rotation, self._added)

    def wrench(
        self,
        rotation: Array,
        velocity: Array,
        water: tuple[float, float, float],
        gust_acceleration: tuple[float, float],
        actuators: Array,
    ) -> tuple[Array, Array]:
        """Generalised force on the free joint, and the thrusters' advance speeds in m/s.

        Args:
            rotation: (3, 3) R, body to world.
            velocity: (6,) of the body's origin over ground in the world frame in m/s, and p, q, r in rad/s.
            water: velocity of the water, world frame, m/s.
            gust_acceleration: horizontal acceleration of the water, world frame, m/s².
            actuators: (n,) states in [-1, 1].

        Returns:
            (6,) force in the world frame in N and moment about the origin in the body frame in N m, and the advance
            speeds (k,) of the thrusters.
        """
        return _wrench(
            rotation,
            velocity,
            water,
            gust_acceleration,
            actuators,
            self._weights,
            self._fins,
            self._displaced_kg,
            self._buoyancy_n,
        )


@compiled
def _add_mass(rows: Array, rotation: Array, added: Array) -> None:
    """`Hydrodynamics.add_mass`."""
    half, whole = added.copy(), added.copy()
    for i in range(3):
        for j in range(6):
            half[i, j] = rotation[i, 0] * added[0, j] + rotation[i, 1] * added[1, j] + rotation[i, 2] * added[2, j]
    for i in range(6):
        a, b, c = half[i, 0], half[i, 1], half[i, 2]
        for j in range(3):
            whole[i, j] = a * rotation[j, 0] + b * rotation[j, 1] + c * rotation[j, 2]
        for j in range(3, 6):
            whole[i, j] = half[i, j]
    place = 0
    for i in range(6):
        for j in range(i + 1):
            rows[place] += whole[i, j]
            place += 1


@compiled
def _wrench(
    rotation: Array,
    velocity: Array,
    water: tuple[float, float, float],
    gust: tuple[float, float],
    actuators: Array,
    weights: Array,
    fins: IntArray,
    displaced_kg: float,
    buoyancy_n: float,
) -> tuple[Array, Array]:
    """`Hydrodynamics.wrench` with W (12 + k, 21 + n) and the fins' places in z."""
    z = np.empty(weights.shape[1])
    for i in range(3):
        z[i] = 0.0
        for j in range(3):
            z[i] += rotation[j, i] * (velocity[j] - water[j])
        z[3 + i] = velocity[3 + i]
        z[18 + i] = rotation[0, i] * gust[0] + rotation[1, i] * gust[1]
    u, v, w, p, q, r = z[:6]
    s = abs(u)
    for i in range(6):
        z[6 + i] = z[i] * abs(z[i])
        z[12 + i] = s * z[i]
    z[18] += q * w - r * v
    z[19] += r * u - p * w
    z[20] += p * v - q * u
    for i in range(len(actuators)):
        z[21 + i] = actuators[i]
    for place in fins:
        z[place] *= u * s
    out = np.zeros(len(weights))
    for i in range(len(out)):
        for j in range(len(z)):
            out[i] += weights[i, j] * z[j]
    px, py, pz, hx, hy, hz = out[6:12]
    # −C_A(ν_r) ν_r = (p × ω, p × v + h × ω) with the added momenta p, h (Fossen 2011, equation 6.43).
    fx, fy, fz = out[0] + py * r - pz * q, out[1] + pz * p - px * r, out[2] + px * q - py * p
    force = np.empty(6)
    for i in range(3):
        force[i] = rotation[i, 0] * fx + rotation[i, 1] * fy + rotation[i, 2] * fz
    force[0] += displaced_kg * gust[0]
    force[1] += displaced_kg * gust[1]
    force[2] += buoyancy_n
    force[3] = out[3] + py * w - pz * v + hy * r - hz * q
    force[4] = out[4] + pz * u - px * w + hz * p - hx * r
    force[5] = out[5] + px * v - py * u + hx * q - hy * p
    return force, out[12:]
