"""RPnP: exact on exact data, no worse than OpenCV's EPnP with noise, and silent on points that determine nothing."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.arrays import Array
from auvdock.core.transforms import rotation_from_quat_wxyz
from auvdock.perception.rpnp import rpnp, rpnp_poses

FOCAL_PX = 850.0
KINDS = ("ordinary", "quasi-singular", "quasi-planar", "planar")


def scene(kind: str, n: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """(points (n, 3), R, t): the random scenes of Lepetit et al. (2009) and Li et al. (2012), planes besides."""
    quat = rng.normal(size=4)
    R = rotation_from_quat_wxyz(quat / np.linalg.norm(quat))
    if kind in ("ordinary", "quasi-singular"):
        low = -2.0 if kind == "ordinary" else 1.0
        camera = np.column_stack([rng.uniform(low, 2.0, (n, 2)), rng.uniform(4.0, 8.0, n)])
        t = camera.mean(axis=0)
        return (camera - t) @ R, R, t
    thickness = 0.05 if kind == "quasi-planar" else 0.0
    points = np.column_stack([rng.uniform(-2.0, 2.0, (n, 2)), rng.uniform(-thickness, thickness, n)])
    return points, R, np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(5.0, 9.0)])


def image(points: Array, R: Array, t: Array) -> Array:
    camera = points @ R.T + t
    return camera[:, :2] / camera[:, 2:]


def turn_deg(a: Array, b: Array) -> float:
    return math.degrees(2.0 * math.asin(min(1.0, float(np.linalg.norm(a - b)) / math.sqrt(8.0))))


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(KINDS), n=st.integers(4, 12))
def test_round_trip(seed: int, kind: str, n: int):
    """Exact images give a pose that images the points to 1e-9, and the true one where no other does so."""
    points, R, t = scene(kind, n, np.random.default_rng(seed))
    xy = image(points, R, t)
    pose = rpnp(points, xy)
    assert pose is not None
    assert pose.error < 1e-9
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(pose.rotation) == pytest.approx(1.0, abs=1e-9)
    if n >= 6:
        assert turn_deg(pose.rotation, R) < 1e-4
        np.testing.assert_allclose(pose.translation_m, t, atol=1e-6)


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_three_points_keep_the_true_pose_among_up_to_four(seed: int):
    points, R, t = scene("ordinary", 3, np.random.default_rng(seed))
    xy = image(points, R, t)
    assert rpnp(points, xy) is None
    candidates = rpnp_poses(points, xy)
    assert 1 <= len(candidates) <= 4
    assert min(turn_deg(pose.rotation, R) for pose in candidates) < 0.05
    best = min(candidates, key=lambda pose: turn_deg(pose.rotation, R))
    np.testing.assert_allclose(best.translation_m, t, rtol=1e-3, atol=1e-3)


def medians(kind: str, n: int, noise_px: float, count: int) -> dict[str, tuple[float, float]]:
    """Median rotation error in degrees and relative translation error of each solver over the same scenes."""
    rng = np.random.default_rng([n, round(10 * noise_px), KINDS.index(kind)])
    solvers = {"epnp": cv2.SOLVEPNP_EPNP, "sqpnp": cv2.SOLVEPNP_SQPNP}
    if n >= 6 or kind == "planar":
        solvers["iterative"] = cv2.SOLVEPNP_ITERATIVE
    if kind == "planar":
        solvers["ippe"] = cv2.SOLVEPNP_IPPE
    errors: dict[str, list[tuple[float, float]]] = {}
    for _ in range(count):
        points, R, t = scene(kind, n, rng)
        xy = image(points, R, t) + rng.normal(0.0, noise_px / FOCAL_PX, (n, 2))
        for polish in (True, False):
            pose = rpnp(points, xy, polish=polish)
            assert pose is not None
            error = (turn_deg(pose.rotation, R), float(np.linalg.norm(pose.translation_m - t) / np.linalg.norm(t)))
            errors.setdefault("rpnp" if polish else "bare", []).append(error)
        for name, flag in solvers.items():
            ok, vector, translation = cv2.solvePnP(points, xy, np.eye(3), None, flags=flag)
            rotation = np.asarray(cv2.Rodrigues(vector)[0], dtype=np.float64)
            away = float(np.linalg.norm(translation.ravel() - t) / np.linalg.norm(t))
            errors.setdefault(name, []).append((turn_deg(rotation, R), away) if ok else (180.0, 1.0))
    return {
        name: (float(np.median([e[0] for e in v])), float(np.median([e[1] for e in v]))) for name, v in errors.items()
    }


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("n", "noise_px"), [(4, 1.0), (5, 0.5), (6, 2.0)])
def test_noise(kind: str, n: int, noise_px: float):
    """Median errors over 100 scenes at most EPnP's, within 1.2 of the best of OpenCV's solvers; bare RPnP within 2."""
    found = medians(kind, n, noise_px, 100)
    others = [value for name, value in found.items() if name not in ("rpnp", "bare")]
    for axis in range(2):
        assert found["rpnp"][axis] <= found["epnp"][axis]
        assert found["rpnp"][axis] <= 1.2 * min(value[axis] for value in others)
        assert found["bare"][axis] <= 2.0 * min(value[axis] for value in others)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_few(n: int):
    assert rpnp_poses(np.zeros((n, 3)), np.zeros((n, 2))) == []
    assert rpnp(np.zeros((n, 3)), np.zeros((n, 2))) is None


def test_degenerate():
    """Points that coincide, points on a line, rays that coincide, numbers that are none."""
    line = np.outer(np.linspace(-1.0, 1.0, 5), [1.0, 2.0, 0.5])
    camera = line + np.array([0.0, 0.0, 5.0])
    assert rpnp(line, camera[:, :2] / camera[:, 2:]) is None
    assert rpnp(np.ones((5, 3)), np.zeros((5, 2))) is None
    points, R, t = scene("ordinary", 5, np.random.default_rng(0))
    assert rpnp(points, np.zeros((5, 2))) is None
    xy = image(points, R, t)
    xy[2] = np.nan
    assert rpnp(points, xy) is None


def test_shapes_are_checked():
    with pytest.raises(ValueError, match="xy"):
        rpnp(np.zeros((5, 3)), np.zeros((4, 2)))
