"""The shared maths against SciPy, OpenCV, NumPy and finite differences."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from auvdock.core.transforms import rotation_from_euler_zyx, rotation_from_quat_wxyz
from auvdock.numeric import constants
from auvdock.numeric.cholesky import factorise, forward, solve
from auvdock.numeric.lens import pixel_of, slopes, tangents_of
from auvdock.numeric.rotations import (
    back,
    headed,
    left_jacobian,
    rotation_of,
    rotation_of_euler_zyx,
    rotation_of_quat_wxyz,
    sine_axis,
    vector_of,
)
from auvdock.numeric.scalars import cross, limited, within_pi
from auvdock.optics.tag_pattern import tag_cells

ANGLE = st.floats(-20.0, 20.0)
PART = st.floats(-10.0, 10.0)
VECTOR = st.tuples(PART, PART, PART)
FEW = settings(max_examples=60, deadline=None)
LENS = np.array([420.0, 380.0, 321.5, 177.25, -0.12, 0.03, 1.5e-3, -2.5e-3, -4e-3])


@FEW
@given(ANGLE, ANGLE, ANGLE, VECTOR)
def test_euler_angles_and_headings_are_scipy_s(roll, pitch, yaw, vector):
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    rotation = rotation_of_euler_zyx(roll, pitch, yaw)
    np.testing.assert_allclose(rotation, expected.as_matrix(), atol=1e-14)
    # As plain Python has it: to the bit.
    np.testing.assert_array_equal(rotation, rotation_from_euler_zyx(roll, pitch, yaw))
    np.testing.assert_allclose(headed(yaw, rotation_of_euler_zyx(roll, pitch, 0.0)), rotation, atol=1e-14)
    np.testing.assert_allclose(back(rotation, np.array(vector)), expected.inv().apply(vector), atol=1e-12)


@FEW
@given(VECTOR, st.floats(-math.pi, math.pi))
def test_quaternions_are_scipy_s(axis, angle):
    size = np.linalg.norm(axis)
    if not size > 1e-3:
        return
    rotation = Rotation.from_rotvec(np.array(axis) / size * angle)
    x, y, z, w = rotation.as_quat()
    rows = np.array(rotation_of_quat_wxyz(np.array([w, x, y, z])))
    np.testing.assert_allclose(rows, rotation.as_matrix(), atol=1e-14)
    np.testing.assert_array_equal(rows, rotation_from_quat_wxyz(np.array([w, x, y, z])))


@FEW
@given(VECTOR)
def test_rotation_vectors_are_scipy_s_there_and_back(vector):
    vector = np.array(vector) * 0.25
    expected = Rotation.from_rotvec(vector)
    rotation = rotation_of(vector)
    np.testing.assert_allclose(rotation, expected.as_matrix(), atol=1e-13)
    np.testing.assert_allclose(Rotation.from_rotvec(vector_of(rotation)).as_matrix(), rotation, atol=1e-7)
    angle = expected.magnitude()
    if angle > 1e-6:
        np.testing.assert_allclose(sine_axis(rotation), expected.as_rotvec() / angle * math.sin(angle), atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 0.7, 3.1])
def test_the_left_jacobian_is_the_difference(size):
    rng = np.random.default_rng(6)
    vector = rng.normal(size=3)
    vector *= size / np.linalg.norm(vector)
    assert vector_of(rotation_of(vector)) == pytest.approx(vector, abs=1e-11)
    step = 1e-6 * rng.normal(size=3)
    turn = rotation_of(vector + step) @ rotation_of(vector - step).T
    assert Rotation.from_matrix(turn).as_rotvec() == pytest.approx(2.0 * left_jacobian(vector) @ step, abs=1e-11)


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.6, -0.8), (0.5, -0.1, 0.7), (1e-9, 0.1, 1.0)]
)
def test_half_a_turn_has_a_vector(axis):
    """Where the antisymmetric part vanishes, the vector still gives the rotation back."""
    unit = np.array(axis) / np.linalg.norm(axis)
    rotation = 2.0 * np.outer(unit, unit) - np.eye(3)
    vector = vector_of(rotation)
    assert np.linalg.norm(vector) == pytest.approx(np.pi)
    assert rotation_of(vector) == pytest.approx(rotation, abs=1e-9)
    assert vector[0] >= 0.0


@FEW
@given(st.floats(-0.9, 0.9), st.floats(-0.6, 0.6))
def test_the_lens_is_opencv_s_with_its_slopes_and_its_inverse(x, y):
    matrix = np.array([[LENS[0], 0.0, LENS[2]], [0.0, LENS[1], LENS[3]], [0.0, 0.0, 1.0]])
    expected, _ = cv2.projectPoints(np.array([[x, y, 1.0]]), np.zeros(3), np.zeros(3), matrix, LENS[4:])
    pixel = np.array(pixel_of(x, y, LENS))
    np.testing.assert_allclose(pixel, expected.ravel(), atol=1e-9)
    np.testing.assert_allclose(tangents_of(pixel[0], pixel[1], LENS), (x, y), atol=1e-8)
    h = 1e-6
    right = (np.array(pixel_of(x + h, y, LENS)) - pixel_of(x - h, y, LENS)) / (2.0 * h) / LENS[:2]
    down = (np.array(pixel_of(x, y + h, LENS)) - pixel_of(x, y - h, LENS)) / (2.0 * h) / LENS[:2]
    xx, yy, xy = slopes(x, y, LENS)
    np.testing.assert_allclose([xx, xy, xy, yy], [*right, *down], atol=1e-7)


@FEW
@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_the_factor_is_numpy_s_and_solves(size, seed):
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(size, size))
    matrix, right = half @ half.T + 0.1 * np.eye(size), rng.normal(size=size)
    factor = matrix.copy()
    factor[np.triu_indices(size, 1)] = np.nan  # not read
    assert factorise(factor)
    lower = np.tril(factor)
    np.testing.assert_allclose(lower, np.linalg.cholesky(matrix), atol=1e-10)
    one, both = right.copy(), right.copy()
    forward(factor, one)
    solve(factor, both)
    np.testing.assert_allclose(lower @ one, right, atol=1e-9)
    np.testing.assert_allclose(matrix @ both, right, atol=1e-8)
    assert not factorise(-matrix)
    matrix[size - 1, size - 1] = np.nan
    assert not factorise(matrix)


@FEW
@given(VECTOR, VECTOR, st.floats(-100.0, 100.0), st.floats(0.0, 10.0))
def test_vectors_and_numbers(a, b, value, bound):
    np.testing.assert_allclose(cross(*a, *b), np.cross(a, b), atol=1e-12)
    assert limited(value, bound) == np.clip(value, -bound, bound)
    assert within_pi(value) == pytest.approx(math.remainder(value, math.tau), abs=1e-12)


def test_the_tag_has_the_cells_that_the_family_has():
    cells = tag_cells(0)
    assert cells.shape == (constants.TAG_CELLS, constants.TAG_CELLS)
    square = cells[1:-1, 1:-1]
    assert square.shape == (constants.TAG_SQUARE_CELLS, constants.TAG_SQUARE_CELLS)
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    assert constants.TAG_SQUARE_CELLS == family.markerSize + 2
    assert cells[0].all()  # the margin is white, the border black
    assert not square[0].any()
