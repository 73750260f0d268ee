"""Footage of a platform: its tag of another family gives the pose, with no heading and no depth told."""

from __future__ import annotations

import cv2
import numpy as np
from landing_scenes import CAMERA, STATION, tag_frame

from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.footage.perceiving import FootageCfg, FootagePerceiver
from auvdock.footage.sources import Shot


def test_a_tag_of_another_family_gives_pose_and_corners():
    """Within 2 cm at 1 m height, whatever the heading; a tag of the family that is not asked for gives none."""
    for yaw_deg in (-150.0, 20.0, 95.0):
        rotation = rotation_from_euler_zyx(*np.radians([3.0, -2.0, yaw_deg]).tolist()) @ CAMERA.T_body_camera[:3, :3]
        T = make_transform(rotation, np.array([0.05, -0.04, 1.0]))
        frame = tag_frame(T, np.random.default_rng(0), family=cv2.aruco.DICT_APRILTAG_25h9)
        seen = FootagePerceiver(FootageCfg(tag_family="25h9"), STATION, CAMERA).perceive(Shot("a.png", frame.image))
        assert seen.row.tag_ids == [0]
        assert seen.row.pose is not None
        assert np.linalg.norm(np.array(seen.row.pose)[:3, 3] - T[:3, 3]) < 0.02
        other = FootagePerceiver(FootageCfg(), STATION, CAMERA).perceive(Shot("a.png", frame.image))
        assert (other.row.tag_ids, other.row.pose) == ([], None)
