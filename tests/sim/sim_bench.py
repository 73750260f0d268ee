"""Vehicles, a far-away station and a reference model, shared by the simulator's tests."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.station import ConicalStationCfg, load_conical_station
from auvdock.core.transforms import quat_wxyz_from_euler_zyx
from auvdock.core.vehicle import Coefficient, VehicleCfg, load_vehicle
from auvdock.sim.hydrodynamics import GRAVITY_M_S2
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.simulator import SimCfg, Simulator

REMUS = load_vehicle("remus_hybrid")
STATION = load_conical_station()
DEEP_STATION = dataclasses.replace(STATION, depth_m=60.0, floor_below_m=60.0)
"""Room to move for a minute without meeting a floor."""


def coefficient(name: str, value: float) -> Coefficient:
    return Coefficient(name, value, "SI", "test")


def trimmed(vehicle: VehicleCfg = REMUS) -> VehicleCfg:
    """The same vehicle with buoyancy equal to weight."""
    return dataclasses.replace(vehicle, buoyancy_n=vehicle.mass_kg * GRAVITY_M_S2)


def undamped(vehicle: VehicleCfg, added_mass: dict[str, float] | None = None) -> VehicleCfg:
    """The same vehicle, trimmed, without damping, with other added mass if given."""
    masses = tuple(coefficient(name, value) for name, value in (added_mass or {}).items())
    return dataclasses.replace(
        trimmed(vehicle),
        linear_damping=(),
        quadratic_damping=(),
        lift_damping=(),
        added_mass=masses if added_mass is not None else vehicle.added_mass,
    )


def simulator(
    vehicle: VehicleCfg = REMUS,
    station: ConicalStationCfg = DEEP_STATION,
    current: CurrentCfg | None = None,
    rate_hz: float = 120.0,
) -> Simulator:
    return Simulator(SimCfg(current=current or CurrentCfg(), physics_hz=rate_hz), station, vehicle)


def start(
    sim: Simulator,
    position: tuple[float, float, float] = (40.0, 0.0, -60.0),
    euler_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    nu_relative: Array | None = None,
    seed: int = 0,
) -> None:
    """Reset to a pose and a velocity through the water in body axes."""
    quat = quat_wxyz_from_euler_zyx(*(math.radians(angle) for angle in euler_deg))
    sim.reset(np.array(position), quat, np.random.default_rng(seed), nu_relative_body=nu_relative)


def command(sim: Simulator, **values: float) -> Array:
    """An actuator command by name."""
    names = sim.vehicle.actuator_names
    out = np.zeros(len(names))
    for name, value in values.items():
        out[names.index(name)] = value
    return out


def run(sim: Simulator, seconds: float, values: Array) -> None:
    for _ in range(round(seconds * sim.cfg.physics_hz)):
        sim.step(values)


def state(sim: Simulator) -> Array:
    return np.concatenate([sim.data.qpos, sim.data.qvel])
