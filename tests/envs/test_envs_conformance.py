"""What every environment keeps: Gymnasium's contract, seeds, copies, vectors, honest info, tables that are true."""

from __future__ import annotations

import importlib
import inspect
import pickle
import re
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from auvdock.core.errors import ConfigError
from auvdock.envs.registration import ENVIRONMENTS
from auvdock.envs.reward import RewardCfg
from auvdock.envs.vehicle_env import VehicleEnv

Env = VehicleEnv[Any, Any, Any]
every_environment = pytest.mark.parametrize("name", ENVIRONMENTS)
with_and_without_perception = pytest.mark.parametrize("observation", ["state", "pose"])


def make(name: str, **options: Any) -> Env:
    env = gymnasium.make(name, **options).unwrapped
    assert isinstance(env, VehicleEnv)
    return env


def still(env: Env) -> np.ndarray:
    return np.zeros(env.action_space.shape or (), dtype=np.float32)


def rollout(env: Env, seed: int, steps: int) -> list[Any]:
    """What reset and steps with random actions give, all of it."""
    shape = env.action_space.shape or ()
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (steps, *shape)).astype(np.float32)
    return [env.reset(seed=seed), *(env.step(action) for action in actions)]


def leaves(item: Any) -> list[Any]:
    if isinstance(item, dict):
        return [leaf for key in sorted(item) for leaf in leaves(item[key])]
    if isinstance(item, list | tuple):
        return [leaf for part in item for leaf in leaves(part)]
    return [item]


def equal(first: Any, second: Any) -> bool:
    return all(np.array_equal(one, other) for one, other in zip(leaves(first), leaves(second), strict=True))


def test_they_are_registered_by_import_alone() -> None:
    assert set(ENVIRONMENTS) == {name for name in gymnasium.registry if name.startswith("auvdock/")}


@every_environment
@with_and_without_perception
@pytest.mark.filterwarnings("error::UserWarning")
def test_gymnasiums_checker_is_content(name: str, observation: str) -> None:
    check_env(make(name, observation=observation), skip_render_check=True)


@pytest.mark.render
@every_environment
@pytest.mark.filterwarnings("error::UserWarning")
def test_gymnasiums_checker_is_content_with_images(name: str) -> None:
    env = make(name, observation="image", render_mode="rgb_array")
    check_env(env)
    env.close()


@every_environment
@with_and_without_perception
def test_same_seed_same_rollout_including_info_fresh_used_or_pickled(name: str, observation: str) -> None:
    env = make(name, observation=observation)
    rollout(env, 1, 15)
    copy = pickle.loads(pickle.dumps(env))
    first = rollout(env, 3, 25)
    assert equal(first, rollout(make(name, observation=observation), 3, 25))
    assert equal(first, rollout(copy, 3, 25))
    assert not equal(first, rollout(copy, 4, 25))


@pytest.mark.render
@every_environment
def test_same_seed_same_images(name: str) -> None:
    env = make(name, observation="image")
    first, again, other = (rollout(env, seed, 4) for seed in (5, 5, 6))
    env.close()
    assert equal(first, again)
    assert any(not np.array_equal(a[0]["image"], b[0]["image"]) for a, b in zip(first, other, strict=True))


@every_environment
@with_and_without_perception
def test_an_observation_given_stays_as_it_was(name: str, observation: str) -> None:
    """Nobody writes into what was given away: replay buffers keep it."""
    env = make(name, observation=observation)
    given, _ = env.reset(seed=0)
    before = [np.copy(part) for part in leaves(given)]
    for _ in range(5):
        env.step(still(env) + 0.5)
    assert equal(leaves(given), before)


@every_environment
def test_episodes_start_at_different_places_at_time_0(name: str) -> None:
    env = make(name)
    places = []
    for _ in range(5):
        _, info = env.reset()
        assert info["time_s"] == 0.0
        places.append(tuple(env.world.truth.T_world_body[:3, 3]))
    assert len(set(places)) == 5


@every_environment
def test_asynchronous_vector_environments_equal_synchronous_ones(name: str) -> None:
    def run(mode: str) -> np.ndarray:
        vector = gymnasium.make_vec(name, num_envs=2, vectorization_mode=mode)
        observations, _ = vector.reset(seed=4)
        rows = [observations, *(vector.step(np.full(vector.action_space.shape or (), 0.3))[0] for _ in range(5))]
        vector.close()
        return np.array(rows)

    both = run("sync")
    assert not np.array_equal(both[0, 0], both[0, 1])
    assert np.array_equal(both, run("async"))


@every_environment
def test_the_arguments_of_make_reach_the_environment_and_stay_in_its_specification(name: str) -> None:
    options: dict[str, Any] = {"start": {"heading_deg": 1.5}, "reward": {"success": 7, "time_per_s": 0.1}}
    env = gymnasium.make(name, max_episode_steps=20, time_limit_s=30, **options)
    inner = env.unwrapped
    assert isinstance(inner, VehicleEnv)
    assert inner.cfg.start.heading_deg == 1.5
    assert inner.cfg.limits.max_time_s == 30.0
    assert inner.reward_cfg == RewardCfg(success=7.0, time_per_s=0.1)
    env.reset(seed=0)
    steps = [env.step(still(inner)) for _ in range(20)]
    assert [truncated for *_, truncated, _ in steps] == [False] * 19 + [True]
    assert env.spec is not None
    again = gymnasium.make(env.spec).unwrapped  # vectors are made by it
    assert isinstance(again, VehicleEnv)
    assert again.cfg == inner.cfg


@every_environment
def test_the_time_limit_is_the_environments_own_timeout_and_info_always_tells(name: str) -> None:
    env = make(name, time_limit_s=0.2)
    count = round(0.2 / env.control_s)
    _, info = env.reset(seed=0)
    told = [info, *(env.step(still(env))[-1] for _ in range(count))]
    assert [each["is_success"] for each in told] == [False] * (count + 1)
    assert [each["failure_reason"] for each in told] == [None] * count + ["timeout"]


@every_environment
def test_no_step_before_the_first_reset_nor_after_the_end(name: str) -> None:
    env = make(name, time_limit_s=0.1)
    with pytest.raises(ResetNeeded, match="not begun"):
        env.step(still(env))
    for _ in range(2):
        env.reset(seed=0)
        while not env.step(still(env))[3]:
            pass
        for _ in range(2):
            with pytest.raises(ResetNeeded, match=r"ended \(timeout\)"):
                env.step(still(env))


@every_environment
def test_control_period_and_frames_are_whole_numbers_of_physics_steps(name: str) -> None:
    env = make(name)
    timestep_s = env.world.simulator.model.opt.timestep
    for period_s in (env.control_s, 1.0 / env.world.camera.rate_hz):
        assert period_s / timestep_s == pytest.approx(round(period_s / timestep_s), abs=1e-9)
    env.reset(seed=0)
    assert [round(env.step(still(env))[-1]["time_s"] / env.control_s, 9) for _ in range(3)] == [1.0, 2.0, 3.0]


@every_environment
@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"observation": "smell"}, "observation"),
        ({"render_mode": "ansi"}, "render_mode"),
        ({"render_camera": "drone"}, "render_camera"),
        ({"observation": "image", "fidelity": "beacons"}, "fidelity"),
        ({"fidelity": "voxels"}, "fidelity"),
        ({"start": {"heading": 1.0}}, "start.heading.*heading_deg"),
        ({"start": 3.0}, "start"),
        ({"cfg": 3.0}, "cfg"),
    ],
)
@pytest.mark.filterwarnings("ignore:.*ansi.*not in the possible render_modes")
def test_options_that_do_not_exist_are_refused_by_name(name: str, options: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigError, match=field):
        make(name, **options)


@pytest.mark.render
@every_environment
@pytest.mark.parametrize("fidelity", ["pixels", "beacons"])
def test_pictures_from_outside_and_through_the_pilots_camera_show_something(name: str, fidelity: str) -> None:
    own = make(name).own_camera
    for camera in ("chase", own):
        env = make(name, fidelity=fidelity, render_mode="rgb_array", render_camera=camera)
        env.reset(seed=0)
        image = env.render()
        assert image.ndim == 3
        assert image.dtype == np.uint8
        assert image.std() > 1.0
        env.close()


def table(text: str, columns: int) -> list[list[str]]:
    """Rows of the tables of so many columns in a docstring, without heads and rules."""
    rows = [re.split(r"\s*\|\s*", line.strip("| ")) for line in text.splitlines() if line.startswith("|")]
    return [row for row in rows if len(row) == columns and row[0] not in ("Num", "Key") and "---" not in row[0]]


@every_environment
def test_the_tables_in_its_documentation_are_its_spaces(name: str) -> None:
    module = importlib.import_module(ENVIRONMENTS[name].partition(":")[0])
    text = inspect.getdoc(module) or ""
    env = make(name, observation="pose")
    actuators = [(int(row[0]), float(row[2]), float(row[3]), row[4]) for row in table(text, 6)]
    names = env.world.simulator.vehicle.actuator_names
    assert actuators == [(number, -1.0, 1.0, actuator) for number, actuator in enumerate(names)]
    assert env.action_space == spaces.Box(-1.0, 1.0, (len(names),), np.float32)
    keys = {row[0].strip("`"): row[1] for row in table(text, 3) if row[0].startswith("`")}
    assert isinstance(env.observation_space, spaces.Dict)
    assert keys == {key: str(space.shape) for key, space in env.observation_space.spaces.items()}
    ends = [int(row[0].rpartition("-")[2]) for row in table(text, 3) if row[0][0].isdigit()]
    assert make(name).observation_space.shape == (ends[-1] + 1,)
