"""Projection, derivatives and rotations of the refinement against OpenCV's."""

import cv2
import numpy as np
import pytest

from auvdock.perception.pnp_refine import _cholesky, _project, _substitute, left_jacobian, rotation_of, vector_of

LENS = (350.0, 347.0, 321.0, 177.5)
MATRIX = np.array([[350.0, 0.0, 321.0], [0.0, 347.0, 177.5], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.31, 0.12, 0.0, 0.0, -0.02), (-0.2, 0.1, 0.003, -0.002, 0.01)])
def test_pixels_and_derivatives_are_opencvs(distortion):
    rng = np.random.default_rng(5)
    terms = np.array(distortion)
    for _ in range(20):
        pose = np.concatenate([rng.normal(size=3), rng.uniform((-1.0, -1.0, 3.0), (1.0, 1.0, 9.0))])
        points = rng.uniform(-1.0, 1.0, (7, 3))
        pixels, jacobian = np.empty((7, 2)), np.empty((7, 2, 6))
        _project(pose, points, np.array([*LENS, *distortion, 0.0]), pixels, jacobian)
        wanted, derivatives = cv2.projectPoints(points, pose[:3], pose[3:], MATRIX, terms)
        assert pixels == pytest.approx(wanted.reshape(7, 2), abs=1e-9)
        assert jacobian.reshape(14, 6) == pytest.approx(derivatives[:, :6], rel=1e-9, abs=1e-7)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.7, 3.1])
def test_rotation_is_opencvs_and_its_jacobian_the_difference(size):
    rng = np.random.default_rng(6)
    vector = rng.normal(size=3)
    vector *= size / np.linalg.norm(vector)
    assert rotation_of(vector) == pytest.approx(cv2.Rodrigues(vector)[0], abs=1e-12)
    assert vector_of(rotation_of(vector)) == pytest.approx(vector, abs=1e-11)
    step = 1e-6 * rng.normal(size=3)
    turn = rotation_of(vector + step) @ rotation_of(vector - step).T
    # Of so small a turn the logarithm is the antisymmetric part.
    axis = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    assert axis == pytest.approx(2.0 * left_jacobian(vector) @ step, abs=1e-11)


def test_cholesky_solves_what_numpy_solves():
    rng = np.random.default_rng(7)
    root, right = rng.normal(size=(6, 6)), rng.normal(size=6)
    matrix = root @ root.T + 0.1 * np.eye(6)
    factor, found = matrix.copy(), right.copy()
    assert _cholesky(factor)
    assert np.tril(factor) == pytest.approx(np.linalg.cholesky(matrix))
    _substitute(factor, found)
    assert found == pytest.approx(np.linalg.solve(matrix, right))
    assert not _cholesky(matrix - 2.0 * np.linalg.eigvalsh(matrix).max() * np.eye(6))
