"""The vehicle as its controllers see it: Fossen's model relative to the water, and its linearisation.

All in package body axes (x forward, y port, z up). Nothing here flips a sign: the matrices of `VehicleCfg` already
come in these axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, check_shape
from auvdock.core.vehicle import VehicleCfg

__all__ = ["AXES", "AxisPlant", "acceleration", "axis_plants", "hydrodynamic_wrench", "linearise", "thruster_lag_s"]

AXES = ("surge", "sway", "heave", "pitch", "heading")
"""Axes that every vehicle controls, in the order of the rows (0, 1, 2, 4, 5) of the body wrench.

Roll, row 3, is controlled by vehicles whose thrusters act on it; a torpedo's do not.
"""

_ROWS = {"surge": 0, "sway": 1, "heave": 2, "roll": 3, "pitch": 4, "heading": 5}
_GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class AxisPlant:
    """One decoupled axis: inertia ẍ + damping ẋ + stiffness x = wrench, behind the thrusters' lag.

    For surge, sway and heave ẋ is the controlled velocity; for roll, pitch and heading x is the controlled angle.
    """

    axis: str
    """One of `AXES`, or "roll"."""
    inertia: float
    """kg, or kg m² for angles; added mass included."""
    damping: float
    """N s/m, or N m s/rad, at the operating point; 0 or more."""
    stiffness: float
    """N m/rad: m g BG for roll and pitch, 0 elsewhere."""
    lag_s: float
    """First-order time constant of the actuators."""


def hydrodynamic_wrench(vehicle: VehicleCfg, nu_relative: Array) -> Array:
    """(6,) wrench of the water on the hull: −C(ν_r) ν_r − D(ν_r) ν_r (Fossen 2011, equations 6.43 and 6.53).

    C is that of M_RB + M_A in Kirchhoff's form: with momenta p = M₁₁ v + M₁₂ ω and h = M₂₁ v + M₂₂ ω,
    −C ν = (p × ω, p × v + h × ω). The Munk moment is its p × v part.

    Args:
        vehicle: whose coefficients.
        nu_relative: (6,) velocity through the water in body axes, m/s and rad/s.
    """
    check_shape("nu_relative", nu_relative, (6,))
    momentum = (vehicle.rigid_body_mass_body + vehicle.added_mass_body) @ nu_relative
    linear, angular = nu_relative[:3], nu_relative[3:]
    coriolis = np.concatenate(
        [np.cross(momentum[:3], angular), np.cross(momentum[:3], linear) + np.cross(momentum[3:], angular)]
    )
    damping = (
        vehicle.linear_damping_body @ nu_relative
        + vehicle.quadratic_damping_body @ (np.abs(nu_relative) * nu_relative)
        + abs(float(nu_relative[0])) * (vehicle.lift_damping_body @ nu_relative)
    )
    return coriolis + damping


def acceleration(vehicle: VehicleCfg, nu_relative: Array, roll_rad: float, pitch_rad: float, wrench: Array) -> Array:
    """(6,) ν̇_r of Fossen's model in still or uniformly moving water, body axes.

    Restoring wrench with the origin in the centre of buoyancy: (B − W) upwards at the origin, and W at the centre of
    gravity r_g gives the moment r_g × W (Fossen 2011, equation 4.6).
    """
    up = np.array(
        [-math.sin(pitch_rad), math.cos(pitch_rad) * math.sin(roll_rad), math.cos(pitch_rad) * math.cos(roll_rad)]
    )
    weight = vehicle.mass_kg * _GRAVITY_M_S2
    restoring = np.concatenate(
        [(vehicle.buoyancy_n - weight) * up, np.cross(vehicle.centre_of_gravity_body_m, -weight * up)]
    )
    mass = vehicle.rigid_body_mass_body + vehicle.added_mass_body
    total = wrench + restoring + hydrodynamic_wrench(vehicle, nu_relative)
    return np.asarray(np.linalg.solve(mass, total), dtype=np.float64)


def linearise(vehicle: VehicleCfg, nu_relative: Array) -> tuple[Array, Array]:
    """State matrices about a steady velocity through the water, by central differences.

    State (u, v, w, p, q, r, roll, pitch, yaw), input body wrench (6,): ẋ = A x + B τ with level trim.

    Returns:
        A (9, 9) and B (9, 6).
    """
    step = 1e-5

    def rate(state: Array) -> Array:
        nu_dot = acceleration(vehicle, state[:6], float(state[6]), float(state[7]), np.zeros(6))
        return np.concatenate([nu_dot, state[3:6]])

    trim = np.concatenate([nu_relative, np.zeros(3)])
    columns = [(rate(trim + step * unit) - rate(trim - step * unit)) / (2.0 * step) for unit in np.eye(9)]
    mass = vehicle.rigid_body_mass_body + vehicle.added_mass_body
    inputs = np.vstack([np.asarray(np.linalg.inv(mass), dtype=np.float64), np.zeros((3, 6))])
    return np.column_stack(columns), inputs


def thruster_lag_s(vehicle: VehicleCfg) -> float:
    """Slowest thruster's time constant."""
    return max(actuator.time_constant_s for actuator in vehicle.actuators if actuator.kind == "thruster")


def axis_plants(vehicle: VehicleCfg, surge_m_s: float, slip_m_s: float = 0.0) -> dict[str, AxisPlant]:
    """Decoupled plants about straight flight at `surge_m_s`, with `slip_m_s` of sway and heave through the water.

    Args:
        vehicle: whose coefficients.
        surge_m_s: forward speed through the water.
        slip_m_s: sideways and vertical speed through the water; quadratic damping grows with it.

    Returns:
        A plant for each of `AXES` and for "roll".
    """
    state_matrix, _ = linearise(vehicle, np.array([surge_m_s, slip_m_s, slip_m_s, 0.0, 0.0, 0.0]))
    mass = np.diag(vehicle.rigid_body_mass_body + vehicle.added_mass_body)
    stiffness = vehicle.mass_kg * _GRAVITY_M_S2 * max(0.0, -float(vehicle.centre_of_gravity_body_m[2]))
    lag_s = thruster_lag_s(vehicle)
    return {
        axis: AxisPlant(
            axis=axis,
            inertia=float(mass[row]),
            damping=max(0.0, -float(state_matrix[row, row] * mass[row])),
            stiffness=stiffness if axis in ("roll", "pitch") else 0.0,
            lag_s=lag_s,
        )
        for axis, row in _ROWS.items()
    }
