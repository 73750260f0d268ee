"""Filter and fusion: honest covariances, weights, dead reckoning."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from landing_scenes import CAMERA, CORNERS, LIGHTS, STATION, Descent, Senses
from scipy.stats import chi2

from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.estimation.landing.filter import LandingFilter
from auvdock.estimation.landing.fusion import agree, weighted_mean
from auvdock.perception.landing.config import AttitudeCfg, FilterCfg, LandingPerceptionCfg, TagLevelCfg
from auvdock.perception.landing.level import LevelPose, LevelSolver, pose_offset, rotated

WHITE = LandingPerceptionCfg(tag=TagLevelCfg(corner_sigma_px=0.0))
"""For corners whose noise is white and as the detector says: without the allowance for what is the same every frame."""


def level(T: Array, points: Array, sigma_px: float, attitude: Array, rng: np.random.Generator) -> LevelPose:
    pixels = CAMERA.project((points - T[:3, 3]) @ T[:3, :3]) + rng.normal(0.0, sigma_px, (len(points), 2))
    found = LevelSolver(AttitudeCfg(), CAMERA).solve(
        points, pixels, np.full(len(points), sigma_px), attitude, T, (), ""
    )
    assert found is not None
    return found


def measured_attitude(own: Proprioception) -> Array:
    """R_station_camera by inclinometer and compass."""
    return rotation_from_euler_zyx(*own.euler_zyx_rad.tolist()) @ CAMERA.T_body_camera[:3, :3]


def test_filter_is_consistent():
    """Mean NEES over ξ, η, ζ, ψ of 12 flights at three times within the 99.9 % band of χ² with 4 × 12 degrees.

    The upper bound is what counts: beyond it the filter would claim too much. Birge's factor, never below 1, makes it
    claim up to a third too little, and the lower bound allows for that.
    """
    times = (1.5, 3.0, 4.5)
    sums = np.zeros(len(times))
    flights = 12
    for seed in range(flights):
        rng = np.random.default_rng([9, seed])
        start = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(3.0, 5.0)])
        flight = Descent(start, math.radians(rng.uniform(-40.0, 40.0)), 0.5, 2.5)
        senses = Senses(flight, rng)
        estimator = LandingEstimator(WHITE, CAMERA, STATION)
        for k in range(round(20 * times[-1]) + 1):
            t = k / 20
            percept = estimator.update(senses.lights(t), senses.tags(t), senses.proprioception(t))
            if t in times:
                assert percept.pose is not None
                error = pose_offset(flight.camera(t), percept.pose.T_station_camera)[[0, 1, 2, 5]]
                covariance = percept.pose.covariance[np.ix_([0, 1, 2, 5], [0, 1, 2, 5])]
                sums[times.index(t)] += float(error @ np.linalg.solve(covariance, error))
    high = float(chi2.ppf(0.999, 4 * flights))
    low = float(chi2.ppf(0.001, 4 * flights)) / 1.5
    assert sums.max() < high
    assert sums.min() > low


def test_dead_reckoning():
    """10 s without any measurement: within four of its own standard deviations, and within 30 mm."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        flight = Descent(np.array([0.3, -0.2, 3.0]), 0.4, 0.5)
        senses = Senses(flight, rng)
        held = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERA)
        first = senses.proprioception(0.0)
        held.start([level(flight.camera(0.0), CORNERS, 0.02, measured_attitude(first), rng)], first)
        for k in range(1, 201):
            own = senses.proprioception(k / 20)
            held.predict(own)
        pose, covariance = held.pose(own)
        error = pose_offset(flight.camera(10.0), pose)
        assert (np.abs(error[:3]) < 4.0 * np.sqrt(np.diag(covariance)[:3])).all()
        start_error = 0.04
        assert float(np.abs(error[:3]).max()) < 0.03 + start_error


def test_the_same_sample_again_moves_nothing():
    """Perception asks where the tag is to be expected before the frame itself comes."""
    rng = np.random.default_rng(1)
    flight = Descent(np.array([0.3, -0.2, 3.0]), 0.4, 0.5)
    senses = Senses(flight, rng)
    held = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERA)
    first, second = senses.proprioception(0.0), senses.proprioception(0.05)
    assert held.expected(first) is None
    assert not held.running
    with pytest.raises(ValueError, match="no state"):
        held.pose(first)
    held.start([level(flight.camera(0.0), LIGHTS, 0.1, measured_attitude(first), rng)], first)
    before = held.pose(first)
    expected = held.expected(second)
    assert expected is not None
    assert not np.array_equal(expected[0], before[0])
    for a, b in zip(expected, held.expected(second) or (), strict=True):
        np.testing.assert_array_equal(a, b)


def test_two_levels_at_once_and_one_after_the_other_say_the_same():
    """The filter begun with both, against that begun with one which takes in the other; no noise of tilt."""
    rng = np.random.default_rng(5)
    flight = Descent(np.array([0.1, 0.1, 2.4]), 0.1, 2.4)
    T, own = flight.camera(0.0), Senses(flight, rng).proprioception(0.0)
    lights, tag = (level(T, points, 0.1, T[:3, :3], rng) for points in (LIGHTS, CORNERS))
    answers: list[tuple[Array, Array]] = []
    for first, second in (([lights, tag], []), ([lights], [tag]), ([tag], [lights])):
        held = LandingFilter(FilterCfg(), AttitudeCfg(tilt_noise_deg=1e-4), CAMERA)
        held.start(first, own)
        if second:
            held.update([held.compare(second[0], own)])
        answers.append(held.pose(own))
    for pose, covariance in answers[1:]:
        sigma = np.sqrt(np.diag(answers[0][1]))
        np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sigma, rtol=0.01)
        assert (np.abs(pose_offset(answers[0][0], pose)) < 0.1 * sigma).all()


def test_weighted_mean_is_consistent_and_no_worse_than_either():
    """P_out = K1 P_L + K2 P_A: its covariance is at most either's, and its NEES over 300 frames that of χ²(6)."""
    rng = np.random.default_rng(2)
    T = Descent(np.array([0.1, 0.1, 2.4]), 0.1, 2.4).camera(0.0)
    nees: list[float] = []
    for _ in range(300):
        tilt = np.radians(np.hypot(0.1, 0.2)) * rng.standard_normal(3)
        attitude = rotated(T[:3, :3], tilt)
        lights, tag = level(T, LIGHTS, 0.3, attitude, rng), level(T, CORNERS, 0.3, attitude, rng)
        pose, covariance = weighted_mean(lights, tag)
        error = pose_offset(T, pose)
        nees.append(float(error @ np.linalg.solve(covariance, error)))
        for one in (lights, tag):
            assert np.linalg.eigvalsh(one.estimate.covariance - covariance).min() > -1e-9
    assert 0.7 * 6.0 < float(np.mean(nees)) < 1.1 * 6.0


def test_a_sure_level_takes_all_the_weight():
    """K2 → I where the lights know next to nothing, K2 → 0 where the tag does."""
    rng = np.random.default_rng(3)
    T = Descent(np.array([0.0, 0.0, 2.4]), 0.0, 2.4).camera(0.0)
    for light_px, tag_px, winner in ((20.0, 0.01, 1), (0.01, 20.0, 0)):
        both = level(T, LIGHTS, light_px, T[:3, :3], rng), level(T, CORNERS, tag_px, T[:3, :3], rng)
        pose, _ = weighted_mean(*both)
        offset = pose_offset(both[winner].T_station_camera, pose)
        assert float(np.abs(offset[:3]).max()) < 1e-3


def test_levels_that_disagree():
    rng = np.random.default_rng(4)
    T = Descent(np.array([0.0, 0.0, 2.4]), 0.0, 2.4).camera(0.0)
    moved = T.copy()
    moved[0, 3] += 0.1
    lights = level(T, LIGHTS, 0.1, T[:3, :3], rng)
    assert agree(lights, level(T, CORNERS, 0.1, T[:3, :3], rng), 27.9)
    assert not agree(lights, level(moved, CORNERS, 0.1, T[:3, :3], rng), 27.9)


def test_without_bottom_lock_the_covariance_grows_faster():
    """One second by a velocity 0.3 s old: 2 (0.15 × 0.3)² 0.3 m² more variance of each coordinate."""
    flight = Descent(np.array([0.0, 0.0, 3.0]), 0.0, 0.5, 2.5)
    start = Senses(flight, np.random.default_rng(0)).proprioception(0.0)
    ahead: list[Array] = []
    for age_s in (0.0, 0.3):
        found = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERA)
        found.place(make_transform(measured_attitude(start), np.array([0.0, 0.0, 3.0])), 1e-4 * np.eye(6), start)
        expected = found.expected(dataclasses.replace(start, time_s=1.0, ground_age_s=age_s))
        assert expected is not None
        ahead.append(np.diag(expected[1])[:3])
    np.testing.assert_allclose(ahead[1] - ahead[0], 2.0 * 0.045**2 * 0.3, rtol=1e-6)
