"""Fossen's 6-DOF hydrodynamics relative to the water, as what MuJoCo lacks.

MuJoCo integrates M_RB, rigid-body Coriolis, weight and contacts. This module adds the water: added mass M_A into the
mass matrix itself (so that contacts feel it), and the forces −C_A(ν_r) ν_r − D(ν_r) ν_r, buoyancy and actuators.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.vehicle import VehicleCfg

__all__ = ["GRAVITY_M_S2", "Hydrodynamics"]

GRAVITY_M_S2 = 9.81
"""Standard of the vehicle data: weight = mass × 9.81."""

_TRIL = np.ravel_multi_index(np.tril_indices(6), (6, 6))


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
        self._fins = [21 + index for index, actuator in enumerate(vehicle.actuators) if actuator.kind == "fin"]
        """Their places in z."""
        self._buoyancy_n = vehicle.buoyancy_n
        self._added = added
        self._frame = np.eye(6)
        self._half, self._whole, self._rows = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(21)

    def added_mass_rows(self, rotation: Array) -> Array:
        """(21,) lower triangle, row by row, of T M_A Tᵀ with T = diag(R, 1): M_A in a free joint's coordinates.

        A free joint's velocity is (linear in the world frame, angular in the body frame). The array is overwritten by
        the next call.
        """
        frame = self._frame
        frame[:3, :3] = rotation
        frame.dot(self._added, self._half)
        self._half.dot(frame.T, self._whole)
        return self._whole.take(_TRIL, out=self._rows, mode="clip")  # mode: "raise" would copy through a buffer

    def wrench(
        self,
        rotation: Sequence[float],
        velocity_world: Sequence[float],
        angular_body: Sequence[float],
        gust_acceleration: tuple[float, float],
        actuators: Sequence[float],
    ) -> tuple[list[float], list[float]]:
        """Generalised force on the free joint, and the thrusters' advance speeds in m/s.

        Args:
            rotation: R row by row, 9 numbers, body to world.
            velocity_world: velocity through the water of the body's origin, world frame, m/s.
            angular_body: p, q, r in rad/s.
            gust_acceleration: horizontal acceleration of the water, world frame, m/s².
            actuators: states in [-1, 1].

        Returns:
            Six numbers (force in the world frame in N, moment about the origin in the body frame in N m), and one
            advance speed for each thruster.
        """
        r00, r01, r02, r10, r11, r12, r20, r21, r22 = rotation
        vx, vy, vz = velocity_world
        p, q, r = angular_body
        gx, gy = gust_acceleration
        u = r00 * vx + r10 * vy + r20 * vz
        v = r01 * vx + r11 * vy + r21 * vz
        w = r02 * vx + r12 * vy + r22 * vz
        s = abs(u)
        uu = u * s
        z = [
            *(u, v, w, p, q, r),
            *(uu, v * abs(v), w * abs(w), p * abs(p), q * abs(q), r * abs(r)),
            *(uu, s * v, s * w, s * p, s * q, s * r),
            q * w - r * v + r00 * gx + r10 * gy,
            r * u - p * w + r01 * gx + r11 * gy,
            p * v - q * u + r02 * gx + r12 * gy,
            *actuators,
        ]
        for place in self._fins:
            z[place] *= uu
        out: list[float] = self._weights.dot(np.array(z)).tolist()
        fx, fy, fz, k, m, n, px, py, pz, hx, hy, hz, *advance = out
        # −C_A(ν_r) ν_r = (p × ω, p × v + h × ω) with the added momenta p, h (Fossen 2011, equation 6.43).
        fx += py * r - pz * q
        fy += pz * p - px * r
        fz += px * q - py * p
        k += py * w - pz * v + hy * r - hz * q
        m += pz * u - px * w + hz * p - hx * r
        n += px * v - py * u + hx * q - hy * p
        mass = self._displaced_kg
        return [
            r00 * fx + r01 * fy + r02 * fz + mass * gx,
            r10 * fx + r11 * fy + r12 * fz + mass * gy,
            r20 * fx + r21 * fy + r22 * fz + self._buoyancy_n,
            k,
            m,
            n,
        ], advance
