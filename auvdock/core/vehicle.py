"""A vehicle as data: published coefficients, hull and actuators, read from TOML.

Coefficients keep the names, signs and axes in which they are published (SNAME 1950; Fossen 2011): body axes x forward,
y starboard, z down, origin at the centre of buoyancy. The matrices that this module derives say in their names in
which axes they are: `_marine` or `_body` (x forward, y port, z up).
"""

from __future__ import annotations

import dataclasses
import math
import re
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from auvdock.assets import asset
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive
from auvdock.core.marine import flip_matrix, flip_twist, flip_vector
from auvdock.core.strict import load_toml
from auvdock.core.thruster import ThrusterCurve, load_curve

__all__ = ["ActuatorCfg", "HullPartCfg", "MountCfg", "VehicleCfg", "load_vehicle"]

_ROWS = {"X": 0, "Y": 1, "Z": 2, "K": 3, "M": 4, "N": 5}
_COLUMNS = {"u": 0, "v": 1, "w": 2, "p": 3, "q": 4, "r": 5}
_NAME = re.compile(r"^([XYZKMN])_(u)?([uvwpqr])(dot)?$|^([XYZKMN])_([uvwpqr])\6$")


@dataclass(frozen=True)
class Coefficient(Checked):
    """One hydrodynamic derivative with its unit and where it was published."""

    name: str
    """SNAME name, such as "Y_vdot", "X_uu", "N_uv"."""
    value: float
    """Value in the unit below, with the published sign."""
    unit: str
    """SI unit."""
    source: str
    """Author, year, table."""


@dataclass(frozen=True)
class ActuatorCfg(Checked):
    """A thruster or a fin.

    A thruster gives force = max_force_n × command along `direction` at `position_m`, or by `curve` what its maker
    measured. A fin gives the wrench `fin_wrench` × u |u| × angle, with angle = max_angle_rad × command.
    """

    name: str
    """Unique name."""
    kind: Literal["thruster", "fin"]
    """"thruster" or "fin"."""
    source: str
    """Where its figures come from."""
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Marine axes."""
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    """Unit direction of positive thrust, marine axes."""
    max_force_n: float = 0.0
    """Thrust at command 1; unused with a curve."""
    curve: str = ""
    """Thruster preset (`assets/thrusters`) whose measured curve says the thrust at the vehicle's voltage; none for a
    thrust that is proportional to the command."""
    disc_diameter_m: float = 0.1
    """Propeller diameter, for the power that the thrust costs."""
    time_constant_s: Positive = 0.1
    """First-order lag."""
    dead_band: float = 0.0
    """Commands below this magnitude give nothing; a curve has a dead band of its own."""
    max_angle_rad: float = 0.0
    """Fin angle at command 1."""
    fin_wrench: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Marine wrench for u |u| × angle = 1 (N s²/m² and N s²/m per rad)."""


@dataclass(frozen=True)
class MountCfg(Checked):
    """Where a camera sits; marine axes."""

    position_m: tuple[float, float, float]
    direction: tuple[float, float, float]
    up: tuple[float, float, float]


@dataclass(frozen=True)
class HullPartCfg(Checked):
    """A solid part of the vehicle: what touches a station and what is drawn; marine axes."""

    name: str
    """Unique name."""
    shape: Literal["box", "capsule", "cylinder"]
    """"box", or "capsule" or "cylinder" lying along x."""
    position_m: tuple[float, float, float]
    """Centre from the origin."""
    size_m: tuple[Positive, Positive, Positive]
    """Full extent along x, y and z; round parts have their diameter twice."""
    displaces: bool = True
    """Whether the vehicle's buoyancy is spread over its volume; an open cage of rods displaces next to nothing."""

    def __post_init__(self) -> None:
        """Refuse round parts that are not round, and capsules without a straight part."""
        if self.shape != "box" and self.size_m[1] != self.size_m[2]:
            raise ConfigError("size_m", self.size_m, "the same diameter along y and z")
        if self.shape == "capsule" and self.size_m[0] <= self.size_m[1]:
            raise ConfigError("size_m", self.size_m, "a capsule longer than thick")


@dataclass(frozen=True)
class VehicleCfg(Checked):
    """Everything that is published of a vehicle and that its pilot may know."""

    name: str
    description: str
    mass_kg: float
    """Dry mass with enclosed water where the source counts it."""
    inertia_kg_m2: tuple[float, float, float]
    """Ixx, Iyy, Izz about the origin (centre of buoyancy)."""
    centre_of_gravity_m: tuple[float, float, float]
    """From the centre of buoyancy, marine axes: z down positive means stable."""
    buoyancy_n: float
    """Buoyant force; compare mass × 9.81."""
    length_m: float
    radius_m: float
    nose_x_m: float
    """Foremost point from the origin."""
    tail_x_m: float
    """Aftmost point from the origin (negative)."""
    added_mass: tuple[Coefficient, ...]
    """Derivatives such as X_udot: M_A[i, j] = -value."""
    linear_damping: tuple[Coefficient, ...]
    """Derivatives such as X_u: τ_i += value ν_j."""
    quadratic_damping: tuple[Coefficient, ...]
    """Derivatives such as X_uu, meant as X_u|u|: τ_i += value |ν_j| ν_j."""
    lift_damping: tuple[Coefficient, ...]
    """Body and fin lift such as Y_uv: τ_i += value |u| ν_j. The Munk moment is not in it: M_A's Coriolis gives that."""
    actuators: tuple[ActuatorCfg, ...]
    bow_camera: MountCfg
    belly_camera: MountCfg
    voltage_v: float = 16.0
    """Supply of the thrusters that have a curve."""
    seat_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Middle of the round that comes to rest in a landing station's guides, marine axes: of the hull, or of a keel."""
    hull: tuple[HullPartCfg, ...] = ()
    """Solid parts; none stands for one capsule of `radius_m` from `tail_x_m` to `nose_x_m`, with fins at its tail."""

    @property
    def hull_parts(self) -> tuple[HullPartCfg, ...]:
        """The solid parts, the one capsule spelt out."""
        if self.hull:
            return self.hull
        middle_m, length_m = 0.5 * (self.nose_x_m + self.tail_x_m), self.nose_x_m - self.tail_x_m
        size_m = (length_m, 2.0 * self.radius_m, 2.0 * self.radius_m)
        return (HullPartCfg("hull", "capsule", (middle_m, 0.0, 0.0), size_m),)

    @property
    def displacing_parts(self) -> tuple[HullPartCfg, ...]:
        """Those of them over which the buoyancy is spread.

        Raises:
            ConfigError: there are none.
        """
        parts = tuple(part for part in self.hull_parts if part.displaces)
        if not parts:
            raise ConfigError("hull", self.name, "a part that displaces water")
        return parts

    @cached_property
    def hull_box_body_m(self) -> Array:
        """(2, 3) least and greatest coordinates of the solid parts, package body axes."""
        middles = np.array([flip_vector(np.array(part.position_m)) for part in self.hull_parts])
        halves = 0.5 * np.array([part.size_m for part in self.hull_parts])
        return np.stack([(middles - halves).min(axis=0), (middles + halves).max(axis=0)])

    @cached_property
    def seat_body_m(self) -> Array:
        """(3,) `seat_m` in package body axes."""
        return flip_vector(np.array(self.seat_m))

    @cached_property
    def added_mass_body(self) -> Array:
        """(6, 6) M_A about the origin, package body axes, symmetric."""
        matrix = -_matrix(self.added_mass, "added_mass")
        if not np.allclose(matrix, matrix.T, atol=1e-9):
            raise ConfigError("added_mass", self.name, "a symmetric added-mass matrix")
        return flip_matrix(matrix)

    @cached_property
    def linear_damping_body(self) -> Array:
        """(6, 6) A with τ = A ν_r, package body axes."""
        return flip_matrix(_matrix(self.linear_damping, "linear_damping"))

    @cached_property
    def quadratic_damping_body(self) -> Array:
        """(6, 6) A with τ = A (|ν_r| ∘ ν_r), package body axes."""
        return flip_matrix(_matrix(self.quadratic_damping, "quadratic_damping"))

    @cached_property
    def lift_damping_body(self) -> Array:
        """(6, 6) A with τ = |u| A ν_r, package body axes."""
        return flip_matrix(_matrix(self.lift_damping, "lift_damping"))

    @cached_property
    def rigid_body_mass_body(self) -> Array:
        """(6, 6) M_RB about the origin, package body axes (Fossen 2011, equation 3.44)."""
        m = self.mass_kg
        x, y, z = (float(part) for part in self.centre_of_gravity_body_m)
        skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = m * np.eye(3)
        matrix[:3, 3:] = -m * skew
        matrix[3:, :3] = m * skew
        matrix[3:, 3:] = np.diag(self.inertia_kg_m2)
        return matrix

    @cached_property
    def centre_of_gravity_body_m(self) -> Array:
        """(3,) centre of gravity from the origin, package body axes."""
        return flip_vector(np.array(self.centre_of_gravity_m))

    @property
    def actuator_names(self) -> tuple[str, ...]:
        """Names in the order of `Command.values`."""
        return tuple(actuator.name for actuator in self.actuators)

    def curve(self, actuator: ActuatorCfg) -> ThrusterCurve | None:
        """The measured curve of a thruster at the vehicle's voltage, None if it has none.

        Raises:
            ConfigError: no such preset, or a voltage at which it was not measured.
        """
        return load_curve(actuator.curve, self.voltage_v) if actuator.curve else None

    def full_force_n(self, actuator: ActuatorCfg) -> float:
        """A thruster's force at effort 1; one with a curve gives more than that the stronger way."""
        curve = self.curve(actuator)
        return actuator.max_force_n if curve is None else curve.reference_n

    def efforts(self, commands: Array) -> Array:
        """(n,) force over `full_force_n`, or angle over the greatest, that commands (n,) in [-1, 1] settle at."""
        values = np.where(np.abs(commands) < [actuator.dead_band for actuator in self.actuators], 0.0, commands)
        for index, actuator in enumerate(self.actuators):
            curve = self.curve(actuator)
            if curve is not None:
                values[index] = curve.effort(commands[index])
        return values

    @cached_property
    def thruster_wrenches_body(self) -> Array:
        """(6, n) wrench of each actuator at effort 1, package body axes; a fin's column is for u |u| = 1 m²/s²."""
        columns: list[Array] = []
        for actuator in self.actuators:
            if actuator.kind == "thruster":
                force = np.array(actuator.direction) * self.full_force_n(actuator)
                wrench = np.concatenate([force, np.cross(np.array(actuator.position_m), force)])
            else:
                wrench = np.array(actuator.fin_wrench) * actuator.max_angle_rad
            columns.append(flip_twist(wrench))
        return np.column_stack(columns)


def load_vehicle(name: str, voltage_v: float | None = None) -> VehicleCfg:
    """A vehicle preset by name.

    Args:
        name: of the preset.
        voltage_v: supply of its thrusters, in place of the preset's.

    Raises:
        ConfigError: no such preset, a file that does not fit, or a voltage at which its thrusters were not measured.
    """
    vehicle = load_toml(VehicleCfg, asset("vehicles", name))
    if voltage_v is not None:
        vehicle = dataclasses.replace(vehicle, voltage_v=voltage_v)
    for actuator in vehicle.actuators:
        vehicle.curve(actuator)
    return vehicle


def _matrix(coefficients: tuple[Coefficient, ...], field: str) -> Array:
    matrix = np.zeros((6, 6))
    for coefficient in coefficients:
        match = _NAME.match(coefficient.name)
        if match is None or not math.isfinite(coefficient.value):
            raise ConfigError(field, coefficient.name, "a SNAME derivative such as Y_vdot, X_u, Y_vv or N_uv")
        row, column = (match[1], match[3]) if match[1] else (match[5], match[6])
        matrix[_ROWS[row], _COLUMNS[column]] += coefficient.value
    return matrix
