"""Action wrappers steer the vehicle the way they say."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.envs.docking import DockingEnv
from auvdock.envs.landing import LandingEnv
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.registration import ENVIRONMENTS
from auvdock.envs.wrappers import BodyWrenchAction, SetPointAction
from auvdock.sim.simulator import SimCfg

STRAIGHT = WorldCfg(start=StartCfg(lateral_m=0.0, vertical_m=0.0, heading_deg=0.0))


def fly(env, action, seconds):
    env.reset(seed=0)
    for _ in range(int(seconds * 30)):
        env.step(np.asarray(action, dtype=np.float32))
    return env.unwrapped.world.truth


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")  # it is: that is what is checked here
@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.parametrize("wrapper", [BodyWrenchAction, SetPointAction])
def test_environment_checker_is_content(wrapper, name):
    check_env(wrapper(gymnasium.make(name).unwrapped), skip_render_check=True)


@pytest.mark.parametrize(("axis", "component"), [(0, 0), (1, 1), (2, 2), (3, 4), (4, 5)])
def test_each_wrench_axis_moves_its_own_velocity_most(axis, component):
    action = np.zeros(5)
    action[axis] = 0.3
    moved = fly(BodyWrenchAction(DockingEnv(STRAIGHT)), action, 1.0).nu_body
    still = fly(BodyWrenchAction(DockingEnv(STRAIGHT)), np.zeros(5), 1.0).nu_body
    change = moved - still
    assert change[component] > 0.0
    same_kind = slice(0, 3) if component < 3 else slice(3, 6)
    assert np.argmax(np.abs(change[same_kind])) == component % 3


def test_set_points_are_reached():
    truth = fly(SetPointAction(DockingEnv(STRAIGHT)), [0.6, 0.5, -0.4, 0.0], 15.0)
    assert truth.nu_body[:3] == pytest.approx([0.6, 0.15, -0.12], abs=0.05)


def test_set_points_are_reached_above_a_platform():
    start = {"min_height_m": 5.0, "max_height_m": 5.0, "lateral_m": 0.0, "heading_deg": 0.0}
    inner = LandingEnv(start=start)
    env = SetPointAction(inner)
    env.reset(seed=0)
    for _ in range(100):
        env.step(np.array([0.3, 0.5, -0.5, 0.0], dtype=np.float32))
    assert inner.world.truth.nu_body[:3] == pytest.approx([0.3, 0.15, -0.15], abs=0.05)


@pytest.mark.parametrize("vehicle", ["bluerov2_heavy", "remus_hybrid"])
@pytest.mark.parametrize("wrapper", [BodyWrenchAction, SetPointAction])
def test_whatever_a_landing_wrapper_is_told_stays_within_the_actuators(wrapper, vehicle):
    env = wrapper(LandingEnv(LandingWorldCfg(sim=SimCfg(vehicle=vehicle))))
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(10):
        assert env.unwrapped.action_space.contains(env.action(env.action_space.sample()))
    up = env.action(np.eye(env.action_space.shape[0], dtype=np.float32)[2])
    flown = env.unwrapped.world.simulator.vehicle
    force = flown.efforts(up) @ flown.thruster_wrenches_body.T
    assert force[2] > 0.9 * np.abs(force).max()


BARE = {"none": lambda env: env, "wrench": BodyWrenchAction, "set_point": SetPointAction}


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.parametrize("wrapper", BARE)
def test_an_action_that_is_none_is_refused_and_leaves_no_trace(name: str, wrapper: str) -> None:
    """Refused actions between the steps of an episode change nothing in it."""
    env: Any = BARE[wrapper](gymnasium.make(name).unwrapped)
    n = env.action_space.shape[0]
    action = np.full(n, 0.3, dtype=np.float32)
    wrong = [(np.where(np.arange(n) == k, np.nan, action), f"action {k} is not a number") for k in (0, n - 1)]
    wrong += [(np.zeros((1, n)), rf"shape \(1, {n}\), expected \({n},\)"), (np.zeros(n + 1), rf"shape \({n + 1},\)")]

    def run(refused: list[Any]) -> list[Any]:
        env.reset(seed=0)
        rows: list[Any] = []
        for _ in range(3):
            for bad, message in refused:
                with pytest.raises(ValueError, match=message):
                    env.step(bad)
            rows += [*env.step(action)[0], *env.step(action)[0]]
        return rows

    assert run([]) == run(wrong)


@pytest.mark.parametrize("wrapper", [BodyWrenchAction, SetPointAction])
def test_a_step_before_reset_is_refused(wrapper):
    with pytest.raises(ResetNeeded, match=r"call env.reset\(\)"):
        wrapper(DockingEnv()).step(np.zeros(4 if wrapper is SetPointAction else 5))


def test_only_docking_environments_can_be_wrapped():
    with pytest.raises(TypeError, match="no docking environment"):
        BodyWrenchAction(gymnasium.make("CartPole-v1"))
