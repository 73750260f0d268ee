from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from sim_bench import (
    REMUS,
    STATION,
    coefficient,
    command,
    run,
    simulator,
    start,
    state,
    trimmed,
    undamped,
)

from auvdock.core.arrays import Array
from auvdock.core.transforms import rotation_from_quat_wxyz
from auvdock.core.vehicle import ActuatorCfg
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.simulator import Simulator


def test_sway_step_feels_exactly_the_added_mass() -> None:
    """30 kg + 30 kg in sway, yawed 90°, 61 N for 1 s from rest: v = 61/60 m/s within 1e-6."""
    push = ActuatorCfg("push", "thruster", "test", direction=(0.0, 1.0, 0.0), max_force_n=61.0, time_constant_s=1e-6)
    body = dataclasses.replace(
        undamped(trimmed(dataclasses.replace(REMUS, mass_kg=30.0)), {"Y_vdot": -30.0}),
        centre_of_gravity_m=(0.0, 0.0, 0.0),
        actuators=(push,),
    )
    sim = simulator(body)
    start(sim, euler_deg=(0.0, 0.0, 90.0))
    run(sim, 1.0, np.array([1.0]))
    velocity = sim.truth.nu_body
    # Starboard of a hull that points along +y is +x.
    np.testing.assert_allclose(velocity, [0.0, -61.0 / 60.0, 0.0, 0.0, 0.0, 0.0], atol=1e-6)
    assert sim.data.qvel[0] == pytest.approx(61.0 / 60.0, abs=1e-6)


@pytest.mark.parametrize("linear", [0.0, -3.0])
def test_terminal_surge_speed_is_the_closed_form(linear: float) -> None:
    """T = |X_uu| u² + |X_u| u, relative tolerance 1e-4."""
    vehicle = dataclasses.replace(
        trimmed(), linear_damping=(coefficient("X_u", linear),), centre_of_gravity_m=(0.0, 0.0, 0.0)
    )
    sim = simulator(vehicle)
    start(sim)
    thrust = 5.0
    run(sim, 60.0, command(sim, stern=thrust / 10.0))
    expected = (linear + math.sqrt(linear * linear + 4.0 * 1.62 * thrust)) / (2.0 * 1.62)
    assert sim.truth.nu_body[0] == pytest.approx(expected, rel=1e-4)


def test_a_trimmed_body_drifts_with_the_current() -> None:
    """Released with the water it stays with it exactly (1e-12). Released at rest over ground in 0.3 m/s, with linear
    drag besides so that the difference decays exponentially, it reaches the current's velocity within 1e-6 m/s."""
    current = CurrentCfg(speed_m_s=0.3, direction_deg=130.0)
    linear = tuple(coefficient(name, -20.0) for name in ("X_u", "Y_v", "Z_w", "K_p", "M_q", "N_r"))
    sim = simulator(dataclasses.replace(trimmed(), linear_damping=linear), current=current)
    start(sim, euler_deg=(0.0, 0.0, 40.0))
    run(sim, 10.0, command(sim))
    water = 0.3 * np.array([math.cos(math.radians(130.0)), math.sin(math.radians(130.0)), 0.0])
    np.testing.assert_allclose(sim.data.qvel[:3], water, atol=1e-12)
    np.testing.assert_allclose(sim.truth.nu_relative_body, 0.0, atol=1e-12)
    still = np.concatenate([-sim.truth.T_world_body[:3, :3].T @ water, np.zeros(3)])
    start(sim, euler_deg=(0.0, 0.0, 40.0), nu_relative=still)
    np.testing.assert_allclose(sim.data.qvel, 0.0, atol=1e-12)
    run(sim, 120.0, command(sim))
    np.testing.assert_allclose(sim.data.qvel[:3], water, atol=1e-6)


def test_a_gust_carries_a_trimmed_body_along() -> None:
    """Accelerating water moves a neutrally buoyant body with it (added mass and Froude-Krylov force): after 60 s of
    gusts the velocity through the water is within 1e-9 of zero, while that over ground varied by centimetres a second.
    """
    sim = simulator(
        dataclasses.replace(trimmed(), centre_of_gravity_m=(0.0, 0.0, 0.0)),
        current=CurrentCfg(speed_m_s=0.2, gust_std_m_s=0.05),
    )
    start(sim, seed=3)
    speeds: list[float] = []
    for _ in range(60):
        run(sim, 1.0, command(sim))
        speeds.append(float(sim.data.qvel[0]))
        assert np.abs(sim.truth.nu_relative_body).max() < 1e-9
    assert np.std(speeds) > 0.01


def energy_relative_j(sim: Simulator) -> float:
    """½ ν_rᵀ (M_RB + M_A) ν_r plus the potential energy of the low centre of gravity."""
    vehicle = sim.vehicle
    rotation, nu = rotation_from_quat_wxyz(sim.data.qpos[3:7]), sim.truth.nu_relative_body
    height = float((rotation @ vehicle.centre_of_gravity_body_m)[2]) + 0.0196
    mass = vehicle.rigid_body_mass_body + vehicle.added_mass_body
    return 0.5 * float(nu @ mass @ nu) + vehicle.mass_kg * 9.81 * height


def test_without_thrust_energy_relative_to_the_water_never_grows() -> None:
    """60 s from 50 random states in a uniform current: no growth from one second to the next beyond 1e-4 of the
    start's (the integrator's error), and most is gone at the end."""
    rng = np.random.default_rng(5)
    sim = simulator(trimmed(), current=CurrentCfg(speed_m_s=0.2, direction_deg=70.0))
    still = command(sim)
    for _ in range(50):
        nu = np.concatenate([rng.uniform(-1.5, 1.5, 3), rng.uniform(-1.0, 1.0, 3)])
        angles = rng.uniform(-180.0, 180.0, 3)
        start(sim, euler_deg=(angles[0], angles[1] / 2.0, angles[2]), nu_relative=nu)
        first = last = energy_relative_j(sim)
        for _ in range(60):
            run(sim, 1.0, still)
            now = energy_relative_j(sim)
            assert now <= last + 1e-4 * first
            last = now
        assert last < 0.1 * first


def test_heeled_hull_rights_itself_with_the_stated_moment() -> None:
    """First step's acceleration is M⁻¹ of the moment W × BG sin φ (relative 1e-9); left alone, it comes to rest."""
    sim = simulator(trimmed())
    mass = sim.vehicle.rigid_body_mass_body + sim.vehicle.added_mass_body
    moment = 30.48 * 9.81 * 0.0196
    for axis, euler in ((3, (25.0, 0.0, 30.0)), (4, (0.0, 25.0, 30.0))):
        start(sim, euler_deg=euler)
        sim.step(command(sim))
        expected = np.zeros(6)
        expected[axis] = -moment * math.sin(math.radians(25.0))
        got = np.linalg.solve(mass, expected) / 120.0
        assert sim.data.qvel[axis] == pytest.approx(got[axis], rel=1e-9)
    start(sim, euler_deg=(25.0, 10.0, 30.0))
    run(sim, 240.0, command(sim))
    assert sim.truth.T_world_body[2, 2] > math.cos(math.radians(3.0))


def test_small_roll_has_the_closed_form_period() -> None:
    """T = 2π √(I / W BG) with the roll inertia that sway coupling leaves, I = I₄₄ − I₂₄² / I₂₂; within 0.5 %."""
    sim = simulator(undamped(REMUS))
    mass = sim.vehicle.rigid_body_mass_body + sim.vehicle.added_mass_body
    inertia = mass[3, 3] - mass[1, 3] ** 2 / mass[1, 1]
    expected = 2.0 * math.pi * math.sqrt(inertia / (30.48 * 9.81 * 0.0196))
    start(sim, euler_deg=(2.0, 0.0, 0.0))
    rates: list[float] = []
    for _ in range(round(20.0 * 120.0)):
        sim.step(command(sim))
        rates.append(float(sim.data.qvel[3]))
    signs = np.flatnonzero(np.diff(np.sign(rates)) > 0)
    period = float(signs[-1] - signs[0]) / (len(signs) - 1) / 120.0
    assert period == pytest.approx(expected, rel=5e-3)


def impulse_at_the_end_stop(surge_added_kg: float) -> tuple[float, float]:
    """(impulse, change of momentum with added mass) of a head-on hit at 0.5 m/s inside the tube, N s."""
    latch = dataclasses.replace(STATION.latch, max_speed_m_s=1e-12)  # never closes
    vehicle = dataclasses.replace(undamped(REMUS, {"X_udot": -surge_added_kg}), centre_of_gravity_m=(0.0, 0.0, 0.0))
    sim = simulator(vehicle, dataclasses.replace(STATION, latch=latch))
    depth = STATION.depth_m
    start(sim, (-2.0, 0.0, -depth), (0.0, 0.0, 180.0), np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    impulse = 0.0
    for _ in range(120):
        sim.step(command(sim))
        impulse += sim.truth.contact_force_n / 120.0
    assert sim.truth.nu_body[0] < 0.0
    return impulse, (30.48 + surge_added_kg) * (0.5 - float(sim.truth.nu_body[0]))


def test_contact_impulse_is_that_of_the_effective_mass() -> None:
    """The wall's impulse equals (m + m_A) Δu within 1e-6, and doubling the effective mass doubles it within 2 %."""
    light, light_momentum = impulse_at_the_end_stop(0.0)
    heavy, heavy_momentum = impulse_at_the_end_stop(30.48)
    assert light == pytest.approx(light_momentum, rel=1e-6)
    assert heavy == pytest.approx(heavy_momentum, rel=1e-6)
    assert heavy / light == pytest.approx(2.0, rel=0.02)


def test_the_mirror_image_of_a_run_is_the_run_of_the_mirror_image() -> None:
    """20 s with all actuators moving, mirrored about the vertical plane: equal within 1e-9."""
    rng = np.random.default_rng(6)
    left, right = simulator(), simulator()
    sides = np.array([-1.0 if "lateral" in name or name == "rudder" else 1.0 for name in REMUS.actuator_names])
    nu = np.array([0.8, 0.2, -0.1, 0.1, 0.05, 0.2])
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    start(left, nu_relative=nu)
    start(right, nu_relative=mirror * nu)
    for _ in range(40):
        values = rng.uniform(-0.5, 0.5, 7)
        run(left, 0.5, values)
        run(right, 0.5, sides * values)
    flip = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(flip * state(left), state(right), atol=1e-9)


def noisy_run(sim: Simulator, seed: int, seconds: float = 3.0) -> Array:
    start(sim, seed=seed)
    values = np.array([0.5, 0.1, -0.1, 0.05, 0.0, 0.3, -0.2])
    rows: list[Array] = []
    for _ in range(round(seconds * 30.0)):
        for _ in range(4):
            sim.step(values)
        sensed = sim.proprioception()
        rows.append(np.concatenate([state(sim), sensed.euler_zyx_rad, sensed.velocity_water_m_s, [sensed.depth_m]]))
    return np.array(rows)


def test_same_seed_same_bits_whatever_came_before_and_beside() -> None:
    current = CurrentCfg(speed_m_s=0.2, gust_std_m_s=0.05, shear_per_m=0.1)
    first, second = simulator(current=current), simulator(current=current)
    reference = noisy_run(first, 11)
    other = noisy_run(first, 12)
    assert not np.array_equal(reference, other)
    assert np.array_equal(noisy_run(first, 11), reference)
    # Two simulators stepped in turn do not touch one another.
    start(first, seed=11)
    start(second, seed=99)
    values = np.array([0.5, 0.1, -0.1, 0.05, 0.0, 0.3, -0.2])
    for _ in range(40):
        first.step(values)
        second.step(-values)
    assert np.array_equal(state(first), reference[9, :13])


def test_reset_after_a_docking_or_a_divergence_is_as_good_as_new() -> None:
    used, new = simulator(REMUS, STATION), simulator(REMUS, STATION)
    start(used, (-0.3, 0.0, -8.0), (0.0, 0.0, 180.0), np.array([0.6, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run(used, 5.0, command(used, stern=0.3))
    assert used.truth.latched
    used.reset(np.array([20.0, 1.0, -7.0]), np.array([0.0, 0.0, 0.0, 1.0]), np.random.default_rng(4))
    used.data.qvel[0] = math.nan
    used.step(command(used))
    assert used.truth.diverged
    for sim in (used, new):
        start(sim, (2.0, 0.3, -8.0), (0.0, 0.0, 180.0), seed=8)
        run(sim, 6.0, command(sim, stern=0.6))
    assert np.array_equal(state(used), state(new))
    assert used.truth.peak_contact_force_n == new.truth.peak_contact_force_n > 0.0
    assert used.truth.energy_j == new.truth.energy_j
