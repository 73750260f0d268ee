"""The pilot: pure, symmetric, finite, on documented edges, and able to dock and to go around."""

from __future__ import annotations

import copy
import math
from itertools import pairwise

import numpy as np
import pytest
from control_bench import (
    CAMERA,
    DT_S,
    STATION,
    VEHICLE,
    Boat,
    look,
    mirror_commands,
    mirror_percept,
    mirror_senses,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.controllers.modes import MODES, TRANSITIONS
from auvdock.controllers.pilot import ConicalPilot, ControlCfg
from auvdock.core.contracts import Bearing, Detections, Percept, PoseEstimate, Proprioception
from auvdock.core.strict import from_mapping, to_plain

PILOT = ConicalPilot(ControlCfg(), VEHICLE, STATION, CAMERA, DT_S)


def same(a, b):
    """Equality of nested states with arrays in them."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b))


def fly(boat, time_s, spoil=lambda percept, boat: percept, every=1, seed=1):
    """Closed loop; yields (senses, percept, command, state before)."""
    rng, state = np.random.default_rng(seed), PILOT.initial_state()
    for step in range(round(time_s / DT_S)):
        senses = boat.senses()
        percept = look(boat.T_world_body, senses.time_s, rng) if step % every == 0 else None
        percept = spoil(percept, boat)
        command, after = PILOT.step(state, percept, senses)
        yield senses, percept, command, state
        boat.step(command.values)
        state = after
        if boat.simulator.truth.docked or command.giving_up:
            return


def modes_of(flight):
    modes = []
    for _, _, command, _ in flight:
        if not modes or modes[-1] != command.mode:
            modes.append(command.mode)
    return modes


def start(x=14.0, y=1.5, z=-7.2, yaw_deg=165.0, current_m_s=0.0, direction_deg=0.0):
    return Boat(math.radians(yaw_deg), current_m_s, direction_deg, (x, y, z))


@pytest.mark.parametrize(
    ("boat", "every"),
    [
        (start(current_m_s=0.1, direction_deg=40.0), 1),
        (start(x=20.0, y=-3.0, yaw_deg=-150.0, current_m_s=0.3, direction_deg=90.0), 1),
        (start(y=2.5, current_m_s=0.3, direction_deg=-90.0), 2),
    ],
)
def test_docks_on_the_simulator(boat, every):
    modes = modes_of(fly(boat, 90.0, every=every))
    truth = boat.simulator.truth
    assert truth.docked
    assert modes == ["acquire", "far", "mid", "near", "terminal", "docked"]
    assert truth.entry_speed_m_s is not None
    assert truth.entry_speed_m_s < 0.7
    assert math.hypot(truth.entry_lateral_m or 0.0, truth.entry_vertical_m or 0.0) < STATION.funnel.tube_radius_m


def test_turns_until_it_finds_a_station_behind_its_shoulder():
    boat = start(yaw_deg=95.0)
    modes = modes_of(fly(boat, 40.0))
    assert modes[0] == "acquire"
    assert "mid" in modes


def test_same_input_gives_same_output_and_nothing_is_mutated():
    for index, (senses, percept, _, state) in enumerate(fly(start(), 40.0)):
        if index % 40:
            continue
        before, senses_before = copy.deepcopy(state), copy.deepcopy(senses)
        first, after = PILOT.step(state, percept, senses)
        second, again = PILOT.step(copy.deepcopy(state), copy.deepcopy(percept), copy.deepcopy(senses))
        np.testing.assert_array_equal(first.values, second.values)
        assert first.setpoint == second.setpoint
        assert same(after, again)
        assert same(state, before)
        np.testing.assert_array_equal(senses.euler_zyx_rad, senses_before.euler_zyx_rad)


def test_mirrored_world_gives_mirrored_commands():
    """Two pilots, one fed through a mirror, over a whole docking in a cross-current."""
    state = PILOT.initial_state()
    state = state._replace(stage=state.stage._replace(side=-1.0))
    for senses, percept, command, _ in fly(start(current_m_s=0.2, direction_deg=70.0), 60.0):
        assert percept is not None
        mirrored, state = PILOT.step(state, mirror_percept(percept), mirror_senses(senses))
        assert mirrored.mode == command.mode
        np.testing.assert_allclose(mirrored.values, mirror_commands(command.values), atol=1e-6)


def jump(percept, boat):
    """From 3.8 m before the mouth on, poses lie a metre to the side."""
    if percept is None or percept.pose is None or boat.simulator.truth.nose_station_m[0] > 3.8:
        return percept
    T = percept.pose.T_station_camera.copy()
    T[1, 3] += 1.2
    pose = PoseEstimate(T, percept.pose.covariance, percept.pose.beacon_ids, "spoilt", 0.5)
    return Percept(percept.time_s, pose, percept.long_range, None, percept.array_count, percept.detections)


def blind_near(percept, boat):
    """The lights go out between 4.2 m and 3 m before the mouth."""
    if percept is None or not 2.0 < boat.simulator.truth.nose_station_m[0] < 4.2:
        return percept
    return Percept(percept.time_s, None, None, None, 0, percept.detections)


@pytest.mark.parametrize("spoil", [jump, blind_near])
def test_goes_around_when_poses_jump_or_stay_away(spoil):
    boat = start(x=12.0)
    modes, backed, attempts = [], 0.0, 0
    for _, _, command, before in fly(boat, 60.0, spoil):
        attempts = before.stage.attempts
        if not modes or modes[-1] != command.mode:
            modes.append(command.mode)
        if command.mode == "abort":
            backed = max(backed, float(boat.simulator.truth.nose_station_m[0]))
    assert "abort" in modes
    assert modes.index("abort") > modes.index("mid")
    after = modes[modes.index("abort") + 1 :]
    assert after, "never came back from backing off"
    assert after[0] in ("mid", "far", "acquire")
    assert backed > 6.0
    assert attempts >= 2


def test_gives_up_after_its_attempts():
    flight = list(fly(start(x=10.0, y=0.3, yaw_deg=180.0), 240.0, jump))
    assert flight[-1][2].giving_up
    commands = [command.mode for _, _, command, _ in flight]
    begun = sum(1 for before, after in pairwise(commands) if after == "abort" != before)
    assert begun == ControlCfg().modes.max_attempts


def test_docked_stops_all_actuators():
    boat = start()
    senses = boat.senses()
    latched = Proprioception(
        senses.time_s,
        senses.depth_m,
        senses.euler_zyx_rad,
        senses.angular_velocity_rad_s,
        senses.velocity_ground_m_s,
        senses.velocity_water_m_s,
        True,
        True,
    )
    command, state = PILOT.step(PILOT.initial_state(), None, latched)
    assert command.mode == "docked"
    assert not command.values.any()
    assert PILOT.step(state, None, senses)[0].mode == "docked"


numbers = st.floats(allow_nan=True, allow_infinity=True, width=32)
vectors = st.lists(st.one_of(st.floats(-3.0, 3.0), numbers), min_size=3, max_size=3).map(np.array)
rays = st.one_of(vectors, st.just(np.array([0.1, 0.05, 0.99])))
bearings = st.none() | st.builds(
    Bearing, rays, st.just(np.zeros(2)), st.just(0.5), st.none() | st.floats(0.1, 60.0) | numbers
)


def plausible_pose(x, y, z, yaw, scale, measured):
    cosine, sine = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[-cosine, sine, 0.0], [-sine, -cosine, 0.0], [0.0, 0.0, 1.0]])
    T = np.eye(4)
    T[:3, :3] = rotation @ CAMERA.T_body_camera[:3, :3]
    T[:3, 3] = x, y, z
    return PoseEstimate(T, np.diag(np.full(6, scale)), (0, 1, 2, 3), "random", 1.0, measured)


poses = st.none() | st.builds(
    plausible_pose,
    st.floats(-2.0, 20.0),
    st.floats(-5.0, 5.0),
    st.floats(-3.0, 3.0),
    st.floats(-0.5, 0.5),
    st.sampled_from([0.0, 1e-6, 1e-2, 10.0, math.nan, math.inf]),
    st.booleans(),
)
percepts = st.none() | st.builds(
    Percept, st.just(0.0), poses, bearings, bearings, st.integers(0, 6), st.just(Detections.empty())
)
steps = st.tuples(percepts, vectors, vectors, vectors, vectors, st.booleans(), st.sampled_from([0.03, 0.5, 5.0]))


@given(sequence=st.lists(steps, min_size=1, max_size=25), latch=st.booleans())
@settings(max_examples=150, deadline=None)
def test_whatever_comes_in_commands_stay_finite_and_modes_on_documented_edges(sequence, latch):
    state, now = PILOT.initial_state(), 0.0
    for index, (percept, euler, rate, ground, water, contact, pause) in enumerate(sequence):
        latched = latch and index == len(sequence) - 1
        command, after = PILOT.step(
            state, percept, Proprioception(now, 8.0, euler, rate, ground, water, contact, latched)
        )
        assert np.all(np.isfinite(command.values))
        assert np.abs(command.values).max() <= 1.0
        assert all(math.isfinite(value) for value in command.setpoint.values())
        assert command.mode in MODES
        assert after.mode in TRANSITIONS[state.mode]
        state, now = after, now + pause


def test_empty_percepts_search_for_ever_without_trouble():
    boat, empty = start(), Percept(0.0, None, None, None, 0, Detections.empty())
    modes = modes_of(fly(boat, 60.0, lambda percept, _: empty))
    assert modes == ["acquire"]
    assert np.isfinite(boat.simulator.truth.T_world_body).all()


def test_configuration_survives_plain_data():
    assert from_mapping(ControlCfg, to_plain(ControlCfg())) == ControlCfg()
