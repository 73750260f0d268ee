"""Landing perception as a whole on synthetic descents: accuracy, honesty, loss of levels, refusals."""

from __future__ import annotations

import dataclasses
import math
from typing import get_args

import numpy as np
import pytest
from landing_scenes import CAMERA, STATION, Descent, Senses

from auvdock.core.arrays import Array
from auvdock.core.contracts import Detections, PoseEstimate, TagDetection
from auvdock.core.errors import ConfigError
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.perception.landing.config import Fusion, LandingPerceptionCfg
from auvdock.perception.landing.level import pose_offset


def descent(rng: np.random.Generator, end_height_m: float = 0.6) -> Descent:
    start = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(3.0, 6.0)])
    return Descent(start, math.radians(rng.uniform(-45.0, 45.0)), end_height_m)


def nees(T_true: Array, estimate: PoseEstimate) -> float:
    error = pose_offset(T_true, estimate.T_station_camera)
    return float(error @ np.linalg.solve(estimate.covariance, error))


def fly(cfg: LandingPerceptionCfg, seed: int, seconds: float = 15.0) -> list[tuple[Array, LandingPercept]]:
    """(true camera pose, percept) of every frame."""
    rng = np.random.default_rng(seed)
    flight = descent(rng)
    senses = Senses(flight, rng)
    estimator = LandingEstimator(cfg, CAMERA, STATION)
    frames: list[tuple[Array, LandingPercept]] = []
    for k in range(round(20 * seconds)):
        t = k / 20
        percept = estimator.update(senses.lights(t), senses.tags(t), senses.proprioception(t))
        frames.append((flight.camera(t), percept))
    return frames


@pytest.mark.parametrize("fusion", get_args(Fusion))
def test_descent(fusion: Fusion):
    """After 5 s: within 10 mm and 1° in 95 % of frames, the whole descent with a pose; levels hand over."""
    frames = fly(LandingPerceptionCfg(fusion=fusion), 3)
    assert all(percept.pose is not None for _, percept in frames[3:])
    late: list[Array] = []
    for T, percept in frames[100:]:
        assert percept.pose is not None
        late.append(np.abs(pose_offset(T, percept.pose.T_station_camera)))
    errors = np.array(late)
    assert float((errors[:, :3].max(axis=1) <= 0.010).mean()) >= 0.95
    assert float((errors[:, 5] <= math.radians(1.0)).mean()) >= 0.95
    seen = [percept.level for _, percept in frames]
    assert seen.index("lights") < seen.index("fused") < len(seen) - 1 - seen[::-1].index("tag")


def test_nothing_seen():
    """Searching for ever, no pose, no bearing."""
    rng = np.random.default_rng(0)
    senses = Senses(descent(rng), rng)
    estimator = LandingEstimator(LandingPerceptionCfg(), CAMERA, STATION)
    for k in range(100):
        percept = estimator.update(Detections.empty(), (), senses.proprioception(k / 20))
        assert (percept.status, percept.level, percept.pose, percept.long_range) == ("searching", "none", None, None)
        assert estimator.tag_regions(senses.proprioception(k / 20)) == ()


def test_held_then_lost_then_found_again():
    """Both levels away: held until C_L ≥ T_L and C_A ≥ T_A, then lost; the pose comes back with the tag."""
    cfg = LandingPerceptionCfg(max_missed_lights_n=30, max_missed_tag_n=20)
    rng = np.random.default_rng(5)
    flight = descent(rng)
    senses = Senses(flight, rng)
    estimator = LandingEstimator(cfg, CAMERA, STATION)
    status: list[str] = []
    for k in range(200):
        t = k / 20
        blind = 100 <= k < 150
        lights = Detections.empty() if blind else senses.lights(t)
        percept = estimator.update(lights, () if blind else senses.tags(t), senses.proprioception(t))
        status.append(percept.status)
        assert (percept.pose is None) == (percept.status in ("searching", "lost"))
        if percept.status == "holding":
            assert percept.pose is not None
            assert not percept.pose.measured
            assert percept.level == "none"
            error = np.abs(pose_offset(flight.camera(t), percept.pose.T_station_camera)[:3])
            assert float(error.max()) < 0.03
    assert status[99] == "tracking"
    lost = status.index("lost")
    # The lights may have left the view before frame 100, so the later of the two limits decides.
    assert 100 + 19 <= lost <= 100 + 30
    assert set(status[100:lost]) == {"holding"}
    assert set(status[lost:150]) == {"lost"}
    assert status[150] == "tracking"


def test_one_level_is_enough():
    """Remark 2: with the lights away for good the tag alone keeps the pose, and the other way round."""
    for gone in ("lights", "tag"):
        rng = np.random.default_rng(7)
        flight = dataclasses.replace(descent(rng), end_height_m=1.6)
        senses = Senses(flight, rng)
        estimator = LandingEstimator(LandingPerceptionCfg(max_missed_lights_n=10, max_missed_tag_n=10), CAMERA, STATION)
        for k in range(200):
            t = k / 20
            lights = Detections.empty() if gone == "lights" and k >= 100 else senses.lights(t)
            tags = () if gone == "tag" and k >= 100 else senses.tags(t)
            percept = estimator.update(lights, tags, senses.proprioception(t))
            if k >= 100:
                assert (percept.status, percept.level) == ("tracking", "tag" if gone == "lights" else "lights")


def test_one_wrong_pose_is_refused_and_a_lasting_one_believed():
    """The tag seems to lie 0.3 m off: single frames change nothing, `reset_after_n` in a row start the belief anew."""
    rng = np.random.default_rng(3)
    flight = Descent(np.array([0.0, 0.0, 2.0]), 0.0, 2.0)
    senses = Senses(flight, rng)
    cfg = LandingPerceptionCfg(levels="tag")
    estimator = LandingEstimator(cfg, CAMERA, STATION)
    shift_px = 0.3 / 2.0 * float(CAMERA.matrix[0, 0])
    patience = cfg.filter.reset_after_n
    for k in range(60 + patience):
        (tag,) = senses.tags(k / 20)
        wrong = k in (30, 40) or k >= 60
        if wrong:
            tag = dataclasses.replace(tag, corners_px=tag.corners_px + np.array([0.0, shift_px]))
        percept = estimator.update(Detections.empty(), (tag,), senses.proprioception(k / 20))
        assert percept.pose is not None
        error_m = float(np.linalg.norm(percept.pose.T_station_camera[:3, 3] - flight.camera(k / 20)[:3, 3]))
        last = k == 59 + patience
        assert percept.pose.measured is (not wrong or last)
        assert percept.restarts == (1 if last else 0)
        assert (error_m > 0.2) is last


def test_other_tags_are_ignored():
    rng = np.random.default_rng(2)
    flight = Descent(np.array([0.0, 0.0, 2.0]), 0.0, 2.0)
    senses = Senses(flight, rng)
    estimator = LandingEstimator(LandingPerceptionCfg(levels="tag"), CAMERA, STATION)
    for k in range(20):
        (tag,) = senses.tags(k / 20)
        other = TagDetection(tag.tag_id + 1, tag.corners_px, tag.sigma_px)
        percept = estimator.update(Detections.empty(), (other,), senses.proprioception(k / 20))
        assert percept.pose is None


@pytest.mark.parametrize(
    ("field", "value"),
    [("levels", "tags"), ("fusion", "mean"), ("max_missed_tag_n", 0), ("max_missed_lights_n", 0)],
)
def test_refusals(field: str, value: object):
    with pytest.raises(ConfigError, match=f"^{field}: "):
        LandingPerceptionCfg(**{field: value})  # type: ignore[arg-type]
