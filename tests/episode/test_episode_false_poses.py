"""False poses: counted one by one, since a median hides them."""

import math

import numpy as np
import pytest

from auvdock.core.contracts import Command, Detections, Percept, PoseEstimate
from auvdock.core.transforms import invert
from auvdock.envs.world import DockingWorld
from auvdock.episode.config import level_cfg
from auvdock.episode.false_poses import FalsePoses, is_false
from auvdock.episode.metrics import GuidanceMetrics
from auvdock.episode.trace import Tick


def test_near_the_station_the_bound_is_0_3_m_and_far_away_a_tenth_of_the_range():
    error_m = [0.29, 0.31, 0.99, 1.01, 1.99, 2.01]
    range_m = [1.0, 1.0, 10.0, 10.0, 20.0, 20.0]
    assert is_false(error_m, range_m).tolist() == [False, True, False, True, False, True]


@pytest.mark.parametrize("error_m", [math.nan, math.inf, 4e14])
def test_a_pose_that_is_no_number_or_absurd_is_false(error_m):
    assert is_false([error_m], [15.0]).tolist() == [True]


def test_without_a_pose_there_is_no_rate():
    assert FalsePoses.count((), ()) == FalsePoses(0, 0, None)


def test_an_episode_counts_each_wrong_pose_though_the_median_is_small():
    world = DockingWorld(level_cfg(0).override({"world": {"fidelity": "beacons"}}).world, "threshold")
    world.reset(0)
    metrics = GuidanceMetrics(world.camera, world.cfg.station, world.simulator.T_world_station)
    T_true = invert(world.simulator.T_world_station) @ world.truth.T_world_body @ world.camera.T_body_camera
    nothing, own = Detections.empty(), world.sense().proprioception
    for off_m in (0.01, 0.0, 0.02, 1e9, 1.4):
        T_station_camera = T_true.copy()
        T_station_camera[0, 3] += off_m
        pose = PoseEstimate(T_station_camera, np.eye(6), (0, 1, 2, 3), "sqpnp", 0.5)
        percept = Percept(0.0, pose, None, None, 4, nothing)
        metrics.add(Tick(world.truth, own, None, percept, Command(np.zeros(7))))
    found = metrics.fields(world.truth)
    assert (found["measured_poses"], found["false_poses"], found["false_pose_rate"]) == (5, 1, 0.2)
    assert found["pose_error_median_m"] == pytest.approx(0.02, abs=1e-6)
