"""Action wrappers steer the vehicle the way they say."""

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from auvdock.envs.config import StartCfg, WorldCfg
from auvdock.envs.docking import DockingEnv
from auvdock.envs.wrappers import BodyWrenchAction, SetPointAction

STRAIGHT = WorldCfg(start=StartCfg(lateral_m=0.0, vertical_m=0.0, heading_deg=0.0))


def fly(env, action, seconds):
    env.reset(seed=0)
    for _ in range(int(seconds * 30)):
        env.step(np.asarray(action, dtype=np.float32))
    return env.unwrapped.world.truth


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")  # it is: that is what is checked here
@pytest.mark.parametrize("wrapper", [BodyWrenchAction, SetPointAction])
def test_environment_checker_is_content(wrapper):
    check_env(wrapper(DockingEnv(STRAIGHT)), skip_render_check=True)


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


def test_only_docking_environments_can_be_wrapped():
    import gymnasium

    with pytest.raises(TypeError, match="no docking environment"):
        BodyWrenchAction(gymnasium.make("CartPole-v1"))
