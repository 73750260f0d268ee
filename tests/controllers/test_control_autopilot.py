"""Step responses of the closed loop on the nonlinear vehicle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from control_bench import DT_S, VEHICLE, Boat

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.autopilot import Autopilot, AutopilotCfg, AutopilotSetpoint, AutopilotState
from auvdock.controllers.control_law import LoopMemory
from auvdock.controllers.linear_model import hydrodynamic_wrench
from auvdock.core.contracts import Proprioception

AUTOPILOT = Autopilot(VEHICLE, AutopilotCfg(), DT_S)
ALLOCATOR = ThrustAllocator(VEHICLE)


def fly(setpoint, time_s, current_m_s=0.0, direction_deg=0.0):
    boat, state = Boat(0.0, current_m_s, direction_deg), AUTOPILOT.initial_state()
    history = []
    for _ in range(round(time_s / DT_S)):
        senses = boat.senses()
        wrench, state = AUTOPILOT.step(state, setpoint, senses)
        values, achieved = ALLOCATOR.solve(wrench, float(senses.velocity_water_m_s[0]))
        state = AUTOPILOT.settle(state, wrench, achieved)
        boat.step(values)
        after = boat.senses()
        history.append([*after.velocity_ground_m_s, after.depth_m, *after.euler_zyx_rad, *after.velocity_water_m_s])
    return np.array(history)


LEVEL = AutopilotSetpoint(0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("setpoint", "column", "target", "settle_s", "tolerance"),
    [
        (LEVEL._replace(surge_m_s=0.5), 0, 0.5, 8.0, 0.02),
        (LEVEL._replace(surge_m_s=1.0), 0, 1.0, 10.0, 0.04),
        (LEVEL._replace(sway_m_s=0.2), 1, 0.2, 6.0, 0.02),
        (LEVEL._replace(heave_m_s=-0.2), 2, -0.2, 6.0, 0.02),
        (LEVEL._replace(depth_m=9.5), 3, 9.5, 25.0, 0.05),
        (LEVEL._replace(pitch_rad=0.15), 5, 0.15, 12.0, 0.02),
        (LEVEL._replace(heading_rad=1.0), 6, 1.0, 15.0, 0.03),
        (LEVEL._replace(heading_rad=-0.3, surge_m_s=0.5), 6, -0.3, 12.0, 0.02),
    ],
)
def test_steps_settle_without_great_overshoot(setpoint, column, target, settle_s, tolerance):
    values = fly(setpoint, settle_s + 10.0)[:, column]
    start = 8.0 if column == 3 else 0.0
    assert np.abs(values[round(settle_s / DT_S) :] - target).max() < tolerance
    overshoot = (values - target) * math.copysign(1.0, target - start)
    assert overshoot.max() < 0.3 * abs(target - start)


@pytest.mark.parametrize("direction_deg", [0.0, 60.0, 90.0, 200.0])
def test_speed_over_ground_is_kept_in_a_current(direction_deg):
    history = fly(LEVEL._replace(surge_m_s=0.4), 30.0, 0.3, direction_deg)
    np.testing.assert_allclose(history[-150:, :2].mean(axis=0), [0.4, 0.0], atol=0.01)
    np.testing.assert_allclose(history[-150:, 6].mean(), 0.0, atol=0.02)


def test_speed_through_water_ignores_the_current():
    history = fly(LEVEL._replace(surge_m_s=0.5, through_water=True), 30.0, 0.2, 30.0)
    np.testing.assert_allclose(history[-100:, 7:9].mean(axis=0), [0.5, 0.0], atol=0.01)


def test_mirrored_set_points_give_mirrored_wrenches():
    boat = Boat()
    plus, _ = AUTOPILOT.step(AUTOPILOT.initial_state(), AutopilotSetpoint(0.3, 0.1, 0.0, 0.0, 0.4), boat.senses())
    minus, _ = AUTOPILOT.step(AUTOPILOT.initial_state(), AutopilotSetpoint(0.3, -0.1, 0.0, 0.0, -0.4), boat.senses())
    np.testing.assert_allclose(plus * np.array([1, -1, 1, -1, 1, -1]), minus, atol=1e-12)


def test_impossible_demands_do_not_wind_up():
    """A minute of asking for 3 m/s sideways; the integral must not outlive the demand."""
    boat, state = Boat(), AUTOPILOT.initial_state()
    for step in range(round(75.0 / DT_S)):
        setpoint = LEVEL._replace(sway_m_s=3.0 if step * DT_S < 60.0 else 0.0)
        senses = boat.senses()
        wrench, state = AUTOPILOT.step(state, setpoint, senses)
        values, achieved = ALLOCATOR.solve(wrench, float(senses.velocity_water_m_s[0]))
        state = AUTOPILOT.settle(state, wrench, achieved)
        boat.step(values)
    assert abs(float(boat.senses().velocity_ground_m_s[1])) < 0.02


@pytest.mark.parametrize("velocity", [(0.5, 0.0, 0.0), (0.4, 0.1, -0.05), (-0.3, -0.1, 0.1)])
def test_feed_forward_balances_the_water_at_a_steady_speed(velocity):
    """Outside reference: the drag, lift and Munk moment of the linear model; the net weight acts along heave."""
    still, speed = np.zeros(3), np.array(velocity)
    state = AutopilotState(LoopMemory(speed, still, np.zeros(6), sampled=True).packed())
    setpoint = AutopilotSetpoint(velocity[0], velocity[1], velocity[2], 0.0, 0.0)
    wrench, after = AUTOPILOT.step(state, setpoint, Proprioception(0.0, 8.0, still, still, speed, speed))
    expected = -hydrodynamic_wrench(VEHICLE, np.array([*velocity, 0.0, 0.0, 0.0]))
    expected[2] += VEHICLE.mass_kg * 9.81 - VEHICLE.buoyancy_n
    rows = [0, 1, 2, 4, 5]
    np.testing.assert_allclose(wrench[rows], expected[rows], atol=1e-9)
    assert after.references_m_s == pytest.approx(velocity)
    assert after.current_m_s.tolist() == [0.0, 0.0, 0.0]
    assert AUTOPILOT.initial_state().current_m_s.tolist() == [0.0, 0.0, 0.0]
