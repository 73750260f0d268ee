"""Precise guidance: where it begins and ends, what is charged to it, the same in episodes and environments."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.contracts import Command, Detections, Percept, PoseEstimate, Proprioception
from auvdock.core.transforms import invert
from auvdock.envs.registration import ENVIRONMENTS
from auvdock.envs.world import DockingWorld
from auvdock.episode.config import level_cfg
from auvdock.metrics.guidance import CONFIRM, WITHIN, ConicalMetrics, GuidanceMetrics
from auvdock.metrics.tick import Tick

WORLD = DockingWorld(level_cfg(0).override({"world": {"fidelity": "beacons"}}).world, "threshold")
WORLD.reset(0)
TRUTH = WORLD.truth
T_WORLD_STATION = WORLD.simulator.T_world_station
T_TRUE = invert(T_WORLD_STATION) @ TRUTH.T_world_body @ WORLD.camera.T_body_camera
ZERO = np.zeros(3)
OWN = Proprioception(0.0, 10.0, ZERO, ZERO, ZERO, ZERO)

RIGHT, WRONG, HELD, BLIND = "right", "wrong", "held", "blind"


def tick(kind: str, away_m: float = 0.0, mode: str = "mid") -> Tick:
    """A period in which perception gave such a pose, the vehicle `away_m` further from the mouth than at the start."""
    body = TRUTH.T_world_body.copy()
    body[0, 3] += away_m
    truth = TRUTH._replace(T_world_body=body, nose_station_m=TRUTH.nose_station_m + np.array([away_m, 0.0, 0.0]))
    pose = None
    if kind != BLIND:
        T_station_camera = T_TRUE.copy()
        T_station_camera[0, 3] += away_m + (1e9 if kind == WRONG else 0.01)
        pose = PoseEstimate(T_station_camera, np.eye(6), (0, 1, 2, 3), "sqpnp", 0.5, measured=kind != HELD)
    percept = Percept(0.0, pose, None, None, 4, Detections.empty())
    return Tick(truth, OWN, None, percept, Command(np.zeros(7), mode=mode))


def of(*ticks: Tick) -> dict[str, Any]:
    metrics = ConicalMetrics(WORLD.camera, WORLD.cfg.station, T_WORLD_STATION)
    for each in ticks:
        metrics.add(each)
    return dict(metrics.fields(TRUTH))


def test_an_episode_counts_each_wrong_pose_though_the_median_is_small() -> None:
    found = of(*[tick(kind) for kind in (RIGHT, RIGHT, RIGHT, WRONG, RIGHT)])
    assert (found["measured_poses"], found["false_poses"], found["false_pose_rate"]) == (5, 1, 0.2)
    assert found["pose_error_median_m"] == pytest.approx(0.01, abs=1e-6)
    assert found["poses_by_solver"] == {"sqpnp": 5}


def test_neither_a_false_nor_a_lonely_pose_sets_the_entry() -> None:
    lonely = [tick(RIGHT, 9.0), *[tick(BLIND, 8.0)] * WITHIN]
    found = of(tick(WRONG, 9.5), *lonely, *[tick(RIGHT, away) for away in (7.0, 6.0, 5.0)])
    assert found["entry_distance_m"] == pytest.approx(TRUTH.nose_station_m[0] + 7.0)
    assert found["precise_range_m"] == pytest.approx(2.0)
    assert found["precise_frames"] == 3
    assert of(*lonely)["entry_distance_m"] is None
    assert of(*lonely)["distortion_rate"] is None


def test_a_held_pose_is_no_measurement_but_something_to_steer_by() -> None:
    found = of(*[tick(kind) for kind in (RIGHT, RIGHT, RIGHT, HELD, BLIND)])
    assert (found["precise_frames"], found["invalid_frames"], found["unavailable_frames"]) == (5, 2, 1)
    assert (found["distortion_rate"], found["distortion_available"]) == (0.4, 0.2)


def test_what_comes_after_a_go_around_does_not_lengthen_the_range() -> None:
    first = [tick(RIGHT, away) for away in (6.0, 5.0, 4.0)]
    retreat = [tick(RIGHT, 8.0, mode="abort")]
    second = [tick(RIGHT, away) for away in (5.0, 3.0, 1.0)]
    found = of(*first, *retreat, *second)
    assert found["precise_range_m"] == pytest.approx(2.0)
    assert found["precise_frames"] == 7


@settings(deadline=None)
@given(kinds=st.lists(st.sampled_from([RIGHT, WRONG, HELD, BLIND]), max_size=30))
def test_counts_agree_with_each_other(kinds: list[str]) -> None:
    metrics = GuidanceMetrics(WORLD.camera, T_WORLD_STATION)
    for kind in kinds:
        metrics.add(tick(kind))
    found, entry = metrics.fields(TRUTH), metrics.entry
    assert found["measured_poses"] == kinds.count(RIGHT) + kinds.count(WRONG)
    assert found["false_poses"] == kinds.count(WRONG)
    if entry is None:
        assert all(kinds[k : k + WITHIN].count(RIGHT) < CONFIRM for k in range(len(kinds)) if kinds[k] == RIGHT)
        assert found["precise_frames"] == 0
    else:
        after = kinds[entry:]
        assert after[0] == RIGHT
        assert after[:WITHIN].count(RIGHT) >= CONFIRM
        assert found["precise_frames"] == len(after)
        assert found["invalid_frames"] == after.count(HELD) + after.count(BLIND)
        assert found["unavailable_frames"] == after.count(BLIND)


@pytest.mark.parametrize("observation", ["state", "pose"])
@pytest.mark.parametrize("kind", ["Conical", "RotatingBeacon", "Landing"])
def test_the_last_info_of_an_episode_has_its_metrics(kind: str, observation: str) -> None:
    name = next(name for name in ENVIRONMENTS if name.startswith(f"auvdock/{kind}Docking"))
    env = gymnasium.make(name, observation=observation, fidelity="beacons", time_limit_s=0.5)
    _, info = env.reset(seed=1)
    assert "entry_distance_m" not in info
    ended = False
    while not ended:
        assert "entry_distance_m" not in info
        _, _, terminated, truncated, info = env.step(np.zeros(env.action_space.shape or ()))
        ended = terminated or truncated
    assert {"distortion_rate", "distortion_available", "entry_distance_m", "false_pose_rate"} <= set(info)
    assert info["path_length_m"] > 0.0
    if observation == "state":
        assert info["measured_poses"] == 0  # nobody looks
    elif kind == "Conical":
        assert info["measured_poses"] > 0
    env.close()
