"""Level I: names of lights with dead, hidden and false ones; refusals; the bearing to the group."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from landing_scenes import CAMERA, LIGHTS, STATION, Descent, Senses

from auvdock.core.arrays import Array
from auvdock.core.contracts import BLUE, Detections
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.perception.landing.bearing import group_bearing
from auvdock.perception.landing.config import AttitudeCfg, LandingPerceptionCfg, LightLevelCfg
from auvdock.perception.landing.evidence import log_odds
from auvdock.perception.landing.level import LevelSolver, pose_offset
from auvdock.perception.landing.lights import LightLevel
from auvdock.perception.tracker import LightTracker, TrackerCfg

LEVEL = LightLevel(LightLevelCfg(), STATION, CAMERA, LevelSolver(AttitudeCfg(), CAMERA))


def sight(seed: int, tilt_error_deg: float = 0.2, heading_error_deg: float = 1.0) -> tuple[Array, Array, Array, float]:
    """(T_station_camera, measured attitude, pixels of the lights, measured height): all five in view."""
    rng = np.random.default_rng(seed)
    while True:
        euler = np.radians([*rng.uniform(-4.0, 4.0, 2), rng.uniform(-45.0, 45.0)])
        height = rng.uniform(2.6, 6.3)
        position = np.array([*rng.uniform(-0.3, 0.3, 2) * height, height])
        body = make_transform(rotation_from_euler_zyx(*euler.tolist()), position)
        T = body @ CAMERA.T_body_camera
        q = (LIGHTS - T[:3, 3]) @ T[:3, :3]
        if CAMERA.in_view(q).all():
            break
    error = np.radians([*rng.normal(0.0, tilt_error_deg, 2), rng.normal(0.0, heading_error_deg)])
    attitude = rotation_from_euler_zyx(*(euler + error).tolist()) @ CAMERA.T_body_camera[:3, :3]
    return T, attitude, CAMERA.project(q), float(T[2, 3] + rng.normal(0.0, 0.03))


def seen(pixels: Array, rng: np.random.Generator, stray: int = 0, sigma_px: float = 0.05) -> Detections:
    """Noisy pixels and strays, shuffled."""
    spots = np.vstack([pixels + rng.normal(0.0, sigma_px, pixels.shape), rng.uniform(0.0, (800.0, 600.0), (stray, 2))])
    spots = spots[rng.permutation(len(spots))]
    return Detections.from_points(spots, np.full(len(spots), 0.9), np.full(len(spots), BLUE), 0.01)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), stray=st.integers(0, 5))
def test_all_five(seed: int, stray: int):
    """Five lights among up to five strays: right pose (0.15 m, 0.5°, five of its σ), every light named."""
    T, attitude, pixels, height = sight(seed)
    found = LEVEL.find(seen(pixels, np.random.default_rng(seed), stray), attitude, height)
    assert found is not None
    assert found.count >= 4
    error = pose_offset(T, found.pose.T_station_camera)
    assert float(np.abs(error[:3]).max()) < 0.15
    assert float(np.abs(error[5])) < math.radians(0.5)
    assert float(error @ np.linalg.solve(found.pose.estimate.covariance, error)) < 60.0


def test_two_dead_lights():
    """Any three of the five give the right pose or none; most give one."""
    given_up = 0
    total = 0
    for seed in range(60):
        T, attitude, pixels, height = sight(seed)
        rng = np.random.default_rng(seed)
        kept = np.sort(rng.permutation(5)[:3])
        found = LEVEL.find(seen(pixels[kept], rng), attitude, height)
        total += 1
        if found is None:
            given_up += 1
            continue
        assert float(np.abs(pose_offset(T, found.pose.T_station_camera)[:3]).max()) < 0.25
    assert given_up <= 0.1 * total


def test_strays_alone_give_no_pose():
    """Eight random spots: a first pose needs three consecutive frames that agree, and never gets them."""
    rng = np.random.default_rng(1)
    senses = Senses(Descent(np.array([0.0, 0.0, 4.0]), 0.0, 4.0), rng)
    estimator = LandingEstimator(LandingPerceptionCfg(), CAMERA, STATION)
    for k in range(200):
        spots = rng.uniform(0.0, (800.0, 600.0), (8, 2))
        detections = Detections.from_points(spots, np.full(8, 0.9), np.full(8, BLUE), 0.01)
        assert estimator.update(detections, (), senses.proprioception(k / 20)).pose is None


HOVER_M = 2.0


@cache
def chance_pictures() -> list[Array]:
    """Forty pictures of twelve strays in which three happen to fit some pose from `HOVER_M` above: two in five do."""
    rng = np.random.default_rng(11)
    found: list[Array] = []
    while len(found) < 40:
        spots = rng.uniform(0.0, (800.0, 600.0), (12, 2))
        named = LEVEL.find(spots_seen(spots), CAMERA.T_body_camera[:3, :3], HOVER_M)
        if named is not None and named.count == 3:
            found.append(spots)
    return found


def spots_seen(spots: Array) -> Detections:
    return Detections.from_points(spots, np.full(len(spots), 0.9), np.full(len(spots), BLUE), 0.01)


def test_odds_are_a_promise():
    """Strays alone reach odds of T in no more than one of T frames (Markov); three lights among six mostly do."""
    level = LightLevel(LightLevelCfg(min_odds=10.0), STATION, CAMERA, LevelSolver(AttitudeCfg(), CAMERA))
    rng = np.random.default_rng(11)
    pictures = map(spots_seen, chance_pictures())
    strays = [level.find(spots, CAMERA.T_body_camera[:3, :3], HOVER_M) for spots in pictures]
    # Of some 100 pictures 10 at most in the mean; 20 are beyond 0.2 % of Poisson's law.
    assert sum(found is not None and found.convincing for found in strays) <= 20
    T, attitude, pixels, height = sight(11)
    right = 0
    for _ in range(20):
        found = LEVEL.find(seen(pixels[[0, 2, 3]], rng, 6), attitude, height)
        if found is not None and found.convincing:
            assert float(np.abs(pose_offset(T, found.pose.T_station_camera)[:3]).max()) < 0.2
            right += 1
    assert right >= 15


def test_more_lights_are_better_evidence():
    """Odds rise with each light that fits, and fall with noise and with the number of spots."""
    T, attitude, pixels, _ = sight(12)
    solver = LevelSolver(AttitudeCfg(), CAMERA)

    def odds(n: int, spots_n: int, sigma_px: float, off_px: float) -> float:
        shifted = pixels[:n] + off_px * np.array([1.0, -1.0]) * (-1.0) ** np.arange(n)[:, None]
        sigma = np.full(n, sigma_px)
        pose = solver.solve(LIGHTS[:n], shifted, sigma, attitude, T, (), "")
        assert pose is not None
        return log_odds(pose, sigma, 5, spots_n, (800, 600), 10.0)

    assert odds(3, 12, 0.05, 0.0) < odds(4, 12, 0.05, 0.0) < odds(5, 12, 0.05, 0.0)
    assert odds(4, 12, 0.05, 0.0) > odds(4, 40, 0.05, 0.0)
    assert odds(4, 12, 0.05, 0.0) > odds(4, 12, 0.5, 0.0)
    assert odds(4, 12, 0.05, 0.0) > odds(4, 12, 0.05, 1.0)


def test_strays_that_stay_give_no_pose():
    """A chance picture that stays, as snow and foreign lights do, agrees from frame to frame; it is no station."""
    rng = np.random.default_rng(2)
    senses = Senses(Descent(np.array([0.0, 0.0, HOVER_M]), 0.0, HOVER_M), rng)
    estimator = LandingEstimator(LandingPerceptionCfg(), CAMERA, STATION)
    for picture in chance_pictures()[:12]:
        estimator.reset()
        for k in range(5):
            percept = estimator.update(spots_seen(picture), (), senses.proprioception(k / 20))
            assert percept.pose is None


def test_strays_do_not_move_a_pose():
    """Lights gone, strays in their stead: refused poses that contradict one another restart nothing."""
    rng = np.random.default_rng(3)
    flight = Descent(np.array([0.1, -0.1, HOVER_M]), 0.0, HOVER_M)
    senses = Senses(flight, rng)
    cfg = LandingPerceptionCfg(lights=LightLevelCfg(min_odds=1e-300))
    estimator = LandingEstimator(cfg, CAMERA, STATION)
    strays = chance_pictures()[:25]
    for k in range(20 + len(strays)):
        t = k / 20
        lights = senses.lights(t) if k < 20 else spots_seen(strays[k - 20])
        percept = estimator.update(lights, (), senses.proprioception(t))
        if percept.pose is not None:
            gap = percept.pose.T_station_camera[:3, 3] - flight.camera(t)[:3, 3]
            assert float(np.linalg.norm(gap)) < 0.1
    assert percept.status == "holding"


def test_a_mirrored_or_scaled_pattern_is_refused():
    """What is no view of the station has no pose: the pattern mirrored, or at twice the height of the gauge."""
    T, attitude, pixels, height = sight(4)
    rng = np.random.default_rng(4)
    mirrored = pixels.copy()
    mirrored[:, 1] = 2.0 * mirrored[:, 1].mean() - mirrored[:, 1]
    found = LEVEL.find(seen(mirrored, rng), attitude, height)
    assert found is None or found.count < 4
    assert LEVEL.find(seen(pixels, rng), attitude, 2.0 * float(T[2, 3])) is None


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_few(n: int):
    T, attitude, pixels, height = sight(2)
    detections = seen(pixels[:n], np.random.default_rng(0))
    assert LEVEL.find(detections, attitude, height) is None
    assert LEVEL.follow(detections, attitude, T, 1e-6 * np.eye(6)) is None


def test_follow_with_strays_and_dead_lights():
    """Where the lights are expected to 2 cm, three of them among ten strays mostly do, and never mislead."""
    lost = 0
    for seed in range(40):
        T, attitude, pixels, _ = sight(seed)
        rng = np.random.default_rng(seed)
        kept = np.sort(rng.permutation(5)[:3])
        expected = T.copy()
        expected[:3, 3] += rng.normal(0.0, 0.02, 3)
        found = LEVEL.follow(seen(pixels[kept], rng, 10), attitude, expected, np.diag([0.02**2] * 3 + [0.003**2] * 3))
        lost += found is None
        if found is not None:
            assert float(np.abs(pose_offset(T, found.pose.T_station_camera)[:3]).max()) < 0.1
    assert lost <= 4


def test_group_bearing():
    """Direction to the lights' centre within 2°, range within a fifth; nothing from nothing."""
    tracks = LightTracker(TrackerCfg(), 20.0, 800, 600)
    assert group_bearing(tracks, CAMERA, LIGHTS) is None
    T, _, pixels, _ = sight(3)
    rng = np.random.default_rng(3)
    for _ in range(4):
        tracks.update(seen(pixels, rng))
    bearing = group_bearing(tracks, CAMERA, LIGHTS)
    assert bearing is not None
    assert bearing.range_m is not None
    centre = (LIGHTS.mean(axis=0) - T[:3, 3]) @ T[:3, :3]
    distance = float(np.linalg.norm(centre))
    assert float(bearing.ray_camera @ centre) / distance > math.cos(math.radians(2.0))
    assert bearing.range_m == pytest.approx(distance, rel=0.2)
