from __future__ import annotations

import numpy as np
import pytest
from sim_bench import REMUS, trimmed

from auvdock.core.arrays import Array
from auvdock.core.marine import flip_matrix, flip_twist
from auvdock.core.transforms import rotation_from_quat_wxyz
from auvdock.core.vehicle import VehicleCfg
from auvdock.sim.actuation import make_actuators
from auvdock.sim.hydrodynamics import make_hull
from auvdock.sim.stepping import add_mass, wrench


def water_wrench(
    vehicle: VehicleCfg, rotation: Array, velocity: Array, water: Array, gust: Array, state: Array
) -> tuple[Array, Array]:
    """`stepping.wrench` of a vehicle: force on the free joint and advance speeds of its actuators."""
    actuators, force = make_actuators(vehicle, 1.0 / 120.0), np.empty(6)
    actuators["state"] = state
    flow = float(water[0]), float(water[1]), float(water[2])
    wrench(rotation, velocity, flow, gust, make_hull(vehicle, 1.0)[0], actuators, force)
    return force, actuators["advance_m_s"]


def skew(vector: Array) -> Array:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def coriolis_matrix(mass: Array, nu: Array) -> Array:
    """C(ν) of Fossen (2011), equation 6.43."""
    first = skew(mass[:3, :3] @ nu[:3] + mass[:3, 3:] @ nu[3:])
    second = skew(mass[3:, :3] @ nu[:3] + mass[3:, 3:] @ nu[3:])
    return np.block([[np.zeros((3, 3)), -first], [-first, -second]])


def random_rotation(rng: np.random.Generator) -> Array:
    quat = rng.standard_normal(4)
    return rotation_from_quat_wxyz(quat / np.linalg.norm(quat))


def random_nu(rng: np.random.Generator) -> Array:
    return rng.standard_normal(6) * rng.uniform(0.1, 2.0)


def damping(nu: Array) -> Array:
    return (
        REMUS.linear_damping_body @ nu
        + REMUS.quadratic_damping_body @ (np.abs(nu) * nu)
        + abs(nu[0]) * REMUS.lift_damping_body @ nu
    )


def test_wrench_is_fossens_formula_written_out() -> None:
    """Against equations 6.43, 6.53 and 4.6 as plain matrices; relative tolerance 1e-12."""
    rng = np.random.default_rng(1)
    mass = REMUS.added_mass_body
    for _ in range(200):
        rotation, nu = random_rotation(rng), random_nu(rng)
        gust, water = np.array([*rng.standard_normal(2), 0.0]), rng.standard_normal(3)
        actuators = rng.uniform(-1.0, 1.0, 7)
        fins = np.where([actuator.kind == "fin" for actuator in REMUS.actuators], nu[0] * abs(nu[0]), 1.0)
        body = damping(nu) - coriolis_matrix(mass, nu) @ nu + REMUS.thruster_wrenches_body @ (actuators * fins)
        body += mass[:, :3] @ (np.cross(nu[3:], nu[:3]) + rotation.T @ gust)
        expected = np.concatenate([rotation @ body[:3], body[3:]])
        expected[:3] += np.array([0.0, 0.0, REMUS.buoyancy_n]) + REMUS.buoyancy_n / 9.81 * gust
        velocity = np.concatenate([rotation @ nu[:3] + water, nu[3:]])
        got, advance = water_wrench(REMUS, rotation, velocity, water, gust[:2], actuators)
        np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-10)
        # Advance speed of the stern propeller is u, of the fore lateral (thrust to starboard) −(v + x r).
        np.testing.assert_allclose(advance[:2], [nu[0], -(nu[1] + 0.35 * nu[5])], atol=1e-12)


def test_hull_and_fin_coefficients_add_up_to_the_printed_ones() -> None:
    """At u = 1.54 m/s the whole model has the printed linear derivatives, within their rounding: nothing counted twice.

    Sgarioto 2006 in Hall and Anstee 2011: Y_v −66.6, Y_r 2.2, N_v −4.47, N_r −6.87; heave and pitch are their mirror.
    """
    printed = {1: {1: -66.6, 5: -4.47}, 2: {2: -66.6, 4: 4.47}, 4: {2: -2.2, 4: -6.87}, 5: {1: 2.2, 5: -6.87}}
    mass = flip_matrix(REMUS.added_mass_body)
    for axis, rows in printed.items():
        step = 1e-7
        nu = np.array([1.54, 0.0, 0.0, 0.0, 0.0, 0.0])
        nu[axis] = step
        lift = nu[0] * flip_matrix(REMUS.lift_damping_body) @ nu
        wrench = lift - coriolis_matrix(mass, nu) @ nu
        for row, value in rows.items():
            assert wrench[row] / step == pytest.approx(value, abs=0.02)


def test_coefficients_state_unit_and_source() -> None:
    groups = (REMUS.added_mass, REMUS.linear_damping, REMUS.quadratic_damping, REMUS.lift_damping)
    for group in groups:
        for item in group:
            assert item.unit
            assert "verif" not in item.source
            assert item.source.startswith(("Prestero 2001, ", "Sgarioto's horizontal set", "As ", "Our estimate: "))


def test_added_mass_does_no_work_and_damping_always_takes() -> None:
    """νᵀ C_A ν = 0 (1e-9) and νᵀ D-terms < 0 for 50,000 velocities of every direction and ratio."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        nu = random_nu(rng)
        assert abs(nu @ coriolis_matrix(REMUS.added_mass_body, nu) @ nu) < 1e-9
    nu = rng.standard_normal((50_000, 6)) * 10.0 ** rng.uniform(-3.0, 1.0, (50_000, 6))
    taken = (
        np.einsum("ni,ij,nj->n", nu, REMUS.linear_damping_body, nu)
        + np.einsum("ni,ij,nj->n", nu, REMUS.quadratic_damping_body, np.abs(nu) * nu)
        + np.abs(nu[:, 0]) * np.einsum("ni,ij,nj->n", nu, REMUS.lift_damping_body, nu)
    )
    assert np.all(taken < 0.0)


def test_mass_matrices_are_symmetric_positive_definite() -> None:
    for matrix in (REMUS.rigid_body_mass_body, REMUS.added_mass_body):
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-12)
        assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_added_mass_rows_turn_with_the_body() -> None:
    """Kinetic energy of the water is the same in the free joint's coordinates as in body axes (1e-12)."""
    rng = np.random.default_rng(3)
    added = trimmed().added_mass_body
    for _ in range(50):
        rotation, nu = random_rotation(rng), random_nu(rng)
        lower = np.zeros((6, 6))
        rows = np.zeros(21)
        add_mass(rows, rotation, added, 1.0)
        lower[np.tril_indices(6)] = rows
        mass = lower + lower.T - np.diag(np.diag(lower))
        joint = np.concatenate([rotation @ nu[:3], nu[3:]])
        assert joint @ mass @ joint == pytest.approx(nu @ REMUS.added_mass_body @ nu, rel=1e-12)


def test_mirror_image_gives_the_mirrored_wrench() -> None:
    """Port and starboard are alike: reflecting (v, p, r) and the lateral actuators reflects (Y, K, N); 1e-12."""
    rng = np.random.default_rng(4)
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    sides = np.array([-1.0 if "lateral" in name or name == "rudder" else 1.0 for name in REMUS.actuator_names])
    identity, still = np.eye(3), np.zeros(3)
    for _ in range(100):
        nu, actuators = random_nu(rng), rng.uniform(-1.0, 1.0, 7)
        left = water_wrench(REMUS, identity, nu, still, still[:2], actuators)[0]
        turned = mirror * nu
        right = water_wrench(REMUS, identity, turned, still, still[:2], sides * actuators)[0]
        np.testing.assert_allclose(mirror * left, right, atol=1e-12)


def test_lateral_thrusters_hold_a_cross_current_with_margin() -> None:
    """0.3 m/s across at 0.5 m/s ahead takes at most 1/1.3 of either lateral thruster."""
    nu = np.array([0.5, -0.3, 0.0, 0.0, 0.0, 0.0])
    load = flip_twist(damping(nu)) - flip_twist(coriolis_matrix(REMUS.added_mass_body, nu) @ nu)
    names = REMUS.actuator_names
    columns = [names.index("fore_lateral"), names.index("aft_lateral")]
    effect = flip_twist(REMUS.thruster_wrenches_body.T[columns]).T[[1, 5]]
    needed = np.linalg.solve(effect, -load[[1, 5]])
    assert np.abs(needed).max() <= 1.0 / 1.3
    assert np.abs(needed).max() > 0.3
