"""The rotating beacon's pilot: from any side to the latch, never near the station's flanks, pure and finite."""

import copy
import dataclasses
import math

import numpy as np
import pytest
from control_bench import CAMERA, DT_S, STATION, VEHICLE, look
from hypothesis import given, settings
from hypothesis import strategies as st
from rotating_bench import PILOT, boat_at, fly_round

from auvdock.controllers.modes import MODES
from auvdock.controllers.pilot import ControlCfg
from auvdock.controllers.rotating.modes import (
    APPROACH,
    CIRCLE,
    LINEUP,
    ROTATING_MODES,
    RotatingFacts,
    RotatingModeCfg,
    next_rotating_mode,
)
from auvdock.controllers.rotating.pilot import RotatingPilot
from auvdock.controllers.rotating.steering import LookAroundCfg, look_around
from auvdock.core.contracts import AzimuthFix, Bearing, Detections, Percept, Proprioception

KEEP_OFF_M = 8.0
"""From the station's body, as long as the vehicle is not before the mouth."""


def clearance_m(camera_m):
    """From the body (funnel of 1 m radius about x in [-2.7, 0]); infinite within 20° of the axis before the mouth."""
    x, y = float(camera_m[0]), float(camera_m[1])
    if x > 0.0 and abs(math.atan2(y, x)) < math.radians(20.0):
        return math.inf
    return math.hypot(max(-2.7 - x, 0.0, x), max(abs(y) - 1.0, 0.0))


def flight(boat, time_s=320.0, until="docked", **options):
    """Modes in their order, and the least clearance while the rotating beacon leads."""
    modes, least = [], math.inf
    for command, _, camera_m in fly_round(boat, time_s, **options):
        if not modes or modes[-1] != command.mode:
            modes.append(command.mode)
        if command.mode in ROTATING_MODES:
            least = min(least, clearance_m(camera_m))
        if command.mode == until != "docked":
            break
    return modes, least


@pytest.mark.parametrize(
    ("azimuth_deg", "range_m", "yaw_deg", "current_m_s", "direction_deg", "datum_rad", "until"),
    [
        (177.0, 22.0, 0.0, 0.0, 0.0, 2.0, "mid"),
        (-120.0, 30.0, 90.0, 0.3, 200.0, -1.0, "docked"),
        (40.0, 22.0, 230.0, 0.3, 300.0, 3.1, "mid"),
    ],
)
def test_docks_from_any_side_and_keeps_off(azimuth_deg, range_m, yaw_deg, current_m_s, direction_deg, datum_rad, until):
    boat = boat_at(azimuth_deg, range_m, yaw_deg, current_m_s, direction_deg)
    modes, least = flight(boat, datum_rad=datum_rad, until=until)
    assert modes[:3] == ["acquire", APPROACH, CIRCLE]
    assert modes[-1] == until
    assert boat.simulator.truth.docked is (until == "docked")
    assert least > KEEP_OFF_M


def test_goes_around_on_the_shorter_side():
    for azimuth_deg, sign in ((150.0, 1.0), (-150.0, -1.0)):
        boat = boat_at(azimuth_deg, 20.0, azimuth_deg + 180.0)
        ys = [camera_m[1] for command, _, camera_m in fly_round(boat, 30.0) if command.mode == CIRCLE]
        assert len(ys) > 200
        assert min(sign * y for y in ys) > 5.0
        assert sign * ys[-1] > sign * ys[0]  # outwards on the side on which it is


def test_searches_again_after_a_blackout():
    """Half of all fixes are lost, and for 40 s on the way around all are."""
    rng = np.random.default_rng(0)

    def spoil(percept, time_s):
        lost = 22.0 < time_s < 62.0 or rng.random() < 0.5
        return dataclasses.replace(percept, azimuth=None) if lost else percept

    boat = boat_at(-110.0, 34.0, 70.0, 0.1, 30.0)
    modes, least = flight(boat, 400.0, spoil=spoil, datum_rad=1.0, until="mid")
    assert modes[-1] == "mid"
    assert modes[modes.index(CIRCLE) :].count("acquire") >= 1
    assert least > KEEP_OFF_M


def test_a_clock_that_is_50_ms_off_turns_the_axis_by_9_degrees_and_no_more():
    boat = boat_at(5.0, 26.0, 185.0, 0.1, 0.0)
    errors = []
    for command, state, camera_m in fly_round(boat, 60.0, clock_s=0.05):
        if command.mode == "mid":
            break
        if state.beacon is not None:
            true = math.atan2(camera_m[1], camera_m[0] + 0.3)
            errors.append(math.degrees(math.remainder(state.beacon.azimuth_rad - true, math.tau)))
    assert command.mode == "mid"
    assert np.median(errors) == pytest.approx(9.0, abs=1.5)


def test_searching_where_the_beacon_was_believed_leads_away_from_it_first():
    cfg = LookAroundCfg()
    turned_s = cfg.believed_s + math.tau / cfg.turn_rate_rad_s + 1.0
    leg = look_around(turned_s, 0.4, 8.0, 1.0, True, cfg).setpoint
    assert leg.surge_m_s == cfg.leg_speed_m_s
    assert math.cos(leg.heading_rad - 0.4) == pytest.approx(-1.0)
    unknown = look_around(cfg.settle_s + math.tau / cfg.turn_rate_rad_s + 1.0, 0.4, 8.0, 1.0, False, cfg).setpoint
    assert unknown.heading_rad == pytest.approx(0.4)
    first = look_around(cfg.settle_s + 1.0, 0.4, 8.0, -1.0, False, cfg).setpoint
    assert first.turn_rad_s == -cfg.turn_rate_rad_s
    assert first.heading_rad == pytest.approx(0.4 - cfg.turn_rate_rad_s)


def steady_lamp(percept, azimuth_rad):
    ray = np.array([math.sin(azimuth_rad), 0.0, math.cos(azimuth_rad)])
    return dataclasses.replace(percept, long_range=Bearing(ray, np.zeros(2), 0.9))


def test_a_steady_lamp_alone_leads_nobody_who_knows_of_a_beacon():
    boat = boat_at(150.0, 30.0, 0.0)

    def only_lamp(percept, time_s):
        return steady_lamp(dataclasses.replace(percept, azimuth=None), 0.1)

    modes, _ = flight(boat, 15.0, spoil=only_lamp)
    assert modes == ["acquire"]


def test_without_a_rotating_beacon_the_fixed_lamps_lead():
    pilot = RotatingPilot(ControlCfg(), VEHICLE, STATION, CAMERA, DT_S)
    boat = boat_at(8.0, 22.0, 150.0)
    modes, _ = flight(boat, 60.0, pilot=pilot, datum_rad=-2.0, until="mid")
    assert modes == ["acquire", "far", "mid"]


def same(a, b):
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b))


def test_same_input_gives_same_output_and_nothing_is_mutated():
    boat = boat_at(170.0, 22.0, 160.0)
    for index, (_, state, _) in enumerate(fly_round(boat, 25.0)):
        if index % 60:
            continue
        senses = boat.senses()
        percept = look(boat.T_world_body, senses.time_s)
        fix = AzimuthFix(senses.time_s - 0.1, 3.0, 0.01, Bearing(np.array([0.0, 0.0, 1.0]), np.zeros(2), 0.9))
        percept = dataclasses.replace(percept, azimuth=fix)
        before = copy.deepcopy(state)
        first, after = PILOT.step(state, percept, senses)
        second, again = PILOT.step(copy.deepcopy(state), copy.deepcopy(percept), copy.deepcopy(senses))
        np.testing.assert_array_equal(first.values, second.values)
        assert first.setpoint == second.setpoint
        assert same(after, again)
        assert same(state, before)


numbers = st.floats(allow_nan=True, allow_infinity=True, width=32)
vectors = st.lists(st.one_of(st.floats(-3.0, 3.0), numbers), min_size=3, max_size=3).map(np.array)
rays = st.one_of(vectors, st.just(np.array([0.1, 0.05, 0.99])))
bearings = st.builds(Bearing, rays, st.just(np.zeros(2)), st.just(0.5))
fixes = st.none() | st.builds(AzimuthFix, st.floats(-1.0, 10.0) | numbers, numbers, numbers, bearings)
percepts = st.none() | st.builds(
    Percept,
    st.just(0.0),
    st.none(),
    st.none() | bearings,
    st.none(),
    st.just(0),
    st.just(Detections.empty()),
    st.just(()),
    fixes,
)
steps = st.tuples(percepts, vectors, vectors, vectors, st.sampled_from([0.03, 0.5, 9.0]))


@pytest.mark.filterwarnings("ignore::scipy.linalg.LinAlgWarning")  # of measurements that no sensor makes
@given(sequence=st.lists(steps, min_size=1, max_size=25))
@settings(max_examples=40, deadline=None)
def test_whatever_comes_in_commands_stay_finite(sequence):
    state, now = PILOT.initial_state(), 0.0
    for percept, euler, rate, ground, pause in sequence:
        command, state = PILOT.step(state, percept, Proprioception(now, 8.0, euler, rate, ground, ground))
        assert np.all(np.isfinite(command.values))
        assert np.abs(command.values).max() <= 1.0
        assert command.mode in {*MODES, *ROTATING_MODES}
        now += pause


def facts(**changes):
    base = RotatingFacts(
        has_beacon=True,
        has_pose=False,
        lamp=False,
        in_mode_s=5.0,
        fixes=5,
        since_fix_s=1.0,
        range_share=0.1,
        off_axis_rad=1.0,
        cone_rad=0.14,
        ahead_m=20.0,
    )
    return base._replace(**changes)


@pytest.mark.parametrize(
    ("mode", "changes", "expected"),
    [
        ("acquire", {"fixes": 1}, "acquire"),
        ("acquire", {}, APPROACH),
        ("acquire", {"off_axis_rad": 0.1}, LINEUP),
        ("acquire", {"fixes": 0, "lamp": True}, "acquire"),
        ("acquire", {"fixes": 0, "lamp": True, "has_beacon": False}, "far"),
        (APPROACH, {"range_share": 0.4}, APPROACH),
        (APPROACH, {}, CIRCLE),
        (APPROACH, {"since_fix_s": 31.0}, "acquire"),
        (CIRCLE, {}, CIRCLE),
        (CIRCLE, {"missed": True}, "acquire"),
        (CIRCLE, {"off_axis_rad": 0.1}, LINEUP),
        (CIRCLE, {"has_pose": True}, CIRCLE),
        (CIRCLE, {"has_pose": True, "off_axis_rad": 0.3}, "mid"),
        (LINEUP, {}, CIRCLE),
        (LINEUP, {"off_axis_rad": 0.2}, LINEUP),
        (LINEUP, {"off_axis_rad": 0.1, "ahead_m": 4.0}, "abort"),
        (LINEUP, {"off_axis_rad": 0.1, "has_pose": True}, "mid"),
        (LINEUP, {"off_axis_rad": 0.1, "since_fix_s": 9.0, "lamp": True}, LINEUP),
        (LINEUP, {"off_axis_rad": 0.1, "since_fix_s": 9.0, "in_mode_s": 9.0, "lamp": True}, "far"),
    ],
)
def test_modes_follow_the_table(mode, changes, expected):
    assert next_rotating_mode(mode, facts(**changes), RotatingModeCfg()) == expected
