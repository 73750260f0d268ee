from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sim_bench import REMUS, command, run, simulator, start, state, trimmed

from auvdock.core.arrays import Array
from auvdock.core.vehicle import load_vehicle
from auvdock.numeric.records import Records
from auvdock.sim.actuation import Actuator, make_actuators
from auvdock.sim.stepping import electrical_power_w, hydraulic_power_w, respond


def make(dt_s: float = 1.0 / 120.0) -> Records[Actuator]:
    return make_actuators(REMUS, dt_s)


def step(actuators: Records[Actuator], command: Sequence[float] | Array) -> Array:
    actuators["command"] = command
    respond(actuators)
    return actuators["state"]


def power_w(actuators: Records[Actuator], speeds_m_s: float | Array) -> float:
    actuators["advance_m_s"] = speeds_m_s
    return hydraulic_power_w(actuators)


def test_step_response_is_the_exponential() -> None:
    """1 − e^(−t/τ) at every step, 1e-12."""
    actuators = make()
    for index in range(1, 61):
        state = step(actuators, [1.0] * 7)
        expected = [1.0 - math.exp(-index / 120.0 / actuator.time_constant_s) for actuator in REMUS.actuators]
        np.testing.assert_allclose(state, expected, atol=1e-12)


def test_lag_does_not_depend_on_the_step() -> None:
    coarse, fine = make(0.1), make(0.01)
    step(coarse, [0.7] * 7)
    for _ in range(10):
        step(fine, [0.7] * 7)
    np.testing.assert_allclose(coarse["state"], fine["state"], atol=1e-12)


def test_dead_band_and_saturation() -> None:
    actuators = make(100.0)
    assert step(actuators, [0.019, -0.019, 0.0, 0.0, 0.0, 0.019, 0.0])[:2].tolist() == [0.0, 0.0]
    # Fins have no dead band.
    assert actuators["state"][5] == pytest.approx(0.019)
    assert step(actuators, [5.0, -5.0, 0.021, math.inf, -math.inf, 9.0, -9.0]) == pytest.approx(
        [1.0, -1.0, 0.021, 1.0, -1.0, 1.0, -1.0]
    )


@settings(deadline=None)  # the first call may compile
@given(st.lists(st.lists(st.floats(-1e9, 1e9), min_size=7, max_size=7), min_size=1, max_size=30))
def test_state_never_leaves_its_range(commands: list[list[float]]) -> None:
    actuators = make(0.05)
    for values in commands:
        assert all(-1.0 <= value <= 1.0 for value in step(actuators, values))


@pytest.mark.parametrize("values", [[0.0] * 6, [0.0] * 8, [0.0] * 6 + [math.nan]])
def test_wrong_commands_are_refused_and_move_nothing(values: list[float]) -> None:
    sim = simulator()
    start(sim)
    before = state(sim)
    with pytest.raises(ValueError, match="command"):
        sim.step(values, 4)
    np.testing.assert_array_equal(state(sim), before)
    assert sim.time_s == 0.0


def test_power_of_a_hovering_thruster_is_that_of_an_actuator_disc() -> None:
    """P = T^1.5 / √(2 ρ A) at rest; T V in the limit of fast advance and little thrust (within 1 %)."""
    actuators = make(100.0)
    step(actuators, [1.0] + [0.0] * 6)
    area = 0.25 * math.pi * 0.14**2
    assert power_w(actuators, 0.0) == pytest.approx(10.0**1.5 / math.sqrt(2.0 * 1025.0 * area), rel=1e-9)
    step(actuators, [0.02] + [0.0] * 6)
    assert power_w(actuators, 3.0) == pytest.approx(0.2 * 3.0, rel=0.01)
    step(actuators, [0.0] * 7)
    assert power_w(actuators, 3.0) == 0.0


def test_power_is_never_negative() -> None:
    rng = np.random.default_rng(0)
    actuators = make(100.0)
    for _ in range(500):
        step(actuators, rng.uniform(-1.0, 1.0, 7))
        assert power_w(actuators, rng.uniform(-3.0, 3.0, 7)) >= 0.0


@given(st.lists(st.floats(-1.2, 1.2), min_size=8, max_size=8))
@settings(deadline=None, max_examples=50)
def test_measured_thrusters_settle_at_their_curve(commands: list[float]) -> None:
    """After a long step at the effort, thrust and power that NumPy's interpolation gives."""
    rov = load_vehicle("bluerov2_heavy")
    actuators = make_actuators(rov, 100.0)
    bounded = np.clip(commands, -1.0, 1.0)
    np.testing.assert_allclose(step(actuators, commands), rov.efforts(bounded), atol=1e-12)
    curve = rov.curve(rov.actuators[0])
    assert curve is not None
    expected = np.interp(bounded, curve.command, curve.power_w).sum()
    assert electrical_power_w(actuators) == pytest.approx(expected, rel=1e-12)


def test_electrical_work_is_told_where_it_was_measured() -> None:
    """One second of one thruster at 1700 µs and 16 V: 73.3 W (Blue Robotics); the torpedo's was not measured."""
    sim = simulator(load_vehicle("bluerov2_heavy", 16.0))
    start(sim)
    run(sim, 1.0, command(sim, fore_port=0.5))
    assert sim.truth.electrical_j == pytest.approx(73.3, rel=0.002)
    assert simulator().truth.electrical_j is None


def test_fin_turns_the_hull_the_way_it_stands_and_not_at_rest() -> None:
    """A positive rudder angle gives a positive marine Y and a negative N (Prestero 2001): nose to port."""
    sim = simulator(trimmed())
    start(sim)
    run(sim, 2.0, command(sim, rudder=1.0))
    assert abs(sim.truth.nu_body[5]) < 1e-9
    start(sim, nu_relative=np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run(sim, 1.0, command(sim, rudder=1.0))
    assert sim.truth.nu_body[5] > 0.05
    start(sim, nu_relative=np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run(sim, 1.0, command(sim, elevator=1.0))
    # Negative marine M is nose down; about this package's y (port) that is a positive rate.
    assert sim.truth.nu_body[4] > 0.05
