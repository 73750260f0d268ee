"""The sea ends at z = 0: what floats, falls, rises and is driven there."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sim_bench import REMUS, command, run, simulator, start

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import quat_wxyz_from_euler_zyx, rotation_from_quat_wxyz
from auvdock.core.vehicle import HullPartCfg, VehicleCfg, load_vehicle
from auvdock.numeric.records import Records
from auvdock.sim.actuation import Actuator, make_actuators
from auvdock.sim.hydrodynamics import Hull, make_hull
from auvdock.sim.immersion import Piece, clearance_m, cut_hull, immerse
from auvdock.sim.simulator import Simulator

BLUEROV = load_vehicle("bluerov2_heavy")
SYMMETRIC = dataclasses.replace(REMUS, nose_x_m=0.665, tail_x_m=-0.665)
"""A torpedo whose hull has its middle where its data has the centre of buoyancy."""
VEHICLES = {"remus": REMUS, "bluerov": BLUEROV}
ANGLES = st.floats(-math.pi, math.pi)


class Immersion:
    """A vehicle's parts, and what of them is under water at a pose and a velocity."""

    def __init__(self, vehicle: VehicleCfg) -> None:
        self.pieces: Records[Piece] = cut_hull(vehicle)
        self.actuators: Records[Actuator] = make_actuators(vehicle, 0.01)
        self.clearance_m = clearance_m(self.pieces, self.actuators)
        self.parts: Records[Hull] = make_hull(vehicle, self.clearance_m)

    def of(self, place: Array, velocity: Array) -> Hull:
        immerse(place, velocity, self.pieces, self.parts, self.actuators)
        return Hull.read(self.parts.copy())

    def shares(self, place: Array) -> list[float]:
        """Of the hull and of each actuator."""
        return [self.of(place, np.zeros(6)).immersed, *self.actuators["immersed"].tolist()]


IMMERSIONS = {name: Immersion(vehicle) for name, vehicle in VEHICLES.items()}


def pose(height_m: float, roll: float = 0.0, pitch: float = 0.0) -> Array:
    return np.concatenate([[3.0, -2.0, height_m], quat_wxyz_from_euler_zyx(roll, pitch, 1.0)])


def light(vehicle: VehicleCfg, share: float) -> VehicleCfg:
    """The same vehicle with the buoyancy of one that floats with `share` of its hull in the water."""
    return dataclasses.replace(vehicle, buoyancy_n=vehicle.mass_kg * 9.81 / share)


def points_inside(part: HullPartCfg, rng: np.random.Generator) -> Array:
    """Points spread evenly over a hull part, package body axes."""
    points = rng.uniform(-0.5, 0.5, (60_000, 3)) * part.size_m
    if part.shape == "capsule":
        beyond = np.maximum(0.0, np.abs(points[:, 0]) - 0.5 * (part.size_m[0] - part.size_m[1]))
        radial = np.column_stack([beyond, points[:, 1], points[:, 2]])
        points = points[np.linalg.norm(radial, axis=1) < 0.5 * part.size_m[1]]
    return points


@pytest.mark.parametrize("name", VEHICLES)
@settings(deadline=None)  # the first call may compile
@given(st.floats(-1.5, 1.5), st.floats(0.0, 0.2), ANGLES, st.floats(-1.5, 1.5))
def test_the_immersed_share_falls_from_one_to_nothing_as_the_hull_rises(
    name: str, height: float, step: float, roll: float, pitch: float
) -> None:
    immersion = IMMERSIONS[name]
    low, high = immersion.shares(pose(height, roll, pitch)), immersion.shares(pose(height + step, roll, pitch))
    for one, other in zip(low, high, strict=True):
        assert 0.0 <= other <= one + 1e-12 <= 1.0 + 2e-12
    if height < -immersion.clearance_m:
        assert low == [1.0] * len(low)
        deep = immersion.of(pose(height, roll, pitch), np.zeros(6))
        assert (deep.growth_1_s, deep.moment_m.tolist()) == (0.0, [0.0, 0.0, 0.0])
    if height > immersion.clearance_m:
        assert low[0] < 1e-12


@pytest.mark.parametrize("vehicle", [SYMMETRIC, BLUEROV], ids=["torpedo", "box"])
def test_share_and_moment_are_those_of_the_immersed_volume(vehicle: VehicleCfg) -> None:
    """Against tens of thousands of points spread over the hull, at any attitude: within 0.035 of the volume and of its
    greatest moment; a level torpedo within 0.008."""
    rng = np.random.default_rng(0)
    points = points_inside(vehicle.displacing_parts[0], rng)
    immersion = Immersion(vehicle)
    extent = np.linalg.norm(points, axis=1).max()
    for trial in range(24):
        roll, pitch = (0.0, 0.0) if trial < 8 else (rng.uniform(-3.0, 3.0), rng.uniform(-1.5, 1.5))
        place = pose(rng.uniform(-0.3, 0.3), roll, pitch)
        heights = place[2] + points @ rotation_from_quat_wxyz(place[3:])[2]
        under = heights < 0.0
        got = immersion.of(place, np.zeros(6))
        level_torpedo = vehicle is SYMMETRIC and trial < 8
        assert got.immersed == pytest.approx(under.mean(), abs=0.008 if level_torpedo else 0.035)
        moment = points[under].sum(axis=0) / len(points)
        np.testing.assert_allclose(got.moment_m, moment, atol=0.035 * extent)


@pytest.mark.parametrize("name", VEHICLES)
def test_growth_is_the_derivative_of_the_share(name: str) -> None:
    """Against a central difference along the motion, 1e-5; what shrinks gives 0."""
    rng, immersion = np.random.default_rng(1), IMMERSIONS[name]
    for _ in range(100):
        height, roll, pitch = rng.uniform(-0.2, 0.2), rng.uniform(-3.0, 3.0), rng.uniform(-1.0, 1.0)
        place, rate, dt = pose(height, roll, pitch), rng.uniform(-1.0, 1.0, 6), 1e-6
        shares: list[float] = []
        for sign in (-1.0, 1.0):
            spin = sign * dt * rate[3:]
            w, v = place[3], place[4:]
            turned = np.concatenate([[w - 0.5 * v @ spin], v + 0.5 * (w * spin + np.cross(v, spin))])
            moved = np.concatenate([place[:3] + sign * dt * rate[:3], turned / np.linalg.norm(turned)])
            shares.append(immersion.of(moved, rate).immersed)
        slope = (shares[1] - shares[0]) / (2.0 * dt)
        assert immersion.of(place, rate).growth_1_s == pytest.approx(max(0.0, slope), abs=1e-5)


def test_the_torpedos_volume_has_its_middle_in_the_centre_of_buoyancy() -> None:
    pieces = IMMERSIONS["remus"].pieces
    np.testing.assert_allclose(pieces["weight"] @ pieces["place_m"], 0.0, atol=1e-12)
    assert pieces["weight"].min() > 0.0


def test_a_hull_beside_its_centre_of_buoyancy_is_refused() -> None:
    keel = dataclasses.replace(BLUEROV.hull[1], displaces=True)
    with pytest.raises(ConfigError, match="hull"):
        Immersion(dataclasses.replace(BLUEROV, hull=(keel,)))
    with pytest.raises(ConfigError, match="displaces"):
        Immersion(dataclasses.replace(BLUEROV, hull=BLUEROV.hull[1:]))


@pytest.mark.parametrize(("vehicle", "share"), [(REMUS, 0.9), (BLUEROV, 0.8)], ids=["torpedo", "box"])
def test_left_alone_a_light_vehicle_comes_to_rest_displacing_its_weight(vehicle: VehicleCfg, share: float) -> None:
    """Archimedes: at rest (5 mm/s) at the surface, buoyancy × share = weight within 0.5 %; nobody flies."""
    sim = simulator(light(vehicle, share))
    start(sim, (30.0, 0.0, -0.6), (10.0, 5.0, 0.0))
    still, highest = np.zeros(len(vehicle.actuators)), -1.0
    for _ in range(200):
        run(sim, 0.5, still)
        highest = max(highest, float(sim.truth.T_world_body[2, 3]))
    assert abs(sim.truth.nu_body[2]) < 5e-3
    assert sim.truth.immersed_share == pytest.approx(share, rel=5e-3)
    assert highest < vehicle.radius_m
    assert 0.0 < sim.truth.broached_s < sim.truth.time_s


def energy_j(sim: Simulator, immersion: Immersion) -> float:
    """Kinetic energy of hull and added mass, weight, and the potential of the pieces' buoyancy: of a disc
    a F(z/a) with F(t) = (√(1 − t²) − t arccos t − (1 − t²)^1.5 / 3) / π, whose slope is −f, and −z below."""
    vehicle, truth = sim.vehicle, sim.truth
    qpos = sim.data.qpos
    mass = vehicle.rigid_body_mass_body + truth.immersed_share * vehicle.added_mass_body
    up = rotation_from_quat_wxyz(qpos[3:])[2]
    pieces = immersion.pieces
    t = (qpos[2] + pieces["place_m"] @ up) / pieces["radius_m"]
    inside = np.clip(t, -1.0, 1.0)
    chord = np.sqrt(1.0 - inside**2)
    lifted = (chord - inside * np.arccos(inside) - chord**3 / 3.0) / math.pi + np.maximum(0.0, -1.0 - t)
    buoyancy = vehicle.buoyancy_n * float(pieces["weight"] @ (pieces["radius_m"] * lifted))
    height = qpos[2] + up @ vehicle.centre_of_gravity_body_m
    nu = truth.nu_relative_body
    return 0.5 * float(nu @ mass @ nu) + vehicle.mass_kg * 9.81 * float(height) + buoyancy


@pytest.mark.parametrize("vehicle", [REMUS, light(BLUEROV, 0.8)], ids=["torpedo", "box"])
@pytest.mark.parametrize(("damped", "rate_hz"), [(True, 120.0), (False, 120.0), (False, 480.0)])
def test_without_thrust_energy_never_grows_across_the_surface(
    vehicle: VehicleCfg, damped: bool, rate_hz: float
) -> None:
    """Thrown out of the water and back, tumbling: with damping no growth from step to step (1e-4 of the kinetic energy
    at the start); without, the integrator's error alone, which goes with the step: 4 % over the run at 120 Hz, 1 % at
    480 Hz."""
    if not damped:
        vehicle = dataclasses.replace(vehicle, linear_damping=(), quadratic_damping=(), lift_damping=())
    bound = 1e-4 if damped else 0.04 * 120.0 / rate_hz
    rng, sim, immersion = np.random.default_rng(2), simulator(vehicle, rate_hz=rate_hz), Immersion(vehicle)
    still = np.zeros(len(vehicle.actuators))
    for _ in range(3):
        nu = np.concatenate([rng.uniform(-1.0, 1.0, 2), [rng.uniform(1.0, 2.5)], rng.uniform(-0.5, 0.5, 3)])
        start(sim, (30.0, 0.0, -0.3), (rng.uniform(-40.0, 40.0), rng.uniform(-30.0, 30.0), 0.0), nu_relative=nu)
        kinetic = 0.5 * float(nu @ (vehicle.rigid_body_mass_body + vehicle.added_mass_body) @ nu)
        least = energy_j(sim, immersion)
        highest = -1.0
        for _ in range(150):
            sim.step(still, round(rate_hz / 60.0))
            now = energy_j(sim, immersion)
            assert now <= least + bound * kinetic
            least, highest = min(least, now), max(highest, float(sim.data.qpos[2]))
        assert highest > -0.1  # it was out


def test_in_the_air_nothing_acts_but_weight() -> None:
    """All actuators on: free fall within 1e-9 m/s, and no thruster works."""
    sim = simulator()
    start(sim, (30.0, 0.0, 5.0), nu_relative=np.array([1.0, 0.2, 0.0, 0.0, 0.0, 0.0]))
    run(sim, 0.5, np.ones(len(REMUS.actuators)))
    assert sim.data.qvel[:3].tolist() == pytest.approx([1.0, 0.2, -9.81 * 0.5], abs=1e-9)
    assert sim.truth.energy_j == 0.0
    assert sim.truth.immersed_share == 0.0
    assert sim.truth.broached_s == pytest.approx(0.5)


@pytest.mark.parametrize("name", VEHICLES)
def test_full_upward_thrust_stays_at_the_surface(name: str) -> None:
    """From 2 m of depth, 20 s: it leaps out by no more than its length, and ends partly in the water."""
    vehicle = VEHICLES[name]
    sim = simulator(vehicle)
    start(sim, (30.0, 0.0, -2.0))
    up = np.array([np.sign(float(column[2])) for column in vehicle.thruster_wrenches_body.T])
    up = np.where([actuator.kind == "thruster" for actuator in vehicle.actuators], up, 0.0)
    for _ in range(40):
        run(sim, 0.5, up)
        assert sim.truth.T_world_body[2, 3] < vehicle.length_m
    assert sim.truth.broached_s > 5.0
    assert sim.truth.immersed_share > 0.05


def test_at_depth_the_surface_is_not_felt() -> None:
    """The same motion 1 m and 100 m down, within the rounding of MuJoCo's world coordinates, 1e-12."""
    velocities: list[list[float]] = []
    for depth in (1.0, 100.0):
        sim = simulator(REMUS)
        start(sim, (30.0, 0.0, -depth), nu_relative=np.array([0.8, 0.1, -0.1, 0.0, 0.05, 0.1]))
        run(sim, 2.0, command(sim, stern=0.7, rudder=0.3, fore_lateral=0.2))
        velocities.append(sim.data.qvel.tolist())
        assert sim.truth.broached_s == 0.0
    assert velocities[0] == pytest.approx(velocities[1], abs=1e-12)
