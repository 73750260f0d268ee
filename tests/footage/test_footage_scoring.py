"""Scores of rows that were made up: what counts as found, as stray, as misnamed, as a right pose."""

from __future__ import annotations

import json

import numpy as np
import pytest
from footage_scene import ARRAY_M, CAMERA, camera_pose

from auvdock.core.errors import ConfigError
from auvdock.footage.rows import FootageRow
from auvdock.footage.scoring import read_labels, score

POSE = camera_pose(5.0)
LAMPS = CAMERA.project((ARRAY_M - POSE[:3, 3]) @ POSE[:3, :3])


def labels(tmp_path, clipped=(), shift=0.0):
    lights = [{"id": k, "x": x + shift, "y": y, "clipped": k in clipped} for k, (x, y) in enumerate(LAMPS.tolist())]
    frames = [{"frame": "a.png", "lights": lights}, {"frame": "unseen.png", "lights": lights}]
    (tmp_path / "labels.json").write_text(json.dumps({"frames": frames}), encoding="utf-8")
    return read_labels(tmp_path / "labels.json")


def row(lights, names, pose=POSE):
    return FootageRow("a.png", np.asarray(lights).tolist(), names, pose.tolist(), True, 0.1, 0.1, [], [])


def test_all_found_and_named(tmp_path):
    other = row(LAMPS, list(range(6)))
    found = score([row(LAMPS + 0.5, [0, 1, 2, None, 4, 5])], labels(tmp_path), CAMERA, ARRAY_M)
    assert (found.frames, found.lights, found.found, found.spurious, found.misnamed) == (1, 6, 6, 0, 0)
    assert (found.enough, found.right, found.wrong) == (1, 1, 0)
    assert found.error_px == pytest.approx(np.hypot(0.5, 0.5))
    assert score([other], {}, CAMERA, ARRAY_M).frames == 0


def test_strays_wrong_names_and_clipped_lights(tmp_path):
    lights = np.vstack([LAMPS[:3], LAMPS[3] + [8.0, 0.0], [[5.0, 5.0]]])
    names = [0, 2, 1, None, None]
    found = score([row(lights, names)], labels(tmp_path, clipped=(3,)), CAMERA, ARRAY_M)
    assert (found.lights, found.found, found.spurious, found.misnamed) == (5, 3, 1, 1)  # 8 px off a clipped one is none


def test_a_pose_is_right_where_it_puts_the_labels(tmp_path):
    turned = camera_pose(5.0, roll_deg=60.0)  # the ring of six turned by one lamp
    for pose, shift, right in ((POSE, 3.0, 1), (POSE, 5.0, 0), (turned, 0.0, 0)):
        found = score([row(LAMPS, [None] * 6, pose)], labels(tmp_path, shift=shift), CAMERA, ARRAY_M)
        assert (found.right, found.wrong) == (right, 1 - right)


@pytest.mark.parametrize(
    "text", ["", "[]", '{"frames": [{"frame": "a"}]}', '{"frames": [{"frame": "a", "lights": 1}]}']
)
def test_what_is_no_labels_file(tmp_path, text):
    (tmp_path / "labels.json").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"labels\.json"):
        read_labels(tmp_path / "labels.json")
