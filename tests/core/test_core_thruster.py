"""Measured thruster curves: Blue Robotics' figures arrive, the inverse inverts, other voltages are refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.assets import asset
from auvdock.core.errors import ConfigError
from auvdock.core.strict import load_toml
from auvdock.core.thruster import ThrusterCfg, load_curve
from auvdock.core.vehicle import load_vehicle

KGF_N = 9.80665
voltages = st.floats(10.0, 20.0)


@pytest.mark.parametrize(
    ("voltage_v", "pulse_us", "thrust_kgf", "power_w"),
    [
        (16.0, 1900.0, 5.25, 381.3),
        (16.0, 1100.0, -4.07, 388.8),
        (12.0, 1700.0, 1.28, 39.6),
        (20.0, 1300.0, -1.58, 103.2),
    ],
)
def test_published_figures_arrive(voltage_v: float, pulse_us: float, thrust_kgf: float, power_w: float) -> None:
    """Blue Robotics, T200 public performance data, rounded as they print: 5.25 kgf at 16 V and full throttle."""
    curve = load_curve("t200", voltage_v)
    command = np.array([(pulse_us - 1500.0) / 400.0])
    assert curve.effort(command)[0] * curve.reference_n == pytest.approx(thrust_kgf * KGF_N, abs=0.06)
    assert np.interp(command, curve.command, curve.power_w)[0] == pytest.approx(power_w, abs=0.1)


@given(voltage_v=voltages, command=st.floats(-1.0, 1.0))
def test_a_command_comes_back_from_its_effort(voltage_v: float, command: float) -> None:
    curve = load_curve("t200", voltage_v)
    effort = curve.effort(np.array([command]))
    low, high = curve.command[curve.thrust_n == 0.0]
    assert curve.command_for(effort)[0] == pytest.approx(0.0 if low <= command <= high else command, abs=1e-9)


@given(voltage_v=voltages, effort=st.floats(1e-6, 1.0), sense=st.sampled_from([-1.0, 1.0]))
def test_no_effort_asks_for_a_command_in_the_dead_band(voltage_v: float, effort: float, sense: float) -> None:
    curve = load_curve("t200", voltage_v)
    command = curve.command_for(np.array([sense * effort]))
    assert curve.effort(command)[0] == pytest.approx(sense * effort, rel=1e-6)
    assert abs(command[0]) > 0.059  # the narrowest edge: 1476 µs at 20 V


@given(voltage_v=voltages)
def test_between_two_voltages_thrust_lies_between_theirs(voltage_v: float) -> None:
    below, above = 2.0 * np.floor(voltage_v / 2.0), 2.0 * np.ceil(voltage_v / 2.0)
    command = np.linspace(-1.0, 1.0, 41)
    thrust = [
        curve.effort(command) * curve.reference_n
        for curve in (load_curve("t200", v) for v in (below, voltage_v, above))
    ]
    # Half a newton for nodes that shift with the dead band's edge.
    assert np.all(np.abs(thrust[1]) <= np.maximum(*np.abs([thrust[0], thrust[2]])) + 0.5)
    assert np.all(np.abs(thrust[1]) >= np.minimum(*np.abs([thrust[0], thrust[2]])) - 0.5)


@pytest.mark.parametrize("voltage_v", [9.9, 20.1])
def test_a_voltage_that_was_not_measured_is_refused(voltage_v: float) -> None:
    with pytest.raises(ConfigError, match="voltage_v"):
        load_vehicle("bluerov2_heavy", voltage_v)


def test_a_curve_that_cannot_be_inverted_is_refused() -> None:
    cfg = load_toml(ThrusterCfg, asset("thrusters", "t200"))
    supply = cfg.supplies[0]
    thrust = (*supply.thrust_n[:-1], 0.5 * supply.thrust_n[-2])
    with pytest.raises(ConfigError, match=r"supplies\[0\].thrust_n"):
        dataclasses.replace(cfg, supplies=(dataclasses.replace(supply, thrust_n=thrust),))
    with pytest.raises(ConfigError, match=r"supplies\[0\].power_w"):
        dataclasses.replace(cfg, supplies=(dataclasses.replace(supply, power_w=supply.power_w[1:]),))
