"""The landing pilot: docks, goes around, never drives on blind; pure, finite and on documented edges."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from hover_bench import DT_S, VEHICLES
from hypothesis import given, settings
from hypothesis import strategies as st
from landing_bench import BLIND, CAMERAS, PILOTS, STATION, Lander, fly, glance_of, look

from auvdock.controllers.landing.config import HoverAllocationCfg, LandingControlCfg
from auvdock.controllers.landing.guidance import LandingGuidanceCfg, Place, corridor_m, sink_m_s, station_keeping
from auvdock.controllers.landing.modes import (
    LANDING_MODES,
    LANDING_TRANSITIONS,
    LandingFacts,
    LandingModeCfg,
    next_landing_mode,
)
from auvdock.controllers.landing.pilot import LandingPilot
from auvdock.controllers.landing.search import SpiralCfg, spiral, spiral_pass
from auvdock.core.contracts import Bearing, PoseEstimate, Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.strict import from_mapping, to_plain
from auvdock.sim.sensors import SensorCfg

MODES = LandingModeCfg()
HASTY = {
    name: LandingPilot(
        LandingControlCfg(modes=LandingModeCfg(search_timeout_s=8.0, approach_timeout_s=12.0)),
        VEHICLES[name],
        STATION,
        CAMERAS[name],
        DT_S,
    )
    for name in PILOTS
}
"""Pilots that give up a search soon."""


def modes_of(commands):
    modes = []
    for command in commands:
        if not modes or modes[-1] != command.mode:
            modes.append(command.mode)
    return modes


@pytest.mark.parametrize("name", PILOTS)
@pytest.mark.parametrize(
    ("height_m", "ahead_m", "port_m", "yaw_deg", "current_m_s", "direction_deg"),
    [
        (3.0, 1.5, -1.5, 45.0, 0.0, 0.0),
        (6.0, -1.5, 1.5, -45.0, 0.1, 130.0),
        (4.0, -1.0, -1.0, 20.0, 0.3, 0.0),
        (3.5, 0.5, 1.5, -30.0, 0.3, 115.0),
    ],
)
def test_docks_without_any_help_of_guides(name, height_m, ahead_m, port_m, yaw_deg, current_m_s, direction_deg):
    """Within the latch's limits, slower than 0.3 m/s at the seat, in one attempt, with real sensors."""
    lander = Lander(
        name,
        height_m,
        ahead_m,
        port_m,
        yaw_deg,
        current_m_s=current_m_s,
        direction_deg=direction_deg,
        sensors=SensorCfg(),
        seed=4,
    )
    modes = modes_of([command for _, _, command in fly(lander, 90.0)])
    assert modes[-3:] == ["descend", "touchdown", "docked"]
    assert "abort" not in modes
    assert lander.fastest_m_s < 0.1
    assert math.hypot(*lander.offset()[:2]) < 0.02
    assert abs(math.degrees(lander.offset()[3])) < 2.0


@pytest.mark.parametrize("name", PILOTS)
def test_lands_softly_on_the_solid_station(name):
    """The station's own latch closes and holds; first contact slower than 0.3 m/s, in a current of 0.3 m/s."""
    lander = Lander(
        name, 3.0, 0.7, -0.7, 25.0, solid=True, current_m_s=0.3, direction_deg=70.0, sensors=SensorCfg(), seed=5
    )
    commands = [command for _, _, command in fly(lander, 60.0)]
    assert commands[-1].mode == "docked"
    for _ in range(round(1.0 / DT_S)):
        lander.step(commands[-1].values)
    truth = lander.simulator.truth
    assert truth.docked
    assert truth.landing is not None
    speed = truth.landing.touchdown_speed_m_s
    assert speed is None or speed < 0.1


def test_tag_occluded_for_two_seconds_at_one_metre_only_delays():
    """The descent goes on for a moment, stops, and goes on once the pose is back."""
    lander, hidden, flight = Lander("bluerov2_heavy", current_m_s=0.1, direction_deg=60.0), [], []

    def spoil(glance, lander):
        if lander.offset()[2] < 1.0 and len(hidden) < round(2.0 / DT_S):
            hidden.append(lander.offset()[2])
            return BLIND
        return glance

    flight = list(fly(lander, 60.0, spoil))
    assert lander.latched
    assert "abort" not in modes_of([command for _, _, command in flight])
    assert hidden[0] - min(hidden) < 0.3
    assert hidden[round(1.5 / DT_S)] - hidden[-1] < 0.01


@pytest.mark.parametrize("status", ["holding", "lost"])
def test_station_lost_for_good_ends_the_descent_and_the_attempt(status):
    """It stops within 0.25 m below where the pose was lost (0.15 m if perception says "lost"), climbs and gives up."""
    lander, lost_at = Lander("bluerov2_heavy", current_m_s=0.1, direction_deg=200.0), []

    def spoil(glance, lander):
        if lost_at or lander.offset()[2] < 1.2:
            lost_at.append(lander.offset()[2])
            return glance_of(None, None, status)
        return glance

    commands = [command for _, _, command in fly(lander, 200.0, spoil, pilot=HASTY["bluerov2_heavy"])]
    assert lost_at[0] - min(lost_at) < (0.25 if status == "holding" else 0.15)
    assert commands[-1].giving_up
    assert lander.offset()[2] > MODES.standoff_m - 0.2
    assert modes_of(commands)[-3:] == ["abort", "search", "abort"]


@pytest.mark.parametrize("name", PILOTS)
def test_without_a_pose_it_never_goes_low(name):
    """Lights in sight but never a pose: it comes above them, goes down to 2 m but no lower, and gives up in the end."""
    lander = Lander(name, 3.0, 1.0, -1.0, sensors=SensorCfg(), seed=2)
    heights, modes = [], []

    def spoil(glance, _):
        return glance_of(None, glance.long_range, "searching")

    for offset, _, command in fly(lander, 400.0, spoil, pilot=HASTY[name]):
        heights.append(offset[2])
        modes.append(command)
    assert MODES.min_blind_height_m - 0.05 < min(heights) < MODES.min_blind_height_m + 0.2
    assert modes[-1].giving_up
    assert set(modes_of(modes)) <= {"search", "approach", "abort"}


def test_committed_descent_ends_blind_but_not_from_higher_up():
    """No pose at all from 0.3 m down: docks by dead reckoning; the same from 0.6 m up does not go below 0.35 m."""
    for height, docks in ((0.3, True), (0.6, False)):
        lander, blind, lowest = Lander("bluerov2_heavy", current_m_s=0.1), [], math.inf

        def spoil(glance, lander, limit=height, blind=blind):
            if blind or lander.offset()[2] < limit:
                blind.append(True)
                return glance_of(None, None, "holding")
            return glance

        for offset, _, _ in fly(lander, 60.0, spoil):
            lowest = min(lowest, float(offset[2]))
        assert lander.latched is docks
        assert docks or lowest > MODES.commit_height_m


def test_searches_outwards_until_it_finds_the_station():
    lander = Lander("bluerov2_heavy", 4.0, 3.2, 2.5, 30.0, current_m_s=0.1, direction_deg=20.0)
    modes = modes_of([command for _, _, command in fly(lander, 150.0)])
    assert modes[0] == "search"
    assert lander.latched


def test_missed_seat_is_noticed_and_flown_again():
    """The latch never closes, and no platform is there: it climbs and tries again, three times in all."""
    lander = Lander("bluerov2_heavy", 2.5)
    lander.latch_works = False
    commands = [command for _, _, command in fly(lander, 300.0)]
    assert commands[-1].giving_up
    begun = sum(1 for mode in modes_of(commands) if mode == "touchdown")
    assert begun == MODES.max_attempts


def test_same_input_gives_same_output_and_nothing_is_mutated():
    pilot, lander = PILOTS["bluerov2_heavy"], Lander("bluerov2_heavy", ahead_m=1.0)
    state = pilot.initial_state()
    for index in range(600):
        senses, glance = lander.senses(), look("bluerov2_heavy", lander.T_station_body)
        before, senses_before = copy.deepcopy(state), copy.deepcopy(senses)
        command, after = pilot.step(state, glance, senses)
        if index % 40 == 0:
            again, after_again = pilot.step(copy.deepcopy(state), copy.deepcopy(glance), copy.deepcopy(senses))
            np.testing.assert_array_equal(command.values, again.values)
            assert repr(after) == repr(after_again)
            assert repr(state) == repr(before)
            np.testing.assert_array_equal(senses.euler_zyx_rad, senses_before.euler_zyx_rad)
        lander.step(command.values)
        state = after


numbers = st.floats(allow_nan=True, allow_infinity=True, width=32)
vectors = st.lists(st.one_of(st.floats(-3.0, 3.0), numbers), min_size=3, max_size=3).map(np.array)
rays = st.one_of(vectors, st.just(np.array([0.1, 0.05, 0.99])))
bearings = st.none() | st.builds(Bearing, rays, st.just(np.zeros(2)), st.just(0.5), st.none() | st.floats(0.1, 60.0))


def plausible_pose(x, y, z, yaw, scale, measured):
    cosine, sine = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    T = np.eye(4)
    T[:3, :3] = rotation @ CAMERAS["bluerov2_heavy"].T_body_camera[:3, :3]
    T[:3, 3] = x, y, z
    return PoseEstimate(T, np.diag(np.full(6, scale)), (), "random", 1.0, measured)


poses = st.none() | st.builds(
    plausible_pose,
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.floats(-1.0, 6.0),
    st.floats(-0.5, 0.5),
    st.sampled_from([0.0, 1e-6, 1e-2, 10.0, math.nan, math.inf]),
    st.booleans(),
)
glances = st.none() | st.builds(
    glance_of, poses, bearings, st.sampled_from(["searching", "tracking", "holding", "lost"])
)
steps = st.tuples(glances, vectors, vectors, vectors, vectors, st.sampled_from([0.05, 0.5, 5.0, 40.0]))


@given(sequence=st.lists(steps, min_size=1, max_size=20), latch=st.booleans())
@settings(max_examples=100, deadline=None)
def test_whatever_comes_in_commands_stay_finite_and_modes_on_documented_edges(sequence, latch):
    pilot = PILOTS["bluerov2_heavy"]
    state, now = pilot.initial_state(), 0.0
    for index, (glance, euler, rate, ground, water, pause) in enumerate(sequence):
        latched = latch and index == len(sequence) - 1
        senses = Proprioception(now, 6.0, euler, rate, ground, water, False, latched)
        command, after = pilot.step(state, glance, senses)
        assert np.all(np.isfinite(command.values))
        assert np.abs(command.values).max() <= 1.0
        assert all(math.isfinite(value) for value in command.setpoint.values())
        assert command.mode in LANDING_MODES
        assert after.mode in LANDING_TRANSITIONS[state.mode]
        assert not latched or (command.mode == "docked" and not command.values.any())
        state, now = after, now + pause


CENTRED = LandingFacts(
    latched=False,
    fixes=50,
    since_fix_s=0.0,
    lost=False,
    jumped=False,
    sigma_m=0.005,
    height_m=1.0,
    offset_m=0.01,
    heading_error_rad=0.01,
    allowed_m=0.15,
    sights=0,
    since_sight_s=math.inf,
    in_mode_s=1.0,
    inside_s=5.0,
    stalled_s=0.0,
    giving_up=False,
)


@pytest.mark.parametrize(
    ("mode", "changes", "after"),
    [
        ("search", {}, "approach"),
        ("search", {"fixes": 0, "since_fix_s": math.inf}, "search"),
        ("search", {"fixes": 0, "since_fix_s": math.inf, "sights": 3, "since_sight_s": 0.0}, "approach"),
        ("search", {"fixes": 0, "since_fix_s": math.inf, "in_mode_s": 1e3}, "abort"),
        ("approach", {"height_m": 2.2}, "align"),
        ("approach", {"height_m": 4.0}, "approach"),
        ("approach", {"since_fix_s": 4.0}, "search"),
        ("align", {}, "descend"),
        ("align", {"inside_s": 1.0}, "align"),
        ("align", {"sigma_m": 0.2}, "align"),
        ("align", {"since_fix_s": 4.0}, "abort"),
        ("align", {"since_fix_s": 4.0, "height_m": 2.0}, "search"),
        ("align", {"lost": True}, "abort"),
        ("align", {"offset_m": 1.5}, "approach"),
        ("descend", {"offset_m": 0.2}, "descend"),
        ("descend", {"offset_m": 0.3}, "align"),
        ("descend", {"since_fix_s": 2.0}, "descend"),
        ("descend", {"since_fix_s": 4.0}, "abort"),
        ("descend", {"lost": True}, "abort"),
        ("descend", {"jumped": True}, "abort"),
        ("descend", {"stalled_s": 3.0}, "abort"),
        ("descend", {"height_m": 0.3, "allowed_m": 0.06, "since_fix_s": 5.0, "lost": True}, "descend"),
        ("descend", {"height_m": 0.3, "allowed_m": 0.06, "since_fix_s": 11.0}, "abort"),
        ("descend", {"height_m": 0.3, "allowed_m": 0.06, "sigma_m": 0.05}, "abort"),
        ("descend", {"height_m": 0.1, "allowed_m": 0.04}, "touchdown"),
        ("descend", {"height_m": 0.1, "allowed_m": 0.04, "offset_m": 0.05}, "descend"),
        ("touchdown", {"height_m": 0.0, "allowed_m": 0.03}, "touchdown"),
        ("touchdown", {"height_m": 0.2, "allowed_m": 0.05, "stalled_s": 3.0}, "abort"),
        ("touchdown", {"height_m": 0.0, "allowed_m": 0.03, "stalled_s": 3.0}, "touchdown"),
        ("touchdown", {"height_m": -0.2, "allowed_m": 0.03}, "abort"),
        ("touchdown", {"height_m": 0.0, "allowed_m": 0.03, "in_mode_s": 13.0}, "abort"),
        ("abort", {}, "abort"),
        ("abort", {"height_m": 2.0}, "approach"),
        ("abort", {"height_m": 2.0, "since_fix_s": 9.0}, "search"),
        ("abort", {"height_m": 2.0, "giving_up": True}, "abort"),
        ("docked", {}, "docked"),
    ],
)
def test_mode_table(mode, changes, after):
    assert next_landing_mode(mode, CENTRED._replace(**changes), MODES) == after
    assert next_landing_mode(mode, CENTRED._replace(**{**changes, "latched": True}), MODES) == "docked"


def test_corridor_narrows_and_sinking_stops_at_its_edge():
    cfg = LandingGuidanceCfg()
    widths = [corridor_m(height, cfg) for height in (3.0, 1.0, 0.3, 0.0, -0.1)]
    assert widths == sorted(widths, reverse=True)
    assert widths[-1] == cfg.corridor_m < STATION.latch.across_m
    for height in (0.1, 0.5, 2.0):
        edge = corridor_m(height, cfg)
        speeds = [sink_m_s(Place(share * edge, 0.0, height, 0.0), cfg) for share in (0.0, 0.5, 0.8, 1.0, 2.0)]
        assert speeds == sorted(speeds, reverse=True)
        assert cfg.touchdown_sink_m_s <= speeds[0] <= cfg.max_sink_m_s
        assert speeds[-1] == speeds[-2] == 0.0


def test_station_keeping_is_odd_bounded_and_stops_integrating_far_off():
    cfg = LandingGuidanceCfg()
    rng = np.random.default_rng(0)
    for _ in range(100):
        x, y = rng.normal(size=2).tolist()
        velocity, integral = station_keeping((x, y), (0.0, 0.0), 0.15, cfg, DT_S)
        mirrored, _ = station_keeping((-x, -y), (0.0, 0.0), 0.15, cfg, DT_S)
        assert math.hypot(*velocity) <= 0.15 + 1e-12
        assert mirrored == (-velocity[0], -velocity[1])
        assert abs(velocity[0] * y - velocity[1] * x) < 1e-12
        assert integral == (0.0, 0.0) or math.hypot(x, y) < cfg.integral_zone_m


def test_spiral_has_its_pitch_speed_and_end():
    """Arc length per second is the speed (within 10 % after the first turn); turns lie one pitch apart."""
    cfg = SpiralCfg()
    points = np.array([spiral(time, cfg) for time in np.arange(0.0, 600.0, 0.1)])
    assert np.abs(points[: round(cfg.settle_s / 0.1)]).max() == 0.0
    speed = np.linalg.norm(np.diff(points[300:], axis=0), axis=1) / 0.1
    np.testing.assert_allclose(speed, cfg.speed_m_s, rtol=0.1)
    assert np.linalg.norm(points, axis=1).max() == pytest.approx(cfg.max_radius_m)
    ahead = np.array([x for x, y in points if abs(y) < 0.02 and 0.1 < x < 4.9])
    crossings = ahead[np.r_[True, np.diff(ahead) > 0.5]]
    np.testing.assert_allclose(np.diff(crossings), cfg.pitch_m, atol=0.1)


def test_high_and_low_spirals_take_turns_and_each_goes_on_where_it_stopped():
    cfg = SpiralCfg()
    cycle = cfg.high_s + cfg.low_s
    assert spiral_pass(0.0, cfg) == (True, 0.0)
    assert spiral_pass(cfg.high_s + 5.0, cfg) == (False, 5.0)
    assert spiral_pass(cycle + 5.0, cfg) == (True, cfg.high_s + 5.0)
    assert spiral_pass(cycle + cfg.high_s + 5.0, cfg) == (False, cfg.low_s + 5.0)


def test_configuration_survives_plain_data_and_refuses_nonsense():
    assert from_mapping(LandingControlCfg, to_plain(LandingControlCfg())) == LandingControlCfg()
    partial = from_mapping(LandingControlCfg, {"autopilot": {"max_heave_m_s": 0.2}})
    assert partial.autopilot.design == LandingControlCfg().autopilot.design
    cases: list[tuple[Any, str, float]] = [
        (LandingModeCfg, "commit_height_m", 3.0),
        (LandingModeCfg, "brief_s", 9.0),
        (LandingGuidanceCfg, "touchdown_sink_m_s", 0.9),
        (LandingGuidanceCfg, "corridor_m", 0.0),
        (SpiralCfg, "pitch_m", 0.0),
        (HoverAllocationCfg, "preload", 0.9),
    ]
    for cls, field, value in cases:
        with pytest.raises(ConfigError, match=field):
            cls(**{field: value})
