"""A command acts when the computer on board has had its time, and never before one that was given earlier."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.errors import ConfigError
from auvdock.envs.config import WorldCfg
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.latency import CommandLink, LatencyCfg
from auvdock.envs.world import DockingWorld
from auvdock.episode.config import level_cfg
from auvdock.episode.runner import EpisodeRunner

HZ, STEPS = 120.0, 4
CALM = WorldCfg(fidelity="beacons")


def acting(link: CommandLink, commands: int) -> list[float]:
    """Which command acted in each physics step; 0 is none, the first given one is 1."""
    steps: list[float] = []
    for number in range(1, commands + 1):
        for values, count in link.segments(np.array([float(number)]), STEPS):
            steps += [float(values[0])] * count
    return steps


@given(wait=st.integers(0, 40), commands=st.integers(1, 30))
def test_what_acts_is_what_was_given_that_many_steps_before(wait: int, commands: int) -> None:
    link = CommandLink(LatencyCfg(wait / HZ), 1, HZ)
    given_at = [float(step // STEPS + 1) for step in range(commands * STEPS)]
    assert acting(link, commands) == ([0.0] * wait + given_at)[: commands * STEPS]
    link.reset()
    assert acting(link, commands) == ([0.0] * wait + given_at)[: commands * STEPS]


def test_a_vehicle_with_latency_flies_as_one_that_is_told_later() -> None:
    late = DockingWorld(dataclasses.replace(CALM, latency=LatencyCfg(2 * STEPS / HZ)), "threshold")
    prompt = DockingWorld(CALM, "threshold")
    rng = np.random.default_rng(0)
    commands = rng.uniform(-1.0, 1.0, (30, 7))
    late.reset(3)
    prompt.reset(3)
    for values in commands:
        late.step(values)
    for values in [np.zeros(7), np.zeros(7), *commands[:-2]]:
        prompt.step(values)
    np.testing.assert_array_equal(late.truth.T_world_body, prompt.truth.T_world_body)
    assert not np.array_equal(late.truth.nu_body, np.zeros(6))


@settings(max_examples=5)
@given(at=st.integers(0, 12))
def test_a_copy_keeps_the_commands_that_are_on_their_way(at: int) -> None:
    link = CommandLink(LatencyCfg(0.1), 1, HZ)
    acting(link, at)
    assert acting(copy.deepcopy(link), 9) == acting(link, 9)


def test_measured_time_delays_commands_by_what_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 0.0, 0.05, 1.0, 1.0])
    monkeypatch.setattr("auvdock.envs.latency.time.perf_counter", lambda: next(clock))
    link = CommandLink(LatencyCfg(measured=True), 1, HZ)
    link.sensed()
    first = [(float(values[0]), steps) for values, steps in link.segments(np.array([1.0]), STEPS)]
    assert first == [(0.0, STEPS)]  # 50 ms are six steps: it waits through this period
    link.sensed()
    second = [(float(values[0]), steps) for values, steps in link.segments(np.array([2.0]), STEPS)]
    assert second == [(2.0, STEPS)]  # at once, and the slower one before it is overtaken for good


def test_an_episode_docks_with_the_papers_latency_and_repeats() -> None:
    cfg = level_cfg(0).override({"world": {"fidelity": "beacons", "latency": {"time_s": 0.1}}})
    runner = EpisodeRunner(cfg)
    first, again = runner.run(1), runner.run(1)
    assert first.success
    assert (first.time_s, first.energy_j) == (again.time_s, again.energy_j)
    prompt = EpisodeRunner(cfg.override({"world": {"latency": {"time_s": 0.0}}})).run(1)
    assert prompt.energy_j != first.energy_j


@pytest.mark.parametrize("kind", [WorldCfg, LandingWorldCfg])
@pytest.mark.parametrize("value", [-0.1, 2.5, float("nan")])
def test_a_latency_that_cannot_be_is_refused_by_name(kind: type[WorldCfg], value: float) -> None:
    assert kind().latency.time_s == 0.0
    with pytest.raises(ConfigError, match="time_s"):
        LatencyCfg(value)
