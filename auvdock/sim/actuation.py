"""Thrusters and fins between command and wrench: what is constant about them, and how they stand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.marine import flip_vector
from auvdock.core.vehicle import VehicleCfg
from auvdock.numeric.records import Record, Records

__all__ = ["Actuator", "make_actuators"]

_RHO_KG_M3 = 1025.0
_NODES = 38
"""Of a thruster's curve: 36 measured points (`assets/thrusters`) and the two edges of its dead band."""
_NO_CURVE = np.zeros(_NODES)


@dataclass
class Actuator(Record):
    """A first-order actuator, stepped exactly for a command held over the step (`stepping.respond`).

    A thruster gives `wrench` times its state, a fin stands at its greatest angle times its state. The state goes to the
    command, or where the thruster has a measured curve (`core.thruster`), to the effort that the curve gives for it.
    """

    is_fin: bool
    lag: float
    """1 − e^(−dt/τ): share of the way to its command that the state goes in a step."""
    dead_band: float
    """Commands of a smaller magnitude do nothing."""
    has_curve: bool
    curve_command: Annotated[Array, _NODES]
    """Nodes of the curve; 0 without one."""
    curve_effort: Annotated[Array, _NODES]
    """Thrust there over `max_force_n`."""
    curve_power_w: Annotated[Array, _NODES]
    """Electrical power there."""
    max_force_n: float
    """At state 1; 0 for a fin."""
    disc_m_kg: float
    """2 / (ρ A) with the area A of a thruster's disc; 0 for a fin."""
    wrench: Annotated[Array, 6]
    """At state 1, body axes, in N and N m; of a fin per m²/s² of u |u|."""
    advance: Annotated[Array, 6]
    """A thruster's advance speed is this times ν_r; 0 for a fin."""
    place_m: Annotated[Array, 3]
    """In the body frame."""
    radius_m: float
    """Of a thruster's disc; 0 for a fin, whose place is in no vehicle's data: it is immersed as the hull is."""
    command: float = 0.0
    """Held over the step."""
    state: float = 0.0
    """In [-1, 1]; by a curve further the stronger way."""
    immersed: float = 1.0
    """Share that is under water."""
    advance_m_s: float = 0.0
    """Advance speed along the thrust axis."""


def make_actuators(vehicle: VehicleCfg, dt_s: float) -> Records[Actuator]:
    """(n,) a vehicle's actuators at rest, for steps of `dt_s`."""
    rows: list[Actuator] = []
    for part, wrench in zip(vehicle.actuators, vehicle.thruster_wrenches_body.T, strict=True):
        is_fin, thrust = part.kind == "fin", float(np.linalg.norm(wrench[:3]))
        curve = vehicle.curve(part)
        actuator = Actuator(
            is_fin=is_fin,
            lag=1.0 - math.exp(-dt_s / part.time_constant_s),
            dead_band=part.dead_band,
            has_curve=curve is not None,
            curve_command=_NO_CURVE if curve is None else curve.command,
            curve_effort=_NO_CURVE if curve is None else curve.effort(curve.command),
            curve_power_w=_NO_CURVE if curve is None else curve.power_w,
            max_force_n=0.0 if is_fin else vehicle.full_force_n(part),
            disc_m_kg=0.0 if is_fin else 2.0 / (_RHO_KG_M3 * (0.25 * math.pi * part.disc_diameter_m**2)),
            wrench=wrench,
            advance=np.zeros(6) if is_fin or thrust == 0.0 else wrench / thrust,
            place_m=flip_vector(np.array(part.position_m)),
            radius_m=0.0 if is_fin else 0.5 * part.disc_diameter_m,
        )
        rows.append(actuator)
    return Actuator.table(rows)
