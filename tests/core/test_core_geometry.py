"""Transforms, the marine convention and cameras: group axioms, round trips and the published fields of view."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.errors import ConfigError
from auvdock.core.linear import solve_positive
from auvdock.core.marine import flip_matrix, flip_twist, flip_vector
from auvdock.core.transforms import (
    cross,
    euler_zyx_from_rotation,
    invert,
    make_transform,
    quat_wxyz_from_rotation,
    rotation_from_euler_zyx,
    rotation_from_quat_wxyz,
    rotation_looking_along,
    wrap_angle,
)

angles = st.floats(-3.1, 3.1)
pitches = st.floats(-1.5, 1.5)


@given(angles, pitches, angles)
def test_euler_and_quaternion_round_trips(roll, pitch, yaw):
    rotation = rotation_from_euler_zyx(roll, pitch, yaw)
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)
    assert euler_zyx_from_rotation(rotation) == pytest.approx((roll, pitch, yaw), abs=1e-9)
    assert np.allclose(rotation_from_quat_wxyz(quat_wxyz_from_rotation(rotation)), rotation, atol=1e-12)


@given(angles, pitches, angles, st.tuples(angles, angles, angles))
def test_inverse_cancels(roll, pitch, yaw, translation):
    T_a_b = make_transform(rotation_from_euler_zyx(roll, pitch, yaw), np.array(translation))
    assert np.allclose(T_a_b @ invert(T_a_b), np.eye(4), atol=1e-12)


@given(st.floats(-100.0, 100.0))
def test_wrapped_angle_is_the_same_direction_within_half_a_turn(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)


def test_positive_pitch_is_nose_down_and_positive_yaw_is_to_port():
    nose = np.array([1.0, 0.0, 0.0])
    assert (rotation_from_euler_zyx(0.0, 0.1, 0.0) @ nose)[2] < 0.0
    assert (rotation_from_euler_zyx(0.0, 0.0, 0.1) @ nose)[1] > 0.0


def test_marine_axes_flip_is_half_a_turn_about_x_and_its_own_inverse():
    half_turn = rotation_from_euler_zyx(math.pi, 0.0, 0.0)
    vector = np.array([1.0, 2.0, 3.0])
    assert np.allclose(flip_vector(vector), half_turn @ vector, atol=1e-12)
    matrix = np.arange(36.0).reshape(6, 6)
    twist = np.arange(6.0)
    assert np.allclose(flip_twist(matrix @ twist), flip_matrix(matrix) @ flip_twist(twist))
    assert np.allclose(flip_matrix(flip_matrix(matrix)), matrix)


def bow_camera(cfg=CameraCfg()):  # noqa: B008 - frozen
    return make_camera(cfg, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize(("width", "height"), [(640, 360), (1920, 1080)])
def test_both_published_fields_of_view_hold_at_the_image_border(width, height):
    camera = bow_camera(CameraCfg(width_px=width, height_px=height))
    right, down = math.tan(math.radians(42.5)), math.tan(math.radians(25.0))
    pixels = camera.project(np.array([[right, 0.0, 1.0], [0.0, down, 1.0]]))
    assert pixels[0, 0] == pytest.approx(width - 0.5, abs=1e-6)
    assert pixels[1, 1] == pytest.approx(height - 0.5, abs=1e-6)
    assert camera.matrix[0, 0] == camera.matrix[1, 1]


@given(st.floats(0.0, 639.0), st.floats(0.0, 359.0))
def test_pixel_to_ray_to_pixel_round_trip(u, v):
    camera = bow_camera()
    pixel = np.array([[u, v]])
    assert np.allclose(camera.project(camera.rays(pixel)), pixel, atol=1e-3)


def test_projection_agrees_with_opencv():
    camera = bow_camera()
    points = np.random.default_rng(0).uniform([-3, -2, 4], [3, 2, 9], (50, 3))
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, camera.distortion)
    assert np.allclose(camera.project(points), expected.reshape(-1, 2), atol=1e-9)


def test_points_outside_the_field_or_behind_are_not_in_view():
    camera = bow_camera()
    points = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, -5.0], [9.0, 0.0, 1.0], [4.9, 0.0, 5.0]])
    assert camera.in_view(points).tolist() == [True, False, False, False]


def test_camera_frame_axes():
    camera = bow_camera()
    # What lies ahead, to port and above must appear in front, on the left and at the top.
    ahead_port_above = np.array([5.0, 1.0, 1.0])
    point = invert(camera.T_body_camera) @ np.append(ahead_port_above, 1.0)
    u, v = camera.project(point[None, :3])[0]
    assert point[2] == pytest.approx(5.0)
    assert u < camera.width_px / 2
    assert v < camera.height_px / 2


@pytest.mark.parametrize("change", [{"width_px": 0}, {"rate_hz": 0.0}, {"vertical_fov_deg": 170.0}])
def test_impossible_cameras_are_refused(change):
    with pytest.raises(ConfigError, match=next(iter(change))):
        CameraCfg(**change)


def test_fields_of_view_that_need_a_folding_lens_are_refused():
    with pytest.raises(ConfigError, match="vertical_fov_deg"):
        bow_camera(CameraCfg(vertical_fov_deg=100.0))


def test_parallel_direction_and_up_are_refused():
    with pytest.raises(ValueError, match="parallel"):
        rotation_looking_along(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 2.0]))


@given(st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6))
def test_cross_product_is_numpys(values):
    a, b = np.array(values[:3]), np.array(values[3:])
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))


@pytest.mark.parametrize("columns", [(), (4,)])
def test_positive_systems_are_solved_as_numpy_solves_them(columns):
    rng = np.random.default_rng(4)
    root = rng.normal(size=(6, 6))
    matrix, right = root @ root.T + 0.1 * np.eye(6), rng.normal(size=(6, *columns))
    before = matrix.copy(), right.copy()
    found = solve_positive(matrix, right)
    assert found is not None
    np.testing.assert_allclose(found, np.linalg.solve(matrix, right), rtol=1e-9)
    np.testing.assert_array_equal(matrix, before[0])
    np.testing.assert_array_equal(right, before[1])
    assert solve_positive(matrix - 100.0 * np.eye(6), right) is None
