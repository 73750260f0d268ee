"""Filter and fusion: honest covariances, weights, dead reckoning."""

from __future__ import annotations

import math

import numpy as np
import pytest
from landing_scenes import CAMERA, CORNERS, LIGHTS, STATION, Descent, Senses
from scipy.stats import chi2

from auvdock.core.arrays import Array
from auvdock.perception.landing.config import AttitudeCfg, FilterCfg, LandingPerceptionCfg, TagLevelCfg
from auvdock.perception.landing.filter import LandingFilter
from auvdock.perception.landing.fusion import agree, weighted_mean
from auvdock.perception.landing.level import LevelPose, LevelSolver, pose_offset, rotated
from auvdock.perception.landing.pipeline import LandingPerception

WHITE = LandingPerceptionCfg(tag=TagLevelCfg(corner_sigma_px=0.0))
"""For corners whose noise is white and as the detector says: without the allowance for what is the same every frame."""


def level(T: Array, points: Array, sigma_px: float, attitude: Array, rng: np.random.Generator) -> LevelPose:
    pixels = CAMERA.project((points - T[:3, 3]) @ T[:3, :3]) + rng.normal(0.0, sigma_px, (len(points), 2))
    found = LevelSolver(AttitudeCfg(), CAMERA).solve(
        points, pixels, np.full(len(points), sigma_px), attitude, T, (), ""
    )
    assert found is not None
    return found


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
        perception = LandingPerception(WHITE, CAMERA, STATION)
        for k in range(round(20 * times[-1]) + 1):
            t = k / 20
            percept = perception.update(senses.lights(t), senses.tags(t), senses.proprioception(t))
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
        held = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERA, 0.0)
        first = senses.proprioception(0.0)
        held.start([level(flight.camera(0.0), CORNERS, 0.02, held.measured_attitude(first), rng)], first)
        for k in range(1, 201):
            own = senses.proprioception(k / 20)
            held.predict(own)
        pose, covariance = held.pose(own)
        error = pose_offset(flight.camera(10.0), pose)
        assert (np.abs(error[:3]) < 4.0 * np.sqrt(np.diag(covariance)[:3])).all()
        start_error = 0.04
        assert float(np.abs(error[:3]).max()) < 0.03 + start_error


def test_expected_leaves_the_filter_as_it_is():
    rng = np.random.default_rng(1)
    flight = Descent(np.array([0.3, -0.2, 3.0]), 0.4, 0.5)
    senses = Senses(flight, rng)
    held = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERA, 0.0)
    first, second = senses.proprioception(0.0), senses.proprioception(0.05)
    assert held.expected(first) is None
    assert not held.running
    with pytest.raises(ValueError, match="no state"):
        held.pose(first)
    held.start([level(flight.camera(0.0), LIGHTS, 0.1, held.measured_attitude(first), rng)], first)
    expected = held.expected(second)
    assert expected is not None
    again = held.expected(second)
    held.predict(second)
    for a, b, c in zip(expected, again or (), held.pose(second), strict=True):
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(a, c)


def test_a_measurement_after_a_look_ahead_counts():
    flight = Descent(np.array([0.3, -0.2, 3.0]), 0.4, 0.5)
    answers: list[tuple[Array, Array]] = []
    for looks in (True, False):
        rng = np.random.default_rng(1)
        senses = Senses(flight, rng)
        held = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERA, 0.0)
        first, second = senses.proprioception(0.0), senses.proprioception(0.05)
        attitude = held.measured_attitude(first)
        held.start([level(flight.camera(0.0), LIGHTS, 0.1, attitude, rng)], first)
        if looks:
            held.expected(second)
        held.update([level(flight.camera(0.0), CORNERS, 0.1, attitude, rng)], first)
        held.predict(second)
        answers.append(held.pose(second))
    for a, b in zip(*answers, strict=True):
        np.testing.assert_array_equal(a, b)


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
