"""Gains: margins at the design point and elsewhere, and the linear model behind them."""

from __future__ import annotations

import math
from functools import reduce
from typing import Any

import control as python_control
import numpy as np
import pytest

from auvdock.controllers.gains import DesignCfg, cascade_design, design_gains, loop_margins, plant_transfer
from auvdock.controllers.linear_model import AXES, acceleration, axis_plants, hydrodynamic_wrench, linearise
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import load_vehicle

# python-control ships no usable types.
control: Any = python_control
VEHICLE = load_vehicle("remus_hybrid")
DT_S = 1.0 / 30.0
CFG = DesignCfg()
GAINS = design_gains(VEHICLE, CFG, DT_S)
ROWS = {"surge": 0, "sway": 1, "heave": 2, "pitch": 4, "heading": 5}


def pid_transfer(axis: str):
    gains = GAINS.loops[axis].gains
    return control.tf([gains.kd, gains.kp, gains.ki], [1.0, 0.0])


@pytest.mark.parametrize("axis", [*AXES, "depth"])
def test_design_margins(axis):
    loop = GAINS.loops[axis]
    assert loop.gain_margin_db >= 6.0
    assert loop.phase_margin_deg >= 45.0
    assert loop.crossover_rad_s == pytest.approx(getattr(CFG, f"{axis}_crossover_rad_s"), rel=1e-3)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("surge_m_s", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("slip_m_s", [0.0, 0.3])
def test_margins_hold_over_speed_and_slip(axis, surge_m_s, slip_m_s):
    plant = axis_plants(VEHICLE, surge_m_s, slip_m_s)[axis]
    gain_db, phase_deg, _ = loop_margins(pid_transfer(axis) * plant_transfer(plant, 1.5 * DT_S))
    assert gain_db >= 6.0
    assert phase_deg >= 45.0


@pytest.mark.parametrize("surge_m_s", [0.0, 0.5, 1.0])
def test_all_loops_closed_on_the_coupled_vehicle_are_stable(surge_m_s):
    """The loops were designed one by one; sway and yaw, heave and pitch are coupled by the Munk moment."""
    a, b = linearise(VEHICLE, np.array([surge_m_s, 0.0, 0.0, 0.0, 0.0, 0.0]))
    rows = [ROWS[axis] for axis in AXES]
    outputs = np.zeros((5, 9))
    for index, (axis, row) in enumerate(ROWS.items()):
        outputs[index, row + 3 if axis in ("pitch", "heading") else row] = 1.0
    plant: Any = control.ss(a, b[:, rows], outputs, np.zeros((5, 5)))
    lag: Any = control.tf([1.0], [VEHICLE.actuators[0].time_constant_s, 1.0])
    delay: Any = control.tf(*control.pade(1.5 * DT_S, 2))
    # A pole far out makes the derivative proper; it costs half a degree at crossover.
    channels: list[Any] = [
        control.ss(pid_transfer(axis) * control.tf([1.0], [0.005, 1.0]) * lag * delay) for axis in AXES
    ]
    loop: Any = plant * reduce(control.append, channels)
    identity: Any = control.ss([], [], [], np.eye(5))
    closed: Any = control.feedback(loop, identity)
    poles = closed.poles()
    # Yaw integrates into nothing but the heading: no pole may stay at the origin once the loop is closed.
    assert max(poles.real) < -0.005


def test_pi_gains_satisfy_the_magnitude_and_phase_conditions():
    """Independent of the design code: |L| = 1 and arg L = PM − 180° at crossover, plant written out by hand."""
    plant = axis_plants(VEHICLE, CFG.surge_m_s)["surge"]
    s = 1j * CFG.surge_crossover_rad_s
    gains = GAINS.surge.gains
    response = (
        (gains.kp + gains.ki / s)
        / (plant.inertia * s + plant.damping)
        / (plant.lag_s * s + 1.0)
        * np.exp(-s * 1.5 * DT_S)
    )
    assert abs(response) == pytest.approx(1.0, abs=1e-4)
    assert math.degrees(np.angle(response)) == pytest.approx(CFG.velocity_margin_deg - 180.0, abs=0.05)


def test_pitch_stiffness_is_weight_times_metacentric_arm():
    plant = axis_plants(VEHICLE, 0.5)["pitch"]
    assert plant.stiffness == pytest.approx(VEHICLE.mass_kg * 9.81 * VEHICLE.centre_of_gravity_m[2])
    assert axis_plants(VEHICLE, 0.5)["heading"].stiffness == 0.0


def test_coriolis_does_no_work():
    """ν · C ν = 0: what the water does on a body without drag is only to turn its momentum."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        nu = rng.normal(size=6)
        drag = (
            VEHICLE.linear_damping_body @ nu
            + VEHICLE.quadratic_damping_body @ (np.abs(nu) * nu)
            + abs(nu[0]) * VEHICLE.lift_damping_body @ nu
        )
        assert float(nu @ (hydrodynamic_wrench(VEHICLE, nu) - drag)) == pytest.approx(0.0, abs=1e-9)


def test_munk_moment_turns_the_hull_broadside():
    """A slender body that slips to port while going ahead is turned to starboard, away from the flow's direction."""
    straight = hydrodynamic_wrench(VEHICLE, np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    slipping = hydrodynamic_wrench(VEHICLE, np.array([1.0, 0.2, 0.0, 0.0, 0.0, 0.0]))
    assert straight[5] == pytest.approx(0.0, abs=1e-9)
    assert slipping[5] < 0.0


def test_acceleration_in_still_water_at_rest_is_buoyancy_only():
    nu_dot = acceleration(VEHICLE, np.zeros(6), 0.0, 0.0, np.zeros(6))
    net = VEHICLE.buoyancy_n - VEHICLE.mass_kg * 9.81
    assert nu_dot[2] == pytest.approx(net / 65.98, rel=0.02)
    assert abs(nu_dot[[1, 3, 5]]).max() < 1e-9


@pytest.mark.parametrize(
    ("field", "value"),
    [("heading_crossover_rad_s", 9.0), ("surge_crossover_rad_s", 9.9)],
)
def test_impossible_designs_are_refused_by_name(field, value):
    with pytest.raises(ConfigError) as caught:
        design_gains(VEHICLE, DesignCfg(**{field: value}), DT_S)
    assert caught.value.field == field


def test_depth_loop_as_fast_as_heave_is_refused():
    cfg = DesignCfg(depth_crossover_rad_s=3.0)
    with pytest.raises(ConfigError, match="depth_crossover"):
        cascade_design(GAINS.heave, axis_plants(VEHICLE, 0.5)["heave"], 1.5 * DT_S, cfg)
