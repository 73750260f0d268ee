"""The mode machine as a pure function."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.controllers.modes import (
    ABORT,
    ACQUIRE,
    DOCKED,
    FAR,
    MID,
    MODES,
    NEAR,
    TERMINAL,
    TRANSITIONS,
    Facts,
    ModeCfg,
    next_mode,
)
from auvdock.core.errors import ConfigError

CFG = ModeCfg()
CALM = Facts(
    latched=False,
    fixes=100,
    since_fix_s=0.0,
    jumped=False,
    distance_m=6.0,
    off_axis_m=0.05,
    allowed_m=0.3,
    heading_error_rad=0.01,
    sigma_m=0.02,
    sights=10,
    since_sight_s=0.0,
    range_m=None,
    in_mode_s=1.0,
    held_s=0.0,
    stalled_s=0.0,
    missed=False,
    giving_up=False,
)
BLIND = CALM._replace(
    fixes=0,
    since_fix_s=math.inf,
    distance_m=math.inf,
    off_axis_m=math.inf,
    allowed_m=math.inf,
    heading_error_rad=math.inf,
    sigma_m=math.inf,
    sights=0,
    since_sight_s=math.inf,
)
times = st.one_of(st.floats(0.0, 200.0), st.just(math.inf))
lengths = st.one_of(st.floats(-3.0, 40.0), st.just(math.inf))
facts = st.builds(
    Facts,
    latched=st.booleans(),
    fixes=st.integers(0, 50),
    since_fix_s=times,
    jumped=st.booleans(),
    distance_m=lengths,
    off_axis_m=st.one_of(st.floats(0.0, 10.0), st.just(math.inf)),
    allowed_m=st.one_of(st.floats(0.1, 10.0), st.just(math.inf)),
    heading_error_rad=st.one_of(st.floats(0.0, 3.2), st.just(math.inf)),
    sigma_m=st.one_of(st.floats(0.0, 5.0), st.just(math.inf)),
    sights=st.integers(0, 50),
    since_sight_s=times,
    range_m=st.one_of(st.none(), st.floats(0.5, 50.0)),
    in_mode_s=st.floats(0.0, 200.0),
    held_s=st.floats(0.0, 200.0),
    stalled_s=st.floats(0.0, 200.0),
    missed=st.booleans(),
    giving_up=st.booleans(),
)


@given(mode=st.sampled_from(MODES), now=facts)
def test_only_documented_transitions(mode, now):
    assert next_mode(mode, now, CFG) in TRANSITIONS[mode]


@given(sequence=st.lists(facts, min_size=1, max_size=40))
def test_any_sequence_from_the_start_stays_on_documented_edges(sequence):
    mode = ACQUIRE
    for now in sequence:
        after = next_mode(mode, now, CFG)
        assert after in TRANSITIONS[mode]
        mode = after


@given(mode=st.sampled_from(MODES), now=facts)
def test_latch_always_wins_and_docked_is_final(mode, now):
    assert next_mode(mode, now._replace(latched=True), CFG) == DOCKED
    assert next_mode(DOCKED, now, CFG) == DOCKED


@given(now=facts)
def test_a_pilot_that_gives_up_stays_in_abort(now):
    assert next_mode(ABORT, now._replace(giving_up=True, latched=False), CFG) == ABORT


@given(now=facts)
def test_nobody_commits_itself_outside_the_corridor(now):
    allowed_m = min(now.allowed_m, 10.0)  # nothing is outside of an infinite corridor
    outside = now._replace(latched=False, allowed_m=allowed_m, off_axis_m=allowed_m + 0.1)
    assert next_mode(MID, outside, CFG) != NEAR


@pytest.mark.parametrize(
    ("mode", "change", "expected"),
    [
        (ACQUIRE, {"fixes": 0, "since_fix_s": math.inf}, FAR),
        (ACQUIRE, {}, MID),
        (FAR, {}, MID),
        (FAR, {"fixes": 0, "since_fix_s": math.inf}, FAR),
        (FAR, {"fixes": 0, "since_fix_s": math.inf, "since_sight_s": 3.5}, ACQUIRE),
        (FAR, {"fixes": 0, "since_fix_s": math.inf, "range_m": 2.0}, ABORT),
        (FAR, {"fixes": 0, "since_fix_s": math.inf, "in_mode_s": 91.0}, ABORT),
        (MID, {"distance_m": 2.9}, NEAR),
        (MID, {"distance_m": 2.9, "off_axis_m": 0.4}, MID),
        (MID, {"distance_m": 2.9, "heading_error_rad": 0.3}, MID),
        (MID, {"distance_m": 2.9, "off_axis_m": 0.4, "held_s": 11.0}, ABORT),
        (MID, {"distance_m": 4.0, "jumped": True}, ABORT),
        (MID, {"distance_m": 9.0, "jumped": True}, MID),
        (MID, {"distance_m": 9.0, "since_fix_s": 4.5}, FAR),
        (MID, {"distance_m": 9.0, "since_fix_s": 4.5, "sights": 0}, ACQUIRE),
        (MID, {"distance_m": 4.0, "since_fix_s": 4.5}, ABORT),
        (NEAR, {"distance_m": 1.0, "since_fix_s": 3.0}, NEAR),
        (NEAR, {"distance_m": 0.1}, TERMINAL),
        (NEAR, {"distance_m": 1.0, "sigma_m": 0.5}, ABORT),
        (NEAR, {"distance_m": 1.0, "off_axis_m": 1.0}, ABORT),
        (NEAR, {"distance_m": 1.0, "jumped": True}, ABORT),
        (NEAR, {"distance_m": 1.0, "stalled_s": 6.0}, ABORT),
        (TERMINAL, {"distance_m": -1.0}, TERMINAL),
        (TERMINAL, {"distance_m": -1.0, "stalled_s": 6.0}, ABORT),
        (TERMINAL, {"distance_m": -3.1, "missed": True}, ABORT),
        (ABORT, {"distance_m": 4.0}, ABORT),
        (ABORT, {"distance_m": 7.5}, MID),
        (ABORT, {"distance_m": 7.5, "since_fix_s": 5.0}, FAR),
        (ABORT, {"distance_m": 7.5, "since_fix_s": 5.0, "sights": 0}, ACQUIRE),
    ],
)
def test_table_of_transitions(mode, change, expected):
    assert next_mode(mode, CALM._replace(**change), CFG) == expected


def test_blind_search_and_blind_abort():
    assert next_mode(ACQUIRE, BLIND, CFG) == ACQUIRE
    assert next_mode(ABORT, BLIND._replace(in_mode_s=1.0), CFG) == ABORT
    assert next_mode(ABORT, BLIND._replace(in_mode_s=9.0), CFG) == ACQUIRE


def test_distances_must_be_in_order():
    with pytest.raises(ConfigError, match="gate_distance_m"):
        ModeCfg(gate_distance_m=8.0)
