"""Cameras from files: the same lens in this package's words and in ROS', and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.footage.camera_file import read_camera

TOML = """
width_px = 720
height_px = 576
focal_px = [626.9, 687.0]
principal_point_px = [373.4, 223.6]
distortion = [-0.42, 0.15, 0.015, 0.0002, 0.0]
"""
ROS = """
image_width: 720
image_height: 576
camera_name: tank
camera_matrix: {rows: 3, cols: 3, data: [626.9, 0, 373.4, 0, 687.0, 223.6, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data:
  - -0.42
  - 0.15
  - 0.015
  - 0.0002
  - 0.0
"""


def written(folder, name, text):
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_both_files_tell_the_same_camera(tmp_path):
    own = read_camera(written(tmp_path, "own.toml", TOML), "forward", 30.0)
    ros = read_camera(written(tmp_path, "ros.yaml", ROS), "forward", 30.0)
    np.testing.assert_array_equal(own.matrix, ros.matrix)
    np.testing.assert_array_equal(own.distortion, ros.distortion)
    assert (own.width_px, own.height_px, own.rate_hz) == (720, 576, 30.0)


@pytest.mark.parametrize(("mount", "above", "below"), [("forward", 2, 0), ("down", 0, 2)])
def test_a_camera_looks_where_it_is_mounted(tmp_path, mount, above, below):
    """The image's upper edge is up for a bow camera and ahead for a belly camera; right is starboard in both."""
    camera = read_camera(written(tmp_path, "own.toml", TOML), mount)
    x, y, z = camera.T_body_camera[:3, :3].T
    np.testing.assert_allclose(x, [0.0, -1.0, 0.0], atol=1e-12)
    assert y[above] == pytest.approx(-1.0)
    assert abs(z[below]) == pytest.approx(1.0)


def test_fields_of_view_and_metric_lens(tmp_path):
    wide = read_camera(written(tmp_path, "wide.toml", "horizontal_fov_deg = 85.0\n"), "forward")
    assert wide.width_px == 640
    metric = read_camera(written(tmp_path, "metric.toml", "focal_length_m = 7.109e-3\n"), "down")
    assert metric.matrix[0, 0] == pytest.approx(7.109e-3 / 8.29e-6)


@pytest.mark.parametrize(
    ("name", "text", "field"),
    [
        ("c.yaml", ROS.replace("plumb_bob", "equidistant"), "distortion_model"),
        ("c.yaml", ROS.replace("  - 0.015\n", "  - nan\n"), "distortion_coefficients"),
        ("c.yaml", ROS.replace("626.9, 0, 373.4", "626.9, 373.4"), "camera_matrix"),
        ("c.yaml", ROS.replace("image_width: 720\n", ""), "width_px"),
        ("c.yaml", "a: [1, 2", "file"),
        ("c.yaml", "- 1", "file"),
        ("c.toml", TOML.replace("626.9", "-626.9"), "focal_px"),
        ("c.toml", "width_px = 720\n", "file"),
        ("c.toml", TOML + "zoom = 2\n", "zoom"),
    ],
)
def test_what_is_no_camera_is_refused(tmp_path, name, text, field):
    with pytest.raises(ConfigError) as caught:
        read_camera(written(tmp_path, name, text), "forward")
    assert field in caught.value.field
