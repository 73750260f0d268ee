"""Level II: both tag detectors on drawn frames, the pose from corners, regions, refusals."""

from __future__ import annotations

import math
from typing import cast

import cv2
import numpy as np
import pytest
from landing_scenes import CAMERA, CORNERS, STATION, tag_frame

from auvdock.core.arrays import Array
from auvdock.core.contracts import Frame, RegionOfInterest, TagDetection
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.perception.landing.config import AttitudeCfg, TagLevelCfg
from auvdock.perception.landing.level import LevelSolver, pose_offset
from auvdock.perception.landing.tag import TagLevel
from auvdock.perception.landing.tag_detectors import TAG_DETECTORS, make_tag_detector
from auvdock.perception.landing.tag_families import TAG_FAMILIES, TagFamily

LEVEL = TagLevel(TagLevelCfg(), STATION.tag, CAMERA, LevelSolver(AttitudeCfg(), CAMERA))
ERROR_PX = {"apriltag": 0.25, "contour": 0.8}
"""Greatest corner error on a frame with blur of 0.8 px and noise of 2 codes, ours."""


def pose(height_m: float, x: float = 0.02, y: float = -0.03, yaw_deg: float = 20.0) -> Array:
    euler = np.radians([2.0, -3.0, yaw_deg])
    rotation = rotation_from_euler_zyx(*euler.tolist()) @ CAMERA.T_body_camera[:3, :3]
    return make_transform(rotation, np.array([x, y, height_m]))


def corners_of(T: Array) -> Array:
    return CAMERA.project((CORNERS - T[:3, 3]) @ T[:3, :3])


@pytest.mark.parametrize("name", TAG_DETECTORS)
@pytest.mark.parametrize("height_m", [0.5, 1.5, 3.0])
def test_corners(name: str, height_m: float):
    """Number and corner order are right, every corner within the stated error; σ is no more than five times off."""
    T = pose(height_m)
    frame = tag_frame(T, np.random.default_rng(0))
    (tag,) = make_tag_detector(name).detect(frame)
    assert tag.tag_id == STATION.tag.tag_id
    error = np.linalg.norm(tag.corners_px - corners_of(T), axis=1)
    assert float(error.max()) < ERROR_PX[name]
    assert float(error.max()) < 5.0 * tag.sigma_px


@pytest.mark.parametrize("name", TAG_DETECTORS)
def test_region_finds_what_the_whole_frame_does(name: str):
    T = pose(1.2, yaw_deg=-40.0)
    frame = tag_frame(T, np.random.default_rng(1))
    region = LEVEL.region(T, 1e-6 * np.eye(6))
    assert region is not None
    detector = make_tag_detector(name)
    (whole,), (part,) = detector.detect(frame), detector.detect(frame, (region,))
    np.testing.assert_allclose(part.corners_px, whole.corners_px, atol=0.1)
    assert detector.detect(frame, (RegionOfInterest(0, 0, 60, 60),)) == ()
    assert detector.detect(frame, (RegionOfInterest(0, 0, 0, 0),)) == ()


@pytest.mark.parametrize("name", TAG_DETECTORS)
@pytest.mark.parametrize("tag_id", [7, 586])
def test_other_numbers_are_read(name: str, tag_id: int):
    (tag,) = make_tag_detector(name).detect(tag_frame(pose(1.0), np.random.default_rng(2), tag_id=tag_id))
    assert tag.tag_id == tag_id


@pytest.mark.parametrize("name", TAG_DETECTORS)
def test_looks_for_wanted_numbers_only(name: str):
    frame = tag_frame(pose(1.0), np.random.default_rng(2), tag_id=41)
    (tag,) = make_tag_detector(name, (7, 41)).detect(frame)
    (same,) = make_tag_detector(name).detect(frame)
    assert tag.tag_id == same.tag_id == 41
    np.testing.assert_array_equal(tag.corners_px, same.corners_px)
    assert make_tag_detector(name, (7,)).detect(frame) == ()


@pytest.mark.parametrize("name", TAG_DETECTORS)
def test_nothing_in_nothing(name: str):
    """Black, white and noise hold no tag."""
    noise = np.random.default_rng(3).integers(0, 255, (600, 800, 3)).astype(np.uint8)
    for image in (np.zeros_like(noise), np.full_like(noise, 255), noise):
        assert make_tag_detector(name).detect(Frame(image, 0.0, CAMERA)) == ()


def test_unknown_detector():
    with pytest.raises(ConfigError, match="apriltag, contour"):
        make_tag_detector("qr")


DRAWN: dict[TagFamily, int] = {
    "36h11": cv2.aruco.DICT_APRILTAG_36h11,
    "36h10": cv2.aruco.DICT_APRILTAG_36h10,
    "25h9": cv2.aruco.DICT_APRILTAG_25h9,
    "16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "4x4": cv2.aruco.DICT_4X4_50,
    "5x5": cv2.aruco.DICT_5X5_100,
    "6x6": cv2.aruco.DICT_6X6_250,
    "7x7": cv2.aruco.DICT_7X7_1000,
}


@pytest.mark.parametrize("name", TAG_DETECTORS)
@pytest.mark.parametrize("family", TAG_FAMILIES)
def test_every_family_is_read_with_its_corners(name: str, family: TagFamily):
    """Drawn in perspective, turned and noisy: number and corners are right; another family's tag is none."""
    T = pose(0.8, yaw_deg=35.0)
    frame = tag_frame(T, np.random.default_rng(4), tag_id=23, family=DRAWN[family])
    for clahe in (False, True):
        (tag,) = make_tag_detector(name, None, family, clahe).detect(frame)
        assert tag.tag_id == 23
        assert float(np.linalg.norm(tag.corners_px - corners_of(T), axis=1).max()) < ERROR_PX[name]
    other = TAG_FAMILIES[TAG_FAMILIES.index(family) - 1]
    assert all(tag.tag_id != 23 for tag in make_tag_detector(name, (23,), other).detect(frame))


def test_families_and_their_numbers_are_checked():
    with pytest.raises(ConfigError, match="25h9"):
        make_tag_detector("apriltag", None, cast(TagFamily, "25h7"))
    with pytest.raises(ConfigError, match="0 to 29"):
        make_tag_detector("contour", (30,), "16h5")


def test_equalised_contrast_reads_what_haze_has_left():
    """Black and white 6 codes apart, with noise of 1 code: found with equalisation, not without."""
    for seed in range(3):
        frame = tag_frame(pose(0.6), np.random.default_rng(seed), white=106.0, black=100.0, noise_dn=1.0)
        assert make_tag_detector("apriltag").detect(frame) == ()
        (tag,) = make_tag_detector("apriltag", clahe=True).detect(frame)
        assert tag.tag_id == 0
        assert float(np.linalg.norm(tag.corners_px - corners_of(pose(0.6)), axis=1).max()) < 2.0


@pytest.mark.parametrize("height_m", [0.4, 1.0, 4.0])
def test_exact_corners_give_the_pose(height_m: float):
    """To 1e-6 where the measured attitude is the true one; the corners' order fixes the heading."""
    T = pose(height_m, yaw_deg=-35.0)
    found = LEVEL.measure((TagDetection(0, corners_of(T), 0.1),), T[:3, :3])
    assert found is not None
    np.testing.assert_allclose(found.T_station_camera, T, atol=1e-6)


def test_attitude_tells_the_two_poses_of_a_square_apart():
    """A small tag, 0.3 px of noise: no pose of 100 is tilted more than 1° or off by more than its 5 σ."""
    rng = np.random.default_rng(4)
    T = pose(4.0)
    for _ in range(100):
        tilt = rotation_from_euler_zyx(*np.radians(rng.normal(0.0, 0.2, 3)).tolist())
        corners = corners_of(T) + rng.normal(0.0, 0.3, (4, 2))
        found = LEVEL.measure((TagDetection(0, corners, 0.3),), tilt @ T[:3, :3])
        assert found is not None
        error = pose_offset(T, found.T_station_camera)
        assert float(np.abs(error[3:5]).max()) < math.radians(1.0)
        assert float(error @ np.linalg.solve(found.estimate.covariance, error)) < 40.0


def test_what_is_no_square_is_refused():
    T = pose(1.0)
    corners = corners_of(T)
    corners[0] += 30.0
    assert LEVEL.measure((TagDetection(0, corners, 0.1),), T[:3, :3]) is None
    assert LEVEL.measure((), T[:3, :3]) is None


def test_region():
    """Around the tag with a margin that grows with what is not known; empty out of view; None from below."""
    T = pose(1.0)
    sharp, vague = LEVEL.region(T, 1e-8 * np.eye(6)), LEVEL.region(T, 1e-3 * np.eye(6))
    assert sharp is not None
    assert vague is not None
    corners = corners_of(T)
    assert sharp.x0 < corners[:, 0].min() < corners[:, 0].max() < sharp.x1
    assert vague.x1 - vague.x0 > sharp.x1 - sharp.x0
    away = LEVEL.region(pose(1.0, x=3.0), 1e-8 * np.eye(6))
    assert away is not None
    assert (away.x0, away.x1) == (0, 0)
    assert LEVEL.region(pose(-1.0), 1e-8 * np.eye(6)) is None
