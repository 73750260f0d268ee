"""Fossen's 6-DOF hydrodynamics relative to the water, as what MuJoCo lacks: the constants of one vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.vehicle import VehicleCfg
from auvdock.numeric.records import Record, Records

__all__ = ["GRAVITY_M_S2", "Hull", "draw_hull", "make_hull"]

GRAVITY_M_S2 = 9.81
"""Standard of the vehicle data: weight = mass × 9.81."""


@dataclass
class Hull(Record):
    """A hull for `stepping.wrench` and `stepping.add_mass`: coefficients, and how much of it is under water.

    With the body's acceleration ν̇ over ground, the accelerating water's u̇_c and v_r = v − Rᵀ u_c, Fossen (2011,
    chapters 6 and 8) reads, for the free joint's coordinates (a, ω̇) with a = R (v̇ + ω × v):

        (M_RB + M_A) ν̇ + … = −C_A(ν_r) ν_r + M_A (ω × v_r + Rᵀ u̇_c, 0) + m_d Rᵀ u̇_c + D-terms + actuators

    The second term turns MuJoCo's world-frame acceleration into the body-frame derivative that M_A multiplies; the
    third is the Froude-Krylov force of accelerating water on the displaced mass m_d. Only gusts accelerate the water:
    shear is taken as quasi-steady. The D-terms are D ν_r + D_q |ν_r|ν_r + |u_r| D_l ν_r.
    """

    linear_damping: Annotated[Array, 6, 6]
    """D, SI units, body axes; like the next three from `VehicleCfg`."""
    quadratic_damping: Annotated[Array, 6, 6]
    """D_q."""
    lift_damping: Annotated[Array, 6, 6]
    """D_l."""
    added_mass: Annotated[Array, 6, 6]
    """M_A."""
    displaced_kg: float
    """m_d."""
    buoyancy_n: float
    """Of the whole hull."""
    clearance_m: float
    """All of the vehicle is under water while its origin is this deep, whatever its attitude."""
    immersed: float
    """Share s of the displaced volume that is under water; exactly 1 is all."""
    growth_1_s: float
    """ds/dt while it grows, else 0."""
    moment_m: Annotated[Array, 3]
    """Moment of the immersed volume's shares about the origin, body axes; 0 of the whole hull."""


def make_hull(vehicle: VehicleCfg, clearance_m: float) -> Records[Hull]:
    """(1,) a vehicle's hull, all of it under water."""
    return Hull(
        linear_damping=vehicle.linear_damping_body,
        quadratic_damping=vehicle.quadratic_damping_body,
        lift_damping=vehicle.lift_damping_body,
        added_mass=vehicle.added_mass_body,
        displaced_kg=vehicle.buoyancy_n / GRAVITY_M_S2,
        buoyancy_n=vehicle.buoyancy_n,
        clearance_m=clearance_m,
        immersed=1.0,
        growth_1_s=0.0,
        moment_m=np.zeros(3),
    ).packed()


def draw_hull(hull: Records[Hull], vehicle: VehicleCfg, spread: float, rng: np.random.Generator) -> None:
    """Give a hull (1,) coefficients about the published ones, in place.

    Each damping and lift coefficient gets a factor e^(σ n) of its own, n normal. Added mass, which potential theory
    knows better, becomes D M_A D with D = diag(e^(σ n / 4)): its entries spread half as much at most, and it stays
    symmetric and positive.

    Args:
        hull: takes them.
        vehicle: whose coefficients.
        spread: σ; 0 for the published ones themselves.
        rng: draws the same numbers whatever the spread.
    """
    normal = rng.standard_normal((3, 6, 6))
    factors = np.exp(spread * normal)
    hull["linear_damping"][0] = vehicle.linear_damping_body * factors[0]
    hull["quadratic_damping"][0] = vehicle.quadratic_damping_body * factors[1]
    hull["lift_damping"][0] = vehicle.lift_damping_body * factors[2]
    scale = np.exp(0.25 * spread * rng.standard_normal(6))
    hull["added_mass"][0] = vehicle.added_mass_body * np.outer(scale, scale)
