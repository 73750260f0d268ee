"""Autopilot and allocation of vehicles that hover: margins, reach of vectored thrusters, station keeping."""

from __future__ import annotations

import dataclasses
from functools import reduce
from typing import Any

import control as python_control
import numpy as np
import pytest
from hover_bench import DT_S, VEHICLES, Hoverer
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.autopilot import Autopilot, AutopilotSetpoint
from auvdock.controllers.gains import design_gains, loop_margins, plant_transfer, rolls
from auvdock.controllers.landing.config import HoverAllocationCfg, HoverAutopilotCfg, HoverDesignCfg
from auvdock.controllers.linear_model import axis_plants, linearise
from auvdock.sim.sensors import SensorCfg

# python-control ships no usable types.
control: Any = python_control
ROWS = {"surge": 0, "sway": 1, "heave": 2, "roll": 3, "pitch": 4, "heading": 5}
GAINS = {name: design_gains(vehicle, HoverDesignCfg(), DT_S) for name, vehicle in VEHICLES.items()}
PUBLISHED = VEHICLES["bluerov2_heavy"]
ROV = dataclasses.replace(
    PUBLISHED,
    actuators=tuple(dataclasses.replace(actuator, curve="", max_force_n=30.0) for actuator in PUBLISHED.actuators),
)
"""With thrust proportional to the command."""
ALLOCATOR = ThrustAllocator(ROV)


def pid_transfer(gains):
    return control.tf([gains.kd, gains.kp, gains.ki], [1.0, 0.0])


def axes_of(name):
    return [axis for axis in ROWS if axis in GAINS[name].loops]


def test_only_the_vehicle_whose_thrusters_act_on_roll_controls_it():
    assert {name: rolls(vehicle) for name, vehicle in VEHICLES.items()} == {
        "bluerov2_heavy": True,
        "remus_hybrid": False,
    }
    assert [len(axes_of(name)) for name in VEHICLES] == [6, 5]


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("surge_m_s", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("slip_m_s", [0.0, 0.3])
def test_margins_hold_in_still_water_and_in_a_current(name, surge_m_s, slip_m_s):
    """Gain margin of 6 dB and phase margin of 45° for each loop away from its design point as well."""
    plants = axis_plants(VEHICLES[name], surge_m_s, slip_m_s)
    for axis in axes_of(name):
        loop = pid_transfer(GAINS[name].loops[axis].gains) * plant_transfer(plants[axis], 1.5 * DT_S)
        gain_db, phase_deg, _ = loop_margins(loop)
        assert gain_db >= 6.0, axis
        assert phase_deg >= 45.0, axis


@pytest.mark.parametrize("name", VEHICLES)
def test_all_loops_closed_on_the_coupled_vehicle_are_stable(name):
    """The loops were designed one by one; a centre of gravity off the origin and the Munk moment couple them."""
    vehicle, axes = VEHICLES[name], axes_of(name)
    a, b = linearise(vehicle, np.array([0.2, 0.2, 0.0, 0.0, 0.0, 0.0]))
    rows = [ROWS[axis] for axis in axes]
    outputs = np.zeros((len(axes), 9))
    for index, axis in enumerate(axes):
        outputs[index, ROWS[axis] + 3 if axis in ("roll", "pitch", "heading") else ROWS[axis]] = 1.0
    plant: Any = control.ss(a, b[:, rows], outputs, np.zeros((len(axes), len(axes))))
    lag: Any = control.tf([1.0], [vehicle.actuators[0].time_constant_s, 1.0])
    delay: Any = control.tf(*control.pade(1.5 * DT_S, 2))
    channels: list[Any] = [
        control.ss(pid_transfer(GAINS[name].loops[axis].gains) * control.tf([1.0], [0.005, 1.0]) * lag * delay)
        for axis in axes
    ]
    closed: Any = control.feedback(plant * reduce(control.append, channels), control.ss([], [], [], np.eye(len(axes))))
    assert max(closed.poles().real) < -0.005


commands = st.lists(st.floats(-1.0, 1.0), min_size=8, max_size=8).map(np.array)
wrenches = st.tuples(*[st.floats(-bound, bound) for bound in (150.0, 150.0, 200.0, 30.0, 30.0, 40.0)]).map(np.array)


@given(command=commands)
@settings(max_examples=100, deadline=None)
def test_every_feasible_wrench_of_vectored_thrusters_is_reproduced(command):
    wrench = ROV.thruster_wrenches_body @ command
    given_command, achieved = ALLOCATOR.solve(wrench, 0.0)
    assert np.abs(given_command).max() <= 1.0
    np.testing.assert_allclose(ROV.thruster_wrenches_body @ given_command, wrench, atol=1e-6)
    np.testing.assert_allclose(achieved, wrench, atol=1e-6)


@given(wrench=wrenches)
@settings(max_examples=60, deadline=None)
def test_beyond_reach_the_wrench_keeps_its_direction_and_its_greatest_length(wrench):
    """Outside reference: the greatest λ with B c = λ τ and |c| <= 1, by SciPy's linear programming."""
    command = ALLOCATOR.allocate(wrench, 0.0)
    assert np.abs(command).max() <= 1.0
    best = linprog(
        [0.0] * 8 + [-1.0],
        A_eq=np.hstack([ROV.thruster_wrenches_body, -wrench[:, None]]),
        b_eq=np.zeros(6),
        bounds=[(-1.0, 1.0)] * 8 + [(0.0, 1.0)],
    )
    np.testing.assert_allclose(ROV.thruster_wrenches_body @ command, best.x[-1] * wrench, atol=0.01)


@given(wrench=wrenches)
@settings(max_examples=60, deadline=None)
def test_moments_first_keeps_attitude_and_gives_forces_in_their_direction(wrench):
    wrench = wrench * np.array([1.0, 1.0, 1.0, 0.2, 0.2, 0.2])
    achieved = ROV.thruster_wrenches_body @ ALLOCATOR.solve(wrench, 0.0, moments_first=True)[0]
    np.testing.assert_allclose(achieved[3:], wrench[3:], atol=1e-6)
    size = float(wrench[:3] @ wrench[:3])
    if size > 1.0:
        share = float(achieved[:3] @ wrench[:3]) / size
        assert -1e-9 <= share <= 1.0 + 1e-9
        np.testing.assert_allclose(achieved[:3], share * wrench[:3], atol=1e-5)


@given(command=commands)
@settings(max_examples=60, deadline=None)
def test_measured_curves_are_inverted(command):
    """The T200's thrust at the commands is the wrench that was asked for, however weak."""
    wrench = PUBLISHED.thruster_wrenches_body @ command
    given_command, achieved = ThrustAllocator(PUBLISHED).solve(wrench, 0.0)
    assert np.abs(given_command).max() <= 1.0
    np.testing.assert_allclose(PUBLISHED.thruster_wrenches_body @ PUBLISHED.efforts(given_command), wrench, atol=1e-6)
    np.testing.assert_allclose(achieved, wrench, atol=1e-6)


def test_preload_changes_no_wrench_and_lifts_weak_ones_out_of_the_dead_band():
    """The dead band of 0.4 N swallows a pull of 0.5 N; with the preload it arrives (heave: against the buoyancy)."""
    banded = dataclasses.replace(
        ROV, actuators=tuple(dataclasses.replace(actuator, dead_band=0.0133) for actuator in ROV.actuators)
    )
    plain, loaded = ThrustAllocator(banded), ThrustAllocator(banded, HoverAllocationCfg())
    for wrench in np.array([[0.5, 0.0, -2.3, 0.0, 0.0, 0.0], [0.3, 0.6, -2.3, 0.0, 0.0, 0.05]]):
        given_wrench = banded.thruster_wrenches_body @ loaded.allocate(wrench, 0.0)
        np.testing.assert_allclose(given_wrench, wrench, atol=1e-6)
    assert not plain.allocate(np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]), 0.0)[:4].any()
    big = np.array([84.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert np.abs(loaded.allocate(big, 0.0)).max() <= 1.0
    torpedo = VEHICLES["remus_hybrid"]
    np.testing.assert_array_equal(
        ThrustAllocator(torpedo, HoverAllocationCfg()).allocate(np.full(6, 0.5), 0.3),
        ThrustAllocator(torpedo).allocate(np.full(6, 0.5), 0.3),
    )


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("direction_deg", [0.0, 45.0, 250.0])
def test_station_is_kept_in_a_current_from_any_side(name, direction_deg):
    """0.3 m/s of current, real sensors, P control of position above the autopilot: 3 cm, 1.5° and level after 20 s."""
    pilot = Autopilot(VEHICLES[name], HoverAutopilotCfg(), DT_S)
    allocator = ThrustAllocator(VEHICLES[name], HoverAllocationCfg())
    boat, state = Hoverer(name, 0.0, 0.3, direction_deg, SensorCfg(), 3), None
    start = boat.T_world_body[:3, 3].copy()
    state = pilot.initial_state()
    errors: list[list[float]] = []
    for _ in range(round(30.0 / DT_S)):
        senses, T = boat.senses(), boat.T_world_body
        off = start - T[:3, 3]
        vx, vy, vz = np.clip(0.4 * off, -0.3, 0.3).tolist()
        wrench, state = pilot.step(state, AutopilotSetpoint(vx, vy, vz, 0.0, 0.0), senses)
        values, achieved = allocator.solve(wrench, float(senses.velocity_water_m_s[0]), moments_first=True)
        state = pilot.settle(state, wrench, achieved)
        boat.step(values)
        errors.append([float(np.linalg.norm(off)), *np.degrees([T[1, 0], T[2, 0], T[2, 1]]).tolist()])
    settled = np.abs(np.array(errors)[round(20.0 / DT_S) :]).max(axis=0)
    assert settled[0] < 0.03
    assert settled[1:].max() < 1.5
    assert max(error[0] for error in errors) < 0.3


def test_upset_vehicle_rights_itself_and_a_torpedo_has_no_roll_loop():
    assert len(Autopilot(VEHICLES["remus_hybrid"], HoverAutopilotCfg(), DT_S).limits) == 5
    pilot = Autopilot(PUBLISHED, HoverAutopilotCfg(), DT_S)
    boat, state = Hoverer("bluerov2_heavy"), pilot.initial_state()
    allocator = ThrustAllocator(PUBLISHED, HoverAllocationCfg())
    boat.tilt(0.3, -0.3)
    for _ in range(round(12.0 / DT_S)):
        wrench, state = pilot.step(state, AutopilotSetpoint(0.0, 0.0, 0.0, 0.0, 0.0), boat.senses())
        boat.step(allocator.allocate(wrench, 0.0))
    assert np.abs(boat.T_world_body[2, :2]).max() < 0.01
