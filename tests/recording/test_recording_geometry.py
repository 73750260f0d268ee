from __future__ import annotations

import math

import numpy as np
import pytest

from auvdock.controllers.modes import MODES
from auvdock.controllers.rotating.modes import ROTATING_MODES
from auvdock.core.contracts import BLUE, RED
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.recording.meshes import Mesh, beam_cone, frustum
from auvdock.recording.modes import KNOWN_MODES, ModeFollower
from auvdock.recording.palette import class_colours, wavelength_rgb
from auvdock.recording.pose_error import camera_in_station, pose_errors

DIRECTIONS = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -2.0), (1.0, -2.0, 0.5)]
START = np.array([0.3, -1.0, 2.0])


def triangle_crosses(mesh: Mesh) -> np.ndarray:
    corners = mesh.vertices_m[mesh.triangles]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("radii", [(1.0, 0.15), (0.15, 1.0), (0.4, 0.4)])
def test_frustum_has_its_radii_its_length_and_its_area(
    direction: tuple[float, float, float], radii: tuple[float, float]
) -> None:
    mesh = frustum(START, np.array(direction), 1.2, *radii, segments=64)
    axis = np.array(direction) / np.linalg.norm(direction)
    along = (mesh.vertices_m - START) @ axis
    from_axis = np.linalg.norm(mesh.vertices_m - START - along[:, None] * axis, axis=1)
    np.testing.assert_allclose(along, [0.0] * 64 + [1.2] * 64, atol=1e-12)
    np.testing.assert_allclose(from_axis, [radii[0]] * 64 + [radii[1]] * 64, atol=1e-12)
    area = np.linalg.norm(triangle_crosses(mesh), axis=1).sum() / 2.0
    exact = math.pi * sum(radii) * math.hypot(1.2, radii[0] - radii[1])
    assert area == pytest.approx(exact, rel=2e-3)  # 64 flat strips lose (π/64)²/6 = 0.04 % of the circle


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("radii", [(1.0, 0.15), (0.15, 1.0), (0.4, 0.4)])
def test_frustum_normals_are_normal_to_the_mantle_and_point_outwards(
    direction: tuple[float, float, float], radii: tuple[float, float]
) -> None:
    mesh = frustum(START, np.array(direction), 1.2, *radii, segments=16)
    slant = mesh.vertices_m[16:] - mesh.vertices_m[:16]
    axis = np.array(direction) / np.linalg.norm(direction)
    radial = mesh.vertices_m[:16] - START
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.einsum("ni,ni->n", mesh.normals[:16], slant), 0.0, atol=1e-12)
    assert np.all(np.einsum("ni,ni->n", mesh.normals[:16], radial) > 0.0)
    np.testing.assert_allclose(np.einsum("ni,ni->n", np.cross(axis, radial), mesh.normals[:16]), 0.0, atol=1e-12)
    corner_normals = mesh.normals[mesh.triangles].sum(axis=1)
    assert np.all(np.einsum("ni,ni->n", triangle_crosses(mesh), corner_normals) > 0.0)


@pytest.mark.parametrize("beam_angle_deg", [20.0, 45.0, 120.0])
def test_beam_cone_opens_by_its_angle(beam_angle_deg: float) -> None:
    mesh = beam_cone(START, np.array([0.0, 3.0, 4.0]), beam_angle_deg, 3.0)
    rim = mesh.vertices_m[24:] - START
    np.testing.assert_allclose(mesh.vertices_m[:24], np.tile(START, (24, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(rim, axis=1), 3.0, atol=1e-12)
    cosines = rim @ np.array([0.0, 0.6, 0.8]) / 3.0
    np.testing.assert_allclose(np.degrees(np.arccos(cosines)), beam_angle_deg / 2.0, atol=1e-6)


def test_pose_errors_are_the_known_offsets_in_station_axes() -> None:
    rng = np.random.default_rng(3)
    T_true = np.array(
        [make_transform(rotation_from_euler_zyx(*rng.uniform(-1.5, 1.5, 3)), rng.normal(size=3)) for _ in range(50)]
    )
    angles = rng.uniform(1e-3, 3.0, 50)
    offsets = rng.normal(size=(50, 3))
    turned = np.array([make_transform(rotation_from_euler_zyx(0.0, 0.0, angle), np.zeros(3)) for angle in angles])
    T_estimated = T_true @ turned
    T_estimated[:, :3, 3] += offsets
    position_m, angle_rad = pose_errors(T_estimated, T_true)
    np.testing.assert_allclose(position_m, offsets[:, [1, 2, 0]], atol=1e-12)  # lateral y, vertical z, along x
    np.testing.assert_allclose(angle_rad, angles, atol=1e-9)


def test_pose_errors_of_no_pose() -> None:
    position_m, angle_rad = pose_errors(np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))
    assert position_m.shape == (0, 3)
    assert angle_rad.shape == (0,)


def test_camera_in_station_chains_the_frames() -> None:
    T_world_station = make_transform(rotation_from_euler_zyx(0.0, 0.0, 0.5), np.array([1.0, 2.0, -8.0]))
    T_station_camera = make_transform(rotation_from_euler_zyx(0.1, 0.2, 3.0), np.array([9.0, 1.0, 0.5]))
    T_body_camera = make_transform(rotation_from_euler_zyx(1.0, 0.0, 1.0), np.array([0.7, 0.0, 0.0]))
    T_world_body = T_world_station @ T_station_camera @ np.linalg.inv(T_body_camera)
    found = camera_in_station(T_world_station, T_world_body[None], T_body_camera)
    np.testing.assert_allclose(found, T_station_camera[None], atol=1e-12)


@pytest.mark.parametrize(("wavelength_nm", "strongest"), [(450.0, 2), (530.0, 1), (620.0, 0), (700.0, 0)])
def test_a_wavelength_has_the_colour_that_it_is_called_by(wavelength_nm: float, strongest: int) -> None:
    assert int(np.argmax(wavelength_rgb(wavelength_nm))) == strongest


def test_classes_differ_and_unknown_ones_have_a_colour() -> None:
    colours = class_colours(np.array([BLUE, RED, 7, 8], dtype=np.int64))
    assert len(set(colours[:3].tolist())) == 3
    assert colours[2] == colours[3]
    assert class_colours(np.zeros(0, dtype=np.int64)).shape == (0,)


def test_modes_are_numbered_and_only_changes_are_told() -> None:
    assert KNOWN_MODES[: len(MODES)] == MODES
    assert set(ROTATING_MODES) < set(KNOWN_MODES)
    follower = ModeFollower()
    assert [follower.number(mode) for mode in KNOWN_MODES] == list(range(len(KNOWN_MODES)))
    own = follower.number("spiral")
    assert own == len(KNOWN_MODES)
    assert follower.number("other") == own + 1
    assert follower.number("spiral") == own
    told = (follower.follow(row, mode, 2.0 - row) for row, mode in enumerate(["far", "far", "mid", "mid", "far"]))
    changes = [change for change in told if change is not None]
    assert [change.row for change in changes] == [0, 2, 4]
    assert [change.mode for change in changes] == ["far", "mid", "far"]
    assert "2.0 m in front of" in changes[0].text
    assert "2.0 m past" in changes[2].text
