"""Guidance laws on kinematic models."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.controllers.allocation import ThrustAllocator
from auvdock.controllers.axis_guidance import (
    Place,
    approach_speed,
    axis_course,
    axis_law,
    corridor_m,
    crab_angle,
    ilos,
)
from auvdock.controllers.guidance import GuidanceCfg, sway_reach_m_s
from auvdock.controllers.linear_model import hydrodynamic_wrench
from auvdock.controllers.modes import ModeCfg
from auvdock.controllers.steering import SearchCfg, search, search_pattern, update_sight
from auvdock.core.errors import ConfigError
from auvdock.core.vehicle import load_vehicle

CFG = GuidanceCfg()
LAW = axis_law(CFG, ModeCfg(), 1.0, 0.35, 1.0 / 30.0)
VEHICLE = load_vehicle("remus_hybrid")


def cross_track_after(sigma, current_m_s, start_m, time_s=400.0, dt_s=0.1):
    """ẏ = U sin χ + V_c: a craft that points where guidance says and is carried sideways by a current."""
    error, integral = start_m, 0.0
    for _ in range(int(time_s / dt_s)):
        angle, integral = ilos(error, integral, 2.0, sigma, dt_s)
        error += (0.5 * math.sin(angle) + current_m_s) * dt_s
    return error


@pytest.mark.parametrize("current_m_s", [-0.2, -0.1, 0.1, 0.3])
@pytest.mark.parametrize("start_m", [-3.0, 0.0, 3.0])
def test_integral_action_removes_the_error_of_a_cross_current(current_m_s, start_m):
    assert abs(cross_track_after(0.1, current_m_s, start_m)) < 0.005


def test_without_integral_action_the_error_of_theory_remains():
    """Steady state of plain LOS: U sin(atan(e/Δ)) = V_c, so e = Δ tan(asin(V_c/U))."""
    expected = 2.0 * math.tan(math.asin(0.1 / 0.5))
    assert cross_track_after(0.0, 0.1, 3.0) == pytest.approx(expected, abs=0.005)
    assert expected > 0.4


@settings(deadline=None)  # the first call may compile
@given(error=st.floats(-50, 50), integral=st.floats(-50, 50), sigma=st.floats(0, 1))
def test_course_is_bounded_and_odd(error, integral, sigma):
    angle, after = ilos(error, integral, 1.5, sigma, 0.1)
    mirrored, mirrored_after = ilos(-error, -integral, 1.5, sigma, 0.1)
    assert abs(angle) < math.pi / 2
    assert abs(after - integral) <= 0.1 * 1.0 / 2.0 / 1.5 * 1.5 * 50
    assert (mirrored, mirrored_after) == pytest.approx((-angle, -after))


def test_far_from_the_path_the_integral_hardly_grows():
    _, near = ilos(0.5, 0.0, 1.5, 0.1, 1.0)
    _, far = ilos(50.0, 0.0, 1.5, 0.1, 1.0)
    assert far < 0.2 * near


def test_speed_is_full_on_the_axis_and_falls_to_zero_off_it():
    for distance in (1.0, 3.0, 6.0, 12.0):
        width = corridor_m(distance, LAW)
        assert approach_speed(distance, 0.0, LAW) >= CFG.mid_speed_m_s
        assert approach_speed(distance, 2.0 * width, LAW) == 0.0
        assert approach_speed(distance, 1.5 * width, LAW) < approach_speed(distance, width, LAW)
    assert approach_speed(30.0, 0.0, LAW) == CFG.far_speed_m_s


@settings(deadline=None)  # the first call may compile
@given(forward=st.floats(0.05, 1.5), port=st.floats(-1.0, 1.0), reach=st.floats(0.05, 0.6))
def test_crab_brings_sway_within_reach(forward, port, reach):
    """Outside reference: rotate the wanted velocity into the crabbed hull and look at its sway."""
    angle = crab_angle(forward, port, reach, math.pi)
    sway = port * math.cos(angle) - forward * math.sin(angle)
    assert abs(sway) <= max(reach, 0.0) + 1e-9
    if abs(port) <= reach:
        assert angle == 0.0
    assert crab_angle(forward, -port, reach, math.pi) == pytest.approx(-angle)


def course(place, integrals=(0.0, 0.0), hold=False, committed=False, turn=0.0, current=(0.0, 0.0)):
    """On an axis that leads east: surge, sway, heave, heading offset, integrals."""
    distance, port, up = place
    at = Place(distance, port, up, 0.0, turn, math.hypot(port, up))
    velocity, offset, after = axis_course(
        LAW, at[:], integrals, hold, committed, CFG.lookahead_mid_m, turn, np.array([*current, 0.0])
    )
    return *velocity, offset, *after


@settings(deadline=None)  # the first call may compile
@given(
    distance=st.floats(-1.0, 12.0),
    port=st.floats(-2.0, 2.0),
    up=st.floats(-2.0, 2.0),
    turn=st.floats(-0.5, 0.5),
    across=st.floats(-0.7, 0.7),
    hold=st.booleans(),
    committed=st.booleans(),
)
def test_the_way_along_the_axis_mirrors(distance, port, up, turn, across, hold, committed):
    there = course((distance, port, up), (0.2, -0.1), hold, committed, turn, (0.1, across))
    mirrored = course((distance, -port, up), (-0.2, -0.1), hold, committed, -turn, (0.1, -across))
    surge, sway, heave, offset, port_integral, up_integral = mirrored
    assert there == pytest.approx((surge, -sway, heave, -offset, -port_integral, up_integral))


def test_speeds_along_the_axis_follow_the_stages():
    assert course((5.0, 0.0, 0.0))[:4] == (CFG.mid_speed_m_s, 0.0, 0.0, 0.0)
    assert course((0.1, 0.0, 0.0), committed=True)[0] == CFG.entry_speed_m_s
    assert course((-1.1, 0.0, 0.0), committed=True)[0] == CFG.tube_speed_m_s
    gate = ModeCfg().gate_distance_m
    assert course((gate, 0.0, 0.0), hold=True)[0] == 0.0
    assert course((gate - 0.5, 0.0, 0.0), hold=True)[0] == pytest.approx(-0.15)
    # A set-point is given at the present heading: turned to port, the way ahead is to starboard.
    surge, sway, *_ = course((5.0, 0.0, 0.0), turn=0.3)
    assert (surge, sway) == pytest.approx((0.5 * math.cos(0.3), -0.5 * math.sin(0.3)))


def test_a_cross_current_beyond_reach_raises_the_speed_and_crabs():
    surge, *_, offset, _, _ = course((2.0, 0.0, 0.0), committed=True, current=(0.0, 0.6))
    assert surge == CFG.rush_speed_m_s
    assert offset < -0.1
    assert course((2.0, 0.0, 0.0), committed=True, current=(0.0, 0.3))[3] == 0.0


def test_integrals_stand_still_off_the_corridor_and_inside_the_funnel():
    assert course((4.0, 0.1, -0.1))[4] > 0.0 > course((4.0, 0.1, -0.1))[5]
    assert course((4.0, 1.0, 0.0), (0.3, 0.2))[4:] == (0.3, 0.2)
    assert course((-0.1, 0.1, 0.0), (0.3, 0.2))[4:] == (0.3, 0.2)


def test_sway_reach_loads_the_actuators_to_the_given_share():
    allocator = ThrustAllocator(VEHICLE)
    lateral = [VEHICLE.actuator_names.index(name) for name in ("fore_lateral", "aft_lateral")]
    for surge in (0.0, 0.5, 1.0):
        reach = sway_reach_m_s(VEHICLE, allocator, surge, 1.0)
        water = hydrodynamic_wrench(VEHICLE, np.array([surge, reach, 0.0, 0.0, 0.0, 0.0]))
        command = allocator.allocate(np.array([0.0, -water[1], 0.0, 0.0, 0.0, -water[5]]), surge)
        assert np.abs(command[lateral]).max() == pytest.approx(1.0, abs=1e-3)
        assert sway_reach_m_s(VEHICLE, allocator, surge, 0.5) < reach


def test_the_vehicle_holds_the_benchmarks_cross_current_without_crab():
    assert sway_reach_m_s(VEHICLE, ThrustAllocator(VEHICLE), CFG.mid_speed_m_s, CFG.sway_share) > 0.3


def test_search_widens_returns_and_mirrors():
    cfg = SearchCfg()
    pattern = search_pattern(cfg)
    times = np.arange(0.0, pattern[0][-1], 0.05)
    port = np.array([search(t, 0.3, 8.0, 1.0, True, pattern, cfg).setpoint.heading_rad for t in times]) - 0.3
    starboard = np.array([search(t, 0.3, 8.0, -1.0, True, pattern, cfg).setpoint.heading_rad for t in times]) - 0.3
    np.testing.assert_allclose(port, -starboard)
    assert port.max() == pytest.approx(cfg.amplitudes_rad[-1], abs=0.02)
    assert port.min() == pytest.approx(-cfg.amplitudes_rad[-1], abs=0.02)
    assert np.abs(np.diff(port)).max() <= cfg.turn_rate_rad_s * 0.05 + 1e-9
    assert all(search(t, 0.0, 8.0, 1.0, True, pattern, cfg).setpoint.surge_m_s == 0.0 for t in times)
    after = search(pattern[0][-1] + 1.0, 0.3, 8.0, 1.0, True, pattern, cfg).setpoint
    assert after.surge_m_s > 0.0
    assert after.heading_rad == 0.3


def test_search_stays_in_place_when_the_place_is_known():
    cfg = SearchCfg()
    pattern = search_pattern(cfg)
    for t in np.arange(0.0, 3.0 * pattern[0][-1], 0.5):
        assert search(t, 0.0, 8.0, 1.0, False, pattern, cfg).setpoint.surge_m_s == 0.0


def test_settings_without_meaning_are_refused():
    with pytest.raises(ConfigError, match="lookahead_mid_m"):
        GuidanceCfg(lookahead_mid_m=0.0)
    with pytest.raises(ConfigError, match="amplitudes_rad"):
        SearchCfg(amplitudes_rad=())


def test_smoothed_sight_averages_noise_and_follows_across_the_date_line():
    rng, sight = np.random.default_rng(0), None
    for step in range(300):
        azimuth = math.remainder(math.pi + 0.2 * rng.standard_normal(), math.tau)
        sight = update_sight(sight, step / 30.0, azimuth, 0.1, None, 0.08)
    assert sight is not None
    assert abs(math.remainder(sight.azimuth_rad - math.pi, math.tau)) < 0.12
    assert sight.elevation_rad == pytest.approx(0.1)
    assert sight.frames == 300


def test_a_range_that_never_was_great_is_not_trusted():
    """Particles before the lens look like a group two metres off for ever; a station comes nearer from afar."""
    rng = np.random.default_rng(1)
    snow = station = None
    for step in range(600):
        noise = math.exp(0.4 * rng.standard_normal())
        snow = update_sight(snow, step / 30.0, 0.0, 0.0, 2.2 * noise, 0.08)
        station = update_sight(station, step / 30.0, 0.0, 0.0, max(2.0, 12.0 - step / 40.0) * noise, 0.08)
    assert snow is not None
    assert station is not None
    assert snow.trusted_range_m(3.0) is None
    assert station.trusted_range_m(3.0) == pytest.approx(2.2, abs=0.8)
