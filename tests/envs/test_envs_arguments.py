"""Start, reward, time limit and fidelity as arguments; success paid once; pictures that follow from the seed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from auvdock.core.camera import CameraCfg
from auvdock.core.errors import ConfigError
from auvdock.envs.config import LimitsCfg, StartCfg, WorldCfg, rotating_world_cfg
from auvdock.envs.docking import DockingEnv
from auvdock.envs.landing import LandingEnv
from auvdock.envs.landing_config import LandingStartCfg, LandingWorldCfg
from auvdock.envs.reward import RewardCfg
from auvdock.envs.rotating_docking import RotatingDockingEnv
from auvdock.envs.vehicle_env import VehicleEnv
from auvdock.episode.config import level_cfg

CONICAL = "auvdock/ConicalDocking-v1"


def test_without_a_fidelity_of_its_own_an_environment_takes_the_configurations() -> None:
    for fidelity in ("pixels", "beacons"):
        assert DockingEnv(WorldCfg(fidelity=fidelity)).cfg.fidelity == fidelity
        assert DockingEnv(WorldCfg(fidelity=fidelity), observation="pose").cfg.fidelity == fidelity
        assert LandingEnv(LandingWorldCfg(fidelity=fidelity)).cfg.fidelity == fidelity
        assert RotatingDockingEnv(rotating_world_cfg(), fidelity=fidelity).cfg.fidelity == fidelity
    assert DockingEnv(observation="pose").cfg.fidelity == "beacons"
    assert DockingEnv(observation="image").cfg.fidelity == "pixels"
    with pytest.raises(ConfigError, match="fidelity"):
        DockingEnv(WorldCfg(fidelity="beacons"), observation="image")


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"time_limit_s": 0.0}, "time_limit_s"),
        ({"time_limit_s": float("nan")}, "time_limit_s"),
        ({"time_limit_s": float("inf")}, "time_limit_s"),
        ({"time_limit_s": "30"}, "time_limit_s"),
        ({"time_limit_s": True}, "time_limit_s"),
        ({"start": {"min_rang_m": 3.0}}, "start.min_rang_m.*min_range_m"),
        ({"start": {"min_range_m": "near"}}, "start.min_range_m"),
        ({"start": {"min_range_m": 40.0}}, "start.min_range_m"),
        ({"start": 3.0}, "start: 3.0"),
        ({"start": LandingStartCfg()}, "start: .*a StartCfg"),
        ({"reward": {"sucess": 1.0}}, "reward.sucess.*success"),
        ({"reward": {"success": float("nan")}}, "reward.success"),
        ({"reward": {"energy_per_j": -1.0}}, "reward.energy_per_j"),
        ({"reward": [1.0]}, "reward"),
        ({"cfg": LandingWorldCfg()}, "cfg: 'LandingWorldCfg'.*a WorldCfg"),
    ],
)
def test_arguments_that_cannot_be_used_are_refused_by_name(options: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigError, match=field):
        gymnasium.make(CONICAL, **options)


def test_a_landing_is_refused_the_start_of_a_funnel() -> None:
    with pytest.raises(ConfigError, match="a LandingStartCfg"):
        LandingEnv(start=StartCfg())  # pyright: ignore[reportArgumentType]


def test_the_reward_is_what_its_settings_say() -> None:
    cfg = RewardCfg(progress_per_m=2.0, energy_per_j=0.5, time_per_s=0.25, success=10.0, failure=20.0)
    step = 2.0 * 0.1 - 0.5 * 0.2 - 0.25 * 4.0
    assert cfg.of(0.1, 0.2, 4.0, success=False, end=None) == pytest.approx(step)
    assert cfg.of(0.1, 0.2, 4.0, success=True, end=None) == pytest.approx(step + 10.0)
    assert cfg.of(0.1, 0.2, 4.0, success=False, end="collision") == pytest.approx(step - 20.0)
    for end in ("timeout", "terminal"):
        assert cfg.of(0.1, 0.2, 4.0, success=False, end=end) == pytest.approx(step)


def test_success_is_paid_once() -> None:
    """Straight through the funnel: the step that docks pays the reward of success, and it is the last."""
    start = StartCfg(min_range_m=2.0, max_range_m=2.0, lateral_m=0.0, vertical_m=0.0, heading_deg=0.0)
    env = DockingEnv(start=start, reward={"progress_per_m": 0.0, "energy_per_j": 0.0})
    env.reset(seed=0)
    ahead = np.zeros(7)
    ahead[0] = 0.3
    total = 0.0
    for _ in range(900):
        _, reward, terminated, _, info = env.step(ahead)
        total += reward
        if terminated:
            break
    assert info["is_success"]
    assert reward == total == 100.0
    with pytest.raises(ResetNeeded, match="success"):
        env.step(ahead)


@pytest.mark.parametrize("control_hz", [10.0, 20.0, 60.0])
def test_pictures_are_shown_at_the_control_rate(control_hz: float) -> None:
    env = DockingEnv(WorldCfg(control_hz=control_hz))
    assert env.metadata["render_fps"] == control_hz == 1.0 / env.control_s
    assert DockingEnv().metadata["render_fps"] == 30
    assert LandingEnv(LandingWorldCfg(control_hz=40.0)).metadata["render_fps"] == 40


def pictures(env: VehicleEnv[Any, Any, Any], seed: int, steps: int = 3) -> list[Any]:
    env.reset(seed=seed)
    found = []
    for _ in range(steps):
        observation = env.step(np.full(env.action_space.shape or (), 0.2))[0]
        found.append((env.render(), observation))
    return found


@pytest.mark.render
@pytest.mark.parametrize("observation", ["state", "pose"])
def test_what_the_pilots_camera_shows_follows_from_the_seed_and_changes_nothing(observation: str) -> None:
    cfg = level_cfg(4).override({"world": {"fidelity": "beacons", "camera": {"width_px": 160, "height_px": 90}}}).world
    options: dict[str, Any] = {"observation": observation, "render_mode": "rgb_array"}
    env = DockingEnv(cfg, render_camera="bow", **options)
    first = pictures(env, 5)
    other, again = pictures(env, 6), pictures(env, 5)
    fresh = pictures(DockingEnv(cfg, render_camera="bow", **options), 5)
    for one, two, three in zip(first, again, fresh, strict=True):
        assert np.array_equal(one[0], two[0])
        assert np.array_equal(one[0], three[0])
    assert not np.array_equal(first[0][0], other[0][0])
    blind = DockingEnv(cfg, observation=observation)
    for (_, seen), (_, unseen) in zip(first, pictures(blind, 5), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(leaves(seen), leaves(unseen), strict=True))
    env.close()


@pytest.mark.render
def test_a_picture_before_the_first_frame_came_through_takes_none() -> None:
    """Of lost frames, the first is lost in half of the episodes; looking then must not change what follows."""
    cfg = WorldCfg(camera=CameraCfg(width_px=160, height_px=90), frame_drop_share=0.5, limits=LimitsCfg())
    looking = DockingEnv(cfg, observation="image", render_mode="rgb_array", render_camera="bow")
    blind = DockingEnv(cfg, observation="image")
    dark = 0
    for seed in range(4):
        looking.reset(seed=seed)
        dark += not looking.render().any()
        blind.reset(seed=seed)
        for _ in range(3):
            action = np.full(7, 0.1)
            seen, unseen = looking.step(action)[0], blind.step(action)[0]
            assert np.array_equal(seen["image"], unseen["image"])  # type: ignore[index]
    assert dark
    looking.close()
    blind.close()


def leaves(item: Any) -> list[Any]:
    return [leaf for key in sorted(item) for leaf in leaves(item[key])] if isinstance(item, dict) else [item]


def test_what_is_observed_in_the_deep_lies_in_its_space():
    """11,000 m is the greatest depth that a station may have."""
    cfg = WorldCfg(fidelity="beacons", station=replace(WorldCfg().station, depth_m=10_900.0))
    env = DockingEnv(cfg, observation="pose")
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
