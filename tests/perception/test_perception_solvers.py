"""Degenerate input: every geometric solver answers "no pose", or one of finite numbers in front of the camera."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from landing_scenes import CAMERA as BELLY
from landing_scenes import CORNERS, LIGHTS, STATION
from perception_scenes import ARRAY, CAMERA, LAYOUT, all_in_view, pixels_of, random_motion

from auvdock.core.arrays import Array
from auvdock.core.contracts import BLUE, Detections, Frame, TagDetection
from auvdock.core.linear import solve_positive
from auvdock.core.transforms import invert, make_transform
from auvdock.perception.credibility import CredibilityCfg
from auvdock.perception.hungarian_ransac import HungarianRansacAssociation, HungarianRansacCfg
from auvdock.perception.landing.config import AttitudeCfg, LightLevelCfg, TagLevelCfg
from auvdock.perception.landing.level import LevelPose, LevelSolver
from auvdock.perception.landing.lights import LightLevel
from auvdock.perception.landing.tag import TagLevel
from auvdock.perception.landing.tag_edges import refined_corners
from auvdock.perception.pnp import Attitude, PnpCfg, PnpSolution, PnpSolver, light_table
from auvdock.perception.rpnp import rpnp, rpnp_poses
from auvdock.perception.solvers import homography, project, ransac, solve_pnp, solve_square
from auvdock.perception.tracker import LightTracker, TrackerCfg

POINTS = np.ascontiguousarray(LAYOUT.positions_m[ARRAY])
SOLVERS = [PnpSolver(PnpCfg(), CAMERA), PnpSolver(PnpCfg(attitude_prior_sigma_deg=0.0), CAMERA)]
SOLVER = LevelSolver(AttitudeCfg(), BELLY)
LEVEL, TAG = LightLevel(LightLevelCfg(), STATION, BELLY, SOLVER), TagLevel(TagLevelCfg(), STATION.tag, BELLY, SOLVER)
SIGMA_PX = 0.5
ATTITUDE = BELLY.T_body_camera[:3, :3]

Spoiler = Callable[[Array, np.random.Generator], Array]


def coinciding(pixels: Array, rng: np.random.Generator) -> Array:
    return np.tile(pixels[:1], (len(pixels), 1))


def nearly_coinciding(pixels: Array, rng: np.random.Generator) -> Array:
    """Within a tenth of the noise, or far less."""
    return pixels[:1] + 0.1 * SIGMA_PX * 10.0 ** rng.uniform(-9.0, 0.0) * rng.uniform(-1.0, 1.0, pixels.shape)


def collinear(pixels: Array, rng: np.random.Generator) -> Array:
    """On one line to a tenth of the noise, in any direction."""
    along = rng.normal(size=2)
    share = rng.uniform(-150.0, 150.0, len(pixels))
    on_line = np.outer(share, along / np.linalg.norm(along))
    return pixels.mean(axis=0) + on_line + 0.1 * SIGMA_PX * rng.uniform(-1.0, 1.0, pixels.shape)


def not_finite(pixels: Array, rng: np.random.Generator) -> Array:
    spoilt = pixels.copy()
    spoilt[rng.integers(len(pixels)), rng.integers(2)] = rng.choice([np.nan, np.inf, -np.inf])
    return spoilt


def far_outside(pixels: Array, rng: np.random.Generator) -> Array:
    """Where no lens images anything."""
    return pixels + 10.0 ** rng.uniform(4.0, 100.0) * rng.choice([-1.0, 1.0], pixels.shape)


def at_the_edges(pixels: Array, rng: np.random.Generator) -> Array:
    edges = np.array([(x, y) for x in (-0.5, 0.0, 639.5, 800.0) for y in (-0.5, 0.0, 359.5, 600.0)])
    return edges[rng.permutation(len(edges))[: len(pixels)]]


def any_pixels(pixels: Array, rng: np.random.Generator) -> Array:
    """Anything at all, one point given twice."""
    spoilt = pixels + 10.0 ** rng.uniform(-2.0, 3.0) * rng.normal(size=pixels.shape)
    spoilt[0] = spoilt[-1]
    return spoilt


NO_POSE: list[Spoiler] = [coinciding, nearly_coinciding, collinear, not_finite]
ANY: list[Spoiler] = [*NO_POSE, far_outside, at_the_edges, any_pixels]
seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=30, deadline=None, derandomize=True)


def sound(solution: PnpSolution) -> bool:
    covariance = solution.covariance()
    finite = np.isfinite(np.asarray(solution.record).view(np.float64)).all()
    return bool(finite and solution.translation_m[2] > 0.0 and covariance.trace() > 0.0)


@few
@given(seed=seeds, spoil=st.sampled_from(ANY), n=st.integers(0, 6), tracked=st.booleans(), number=st.integers(0, 1))
def test_pnp(seed: int, spoil: Spoiler, n: int, tracked: bool, number: int):
    """SQPnP, iterative and from the last frame: no pose from what holds none, finite ones from the rest."""
    rng, solver = np.random.default_rng(seed), SOLVERS[number]
    T = random_motion(rng, POINTS).at(0.0)[0]
    prior, pixels = Attitude(T[:3, :3].T), pixels_of(T, POINTS)
    start = solver.solve(POINTS, pixels, np.full(6, SIGMA_PX), prior) if tracked else None
    seen = spoil(pixels[:n], rng) if n > 0 else pixels[:0]
    for solution in (
        solver.solve(POINTS[:n], seen, np.full(n, SIGMA_PX), prior, start),
        solver.plain(POINTS[:n], seen, np.full(n, SIGMA_PX), prior),
    ):
        assert solution is None or (sound(solution) and n >= 3 and spoil not in NO_POSE)


@few
@given(seed=seeds, doubled=st.integers(1, 5))
def test_one_light_twice(seed: int, doubled: int):
    """Five lights of which two are one still have their pose; three of which two are one have none."""
    rng = np.random.default_rng(seed)
    T = random_motion(rng, POINTS).at(0.0)[0]
    prior = Attitude(invert(T)[:3, :3])
    five, three = np.array([0, 1, 2, 3, 4, doubled % 5]), np.array([0, doubled, doubled])
    solution = SOLVERS[0].solve(POINTS[five], pixels_of(T, POINTS[five]), np.full(6, SIGMA_PX), prior)
    assert solution is not None
    np.testing.assert_allclose(solution.T_station_camera()[:3, 3], T[:3, 3], atol=1e-5)
    assert SOLVERS[0].solve(POINTS[three], pixels_of(T, POINTS[three]), np.full(3, SIGMA_PX), prior) is None
    assert rpnp_poses(POINTS[three], CAMERA.normalise(pixels_of(T, POINTS[three]))) == []


@few
@given(seed=seeds, spoil=st.sampled_from(ANY), n=st.integers(1, 6), line=st.booleans())
def test_rpnp_and_opencv(seed: int, spoil: Spoiler, n: int, line: bool):
    """RPnP, RANSAC and OpenCV's own on the same; no pose too for points of the object that lie on one line."""
    rng = np.random.default_rng(seed)
    T = random_motion(rng, POINTS).at(0.0)[0]
    xy = CAMERA.normalise(spoil(pixels_of(T, POINTS)[:n], rng))
    points = np.outer(np.arange(float(n)), rng.normal(size=3)) if line else POINTS[:n]
    poses = [*rpnp_poses(points, xy), *filter(None, [rpnp(points, xy)])]
    assert all(np.isfinite(pose.rotation).all() and np.isfinite(pose.translation_m).all() for pose in poses)
    solved = [
        solve_pnp(points, xy, flags, 4) for flags in (cv2.SOLVEPNP_SQPNP, cv2.SOLVEPNP_ITERATIVE, cv2.SOLVEPNP_P3P)
    ]
    assert all(np.isfinite(np.concatenate(pose)).all() for pose in solved if pose is not None)
    inliers = ransac(points, xy, iterations=20, error=0.01)
    assert inliers is None or (n >= 4 and set(inliers.tolist()) <= set(range(n)))
    if line or n < 3 or spoil in (coinciding, not_finite):
        assert poses == []
        assert solved == [None] * 3
        assert inliers is None


@few
@given(seed=seeds, spoil=st.sampled_from(ANY), n=st.integers(0, 6))
def test_hungarian_ransac(seed: int, spoil: Spoiler, n: int):
    """Two frames, so that the second is matched with the first. Of five lights one that is no number leaves four."""
    rng = np.random.default_rng(seed)
    T = random_motion(rng, POINTS).at(0.0)[0]
    assert all_in_view(T, POINTS)
    association = HungarianRansacAssociation(HungarianRansacCfg(), PnpCfg(), CredibilityCfg(), SIGMA_PX, CAMERA, LAYOUT)
    tracks = LightTracker(TrackerCfg(), 30.0, 640, 360)
    pixels = pixels_of(T, POINTS)
    for centres in (pixels, spoil(pixels[:n], rng) if n > 0 else pixels[:0]):
        found = Detections.from_points(centres, np.full(len(centres), 0.9), np.full(len(centres), BLUE), 0.01)
        answer = association.update(tracks, found, Attitude(T[:3, :3].T), np.zeros(3))
    if spoil is not_finite and n >= 5 and answer.pose is not None:
        assert answer.pose.T_station_camera == pytest.approx(T, abs=1e-3)
    else:
        assert answer.pose is None or (spoil not in NO_POSE and n >= 4 and np.isfinite(answer.pose.covariance).all())


def above(rng: np.random.Generator) -> Array:
    """(4, 4) T_station_camera of a level vehicle, all lights in view."""
    height = rng.uniform(3.0, 6.0)
    return make_transform(ATTITUDE, np.array([*rng.uniform(-0.3, 0.3, 2), height]))


def worth_it(pose: LevelPose, mark_m: Array) -> bool:
    """Finite, and three of its σ within 0.3 m or 10 % of the range."""
    covariance, T = pose.estimate.covariance, pose.T_station_camera
    range_m = float(np.linalg.norm(T[:3, 3] - mark_m))
    sigma_m = float(np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[2]))
    return bool(np.isfinite(T).all() and np.isfinite(covariance).all()) and 3.0 * sigma_m <= max(0.3, 0.1 * range_m)


@few
@given(seed=seeds, spoil=st.sampled_from(ANY), n=st.integers(0, 5), height=st.booleans())
def test_landing_lights(seed: int, spoil: Spoiler, n: int, height: bool):
    """Found without and followed with an expectation; what a pose says of its own doubt is kept."""
    rng = np.random.default_rng(seed)
    T = above(rng)
    pixels = BELLY.project((LIGHTS - T[:3, 3]) @ T[:3, :3])[:n]
    centres = spoil(pixels, rng) if n > 0 else pixels
    seen = Detections.from_points(centres, np.full(n, 0.9), np.full(n, BLUE), 0.01)
    spread = np.diag([0.05**2] * 3 + [0.01**2] * 3)
    for named in (
        LEVEL.find(seen, ATTITUDE, float(T[2, 3]) if height else None),
        LEVEL.follow(seen, ATTITUDE, T, spread),
    ):
        if named is not None:
            assert n >= 3
            assert worth_it(named.pose, LIGHTS[named.detection >= 0].mean(axis=0))
            assert spoil not in (coinciding, nearly_coinciding)


@few
@given(seed=seeds, spoil=st.sampled_from(ANY), expected=st.booleans())
def test_landing_tag(seed: int, spoil: Spoiler, expected: bool):
    """Four corners that are no square: a quadrilateral without size holds no pose at any range."""
    rng = np.random.default_rng(seed)
    T = above(rng)
    corners = spoil(BELLY.project((CORNERS - T[:3, 3]) @ T[:3, :3]), rng)
    for sigma_px in (0.05, SIGMA_PX):
        pose = TAG.measure((TagDetection(0, corners, sigma_px),), ATTITUDE, T if expected else None)
        assert pose is None or (worth_it(pose, CORNERS.mean(axis=0)) and spoil not in NO_POSE)
    half = 0.5 * STATION.tag.size_m
    square = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
    assert all(np.isfinite(np.concatenate(solved)).all() for solved in solve_square(square, BELLY.normalise(corners)))


@few
@given(seed=seeds, spoil=st.sampled_from(ANY))
def test_quadrilaterals(seed: int, spoil: Spoiler):
    """A perspective map is finite and takes corners to corners, or is none."""
    rng = np.random.default_rng(seed)
    quad = spoil(np.array([[200.0, 200.0], [260.0, 205.0], [255.0, 262.0], [198.0, 258.0]]), rng)
    target = np.array([[0.0, 0.0], [47.0, 0.0], [47.0, 47.0], [0.0, 47.0]])
    warp = homography(quad, target)
    if warp is not None:
        assert np.isfinite(warp).all()
        assert spoil not in (coinciding, not_finite)
    frame = Frame(rng.integers(0, 255, (600, 800, 3)).astype(np.uint8), 0.0, BELLY)
    if np.isfinite(quad).all() and np.abs(quad).max() < 1e4:
        refined = refined_corners(frame, quad)
        assert refined is None or (np.isfinite(refined[0]).all() and np.isfinite(refined[1]))


def test_homography_takes_corners_to_corners():
    quad = np.array([[200.0, 200.0], [260.0, 205.0], [255.0, 262.0], [198.0, 258.0]])
    target = np.array([[0.0, 0.0], [47.0, 0.0], [47.0, 47.0], [0.0, 47.0]])
    warp = homography(quad, target)
    assert warp is not None
    mapped = np.column_stack([quad, np.ones(4)]) @ warp.T
    np.testing.assert_allclose(mapped[:, :2] / mapped[:, 2:], target, atol=1e-3)


@pytest.mark.parametrize("n", [0, 1, 6])
def test_projection_takes_any_number(n: int):
    pixels, jacobian = project(POINTS[:n], np.zeros(3), np.array([0.0, 0.0, 9.0]), CAMERA.matrix, CAMERA.distortion)
    assert pixels.shape == (n, 2)
    assert jacobian.shape[0] == 2 * n
    np.testing.assert_allclose(pixels, CAMERA.project(POINTS[:n] + np.array([0.0, 0.0, 9.0])), atol=1e-9)


@pytest.mark.parametrize("spoil", [0.0, -1.0, np.nan])
def test_linear_systems(spoil: float):
    """Singular, indefinite or NaN: None; and NaN on the right."""
    matrix = np.diag([2.0, 3.0, spoil])
    assert solve_positive(matrix, np.ones(3)) is None
    assert solve_positive(np.eye(3), np.array([1.0, 2.0, np.nan])) is None
    solution = solve_positive(np.diag([2.0, 4.0]), np.ones(2))
    assert solution is not None
    np.testing.assert_allclose(solution, [0.5, 0.25])


def test_light_table_with_predicted_lights_only():
    """Predictions in place of all lights that coincide are no pose either."""
    table = light_table(POINTS, np.full((6, 2), 200.0), np.full(6, SIGMA_PX))
    table["is_seen"] = False
    assert SOLVERS[0].solve_lights(table, Attitude(np.eye(3))) is None
