"""The Gymnasium contract: spaces, seeds, pickling, vectorisation, honest info."""

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from auvdock.core.camera import CameraCfg
from auvdock.core.errors import ConfigError
from auvdock.envs.config import LimitsCfg, StartCfg, WorldCfg
from auvdock.envs.docking import DockingEnv

SMALL = WorldCfg(camera=CameraCfg(width_px=160, height_px=90))


def rollout(env, seed, steps):
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (steps, *env.action_space.shape))
    trace: list[Any] = [env.reset(seed=seed)]
    for action in actions.astype(np.float32):
        observation, reward, terminated, truncated, info = env.step(action)
        trace.append((observation, reward, terminated, truncated, info))
    return trace


def flatten(item):
    if isinstance(item, dict):
        return [leaf for key in sorted(item) for leaf in flatten(item[key])]
    if isinstance(item, list | tuple):
        return [leaf for part in item for leaf in flatten(part)]
    return [item]


def assert_equal(first, second):
    for one, other in zip(flatten(first), flatten(second), strict=True):
        assert np.array_equal(one, other), (one, other)


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("observation", ["state", "pose"])
def test_environment_checker_is_content(observation):
    check_env(DockingEnv(observation=observation), skip_render_check=True)


@pytest.mark.render
@pytest.mark.filterwarnings("error::UserWarning")
def test_environment_checker_is_content_with_images():
    options: dict[str, Any] = {"cfg": SMALL, "observation": "image", "fidelity": "pixels", "render_mode": "rgb_array"}
    env = gymnasium.make("auvdock/ConicalDocking-v0", **options)
    check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("observation", ["state", "pose"])
def test_same_seed_same_rollout_including_info(observation):
    first = rollout(DockingEnv(observation=observation), 3, 40)
    second = rollout(DockingEnv(observation=observation), 3, 40)
    assert_equal(first, second)


def test_a_used_environment_gives_the_same_rollout_as_a_fresh_one():
    env = DockingEnv(observation="pose")
    rollout(env, 1, 25)
    assert_equal(rollout(env, 3, 25), rollout(DockingEnv(observation="pose"), 3, 25))


@pytest.mark.render
def test_same_seed_same_images():
    def images(seed):
        env = DockingEnv(SMALL, observation="image", fidelity="pixels")
        trace = rollout(env, seed, 8)
        env.close()
        return trace

    assert_equal(images(5), images(5))
    different = [not np.array_equal(a[0]["image"], b[0]["image"]) for a, b in zip(images(5), images(6), strict=True)]
    assert any(different)


def test_registered_name_and_vector_environments():
    assert "auvdock/ConicalDocking-v0" in gymnasium.registry  # `import auvdock` is enough
    env = gymnasium.make("auvdock/ConicalDocking-v0", observation="pose")
    assert isinstance(env.unwrapped, DockingEnv)
    vector = gymnasium.make_vec("auvdock/ConicalDocking-v0", num_envs=2, vectorization_mode="sync")
    observations, _ = vector.reset(seed=0)
    assert observations.shape == (2, 19)
    assert not np.array_equal(observations[0], observations[1])
    vector.step(vector.action_space.sample())
    vector.close()


def test_asynchronous_vector_environment_equals_the_synchronous_one():
    def run(mode):
        vector = gymnasium.make_vec("auvdock/ConicalDocking-v0", num_envs=2, vectorization_mode=mode)
        vector.reset(seed=4)
        rows = [vector.step(np.full((2, 7), 0.3, dtype=np.float32))[0] for _ in range(5)]
        vector.close()
        return np.array(rows)

    assert np.array_equal(run("sync"), run("async"))


def test_pickled_environment_goes_on_with_the_same_seeds():
    env = DockingEnv(observation="pose")
    copy = pickle.loads(pickle.dumps(env))
    assert_equal(rollout(env, 2, 10), rollout(copy, 2, 10))


def test_info_always_tells_success_and_failure_reason():
    env = DockingEnv(WorldCfg(limits=LimitsCfg(max_time_s=0.2)))
    for _, *_, info in rollout(env, 0, 5):
        assert info["is_success"] is False
        assert info["failure_reason"] is None
    *_, truncated, info = env.step(np.zeros(7, dtype=np.float32))
    assert truncated
    assert info["failure_reason"] == "timeout"


def test_progress_towards_the_latch_is_rewarded():
    env = DockingEnv(WorldCfg(start=StartCfg(heading_deg=0.0, lateral_m=0.0, vertical_m=0.0)))
    ahead, astern = np.zeros(7, dtype=np.float32), np.zeros(7, dtype=np.float32)
    ahead[0], astern[0] = 1.0, -1.0

    def total(action):
        env.reset(seed=0)
        return sum(float(env.step(action)[1]) for _ in range(60))

    assert total(ahead) > 0.0 > total(astern)


def test_start_lies_within_the_configured_ranges():
    cfg = StartCfg()
    env = DockingEnv(WorldCfg(start=cfg))
    starts = np.array([env.reset(seed=seed)[0] for seed in range(50)])
    nose_to_centre_m = 0.7
    assert np.all(starts[:, 0] > cfg.min_range_m - nose_to_centre_m)
    assert np.all(starts[:, 0] < cfg.max_range_m + nose_to_centre_m)
    assert np.all(np.abs(starts[:, 1]) < cfg.lateral_m + nose_to_centre_m)
    assert np.all(np.abs(starts[:, 2]) < cfg.vertical_m + nose_to_centre_m)
    assert np.ptp(starts[:, 0]) > 0.5 * (cfg.max_range_m - cfg.min_range_m)


@pytest.mark.render
@pytest.mark.parametrize("camera", ["chase", "bow"])
def test_rendered_pictures_show_something(camera):
    env = DockingEnv(fidelity="pixels", render_mode="rgb_array", render_camera=camera)
    env.reset(seed=0)
    image = env.render()
    assert image.shape == (360, 640, 3)
    assert image.dtype == np.uint8
    assert image.std() > 1.0
    env.close()


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"observation": "smell"}, "observation"),
        ({"render_mode": "human"}, "render_mode"),
        ({"render_camera": "drone"}, "render_camera"),
        ({"observation": "image", "fidelity": "beacons"}, "fidelity"),
        ({"fidelity": "voxels"}, "fidelity"),
    ],
)
def test_options_that_do_not_exist_are_refused_by_name(options, field):
    with pytest.raises(ConfigError, match=field):
        DockingEnv(**options)
