"""Bearings: exact direction, steady lights only, rough range from the spread of a group."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from perception_scenes import ARRAY, CAMERA, FAR, LAYOUT, RED, pixels_of, proprioception

from auvdock.core.arrays import Array
from auvdock.core.contracts import BLUE, Bearing, Detections, Percept
from auvdock.core.contracts import RED as RED_CLASS
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.perception.line_of_sight import LineOfSightCfg
from auvdock.perception.pipeline import BeaconPerception, PerceptionCfg

EULER = np.array([0.0, 0.0, np.pi])


def pose_at(distance_m: float, right_m: float = 0.0) -> Array:
    return make_transform(
        rotation_from_euler_zyx(*EULER.tolist()) @ CAMERA.T_body_camera[:3, :3], np.array([distance_m, right_m, 0.0])
    )


class Watch:
    """A perception that is shown given lights."""

    def __init__(self, seed: int = 0) -> None:
        self.perception = BeaconPerception(PerceptionCfg(), CAMERA, LAYOUT)
        self.rng = np.random.default_rng(seed)

    def show(self, *lights: tuple[float, float, int, float]) -> Percept:
        table = np.array(lights, dtype=np.float64).reshape(-1, 4)
        detections = Detections.from_points(table[:, :2].copy(), table[:, 3].copy(), table[:, 2].astype(np.int64))
        return self.perception.update(detections, proprioception(self.rng, EULER))

    def repeat(self, frames: int, *lights: tuple[float, float, int, float]) -> Percept:
        for _ in range(frames - 1):
            self.show(*lights)
        return self.show(*lights)


def rows(pixels: Array, class_id: int, score: float = 0.9) -> list[tuple[float, float, int, float]]:
    return [(float(u), float(v), class_id, score) for u, v in pixels]


def angle_to(bearing: Bearing | None, pixel: Array) -> float:
    assert bearing is not None
    return float(np.arccos(np.clip(bearing.ray_camera @ CAMERA.rays(pixel[None])[0], -1.0, 1.0)))


@pytest.mark.parametrize("pixel", [(320.0, 180.0), (20.0, 15.0), (610.0, 340.0)])
def test_single_far_light(pixel: tuple[float, float]):
    """The ray through a lasting light is the camera's own to 1e-6 rad, in the corners too; it carries no range."""
    watch = Watch()
    percept = watch.repeat(4, (*pixel, BLUE, 0.8))
    bearing = percept.long_range
    assert bearing is not None
    assert angle_to(bearing, np.array(pixel)) < 1e-6
    assert np.linalg.norm(bearing.ray_camera) == pytest.approx(1.0)
    assert bearing.range_m is None
    assert 0.0 < bearing.score <= 1.0


def test_passing_false_lights_do_not_steer():
    """A false light in one frame, red or blue, at a new place every time: no bearing at all."""
    watch = Watch()
    for _ in range(40):
        u, v = watch.rng.uniform([0.0, 0.0], [640.0, 360.0])
        class_id = int(watch.rng.integers(2))
        percept = watch.show((float(u), float(v), class_id, 0.9))
        assert percept.entrance is None
        assert percept.long_range is None


def test_steadiest_light_is_followed_and_kept():
    """A flickering light loses to a steady one; one that is a little brighter does not take over."""
    watch = Watch()
    for frame in range(12):
        lights = [(200.0, 100.0, BLUE, 0.7)]
        if frame % 3:
            lights.append((500.0, 300.0, BLUE, 0.8))
        watch.show(*lights)
    percept = watch.show((200.0, 100.0, BLUE, 0.7), (500.0, 300.0, BLUE, 0.8))
    assert angle_to(percept.long_range, np.array([200.0, 100.0])) < 1e-6
    percept = watch.repeat(12, (200.0, 100.0, BLUE, 0.7), (500.0, 300.0, BLUE, 0.8))
    assert angle_to(percept.long_range, np.array([200.0, 100.0])) < 1e-6


def test_group_gives_centre_and_rough_range():
    """Three of the array's lights from 15 m: the centre within 1°, the range within 35 %."""
    watch = Watch()
    truth = pose_at(15.0, 1.0)
    pixels = pixels_of(truth, LAYOUT.positions_m[ARRAY[[0, 2, 4]]])
    percept = watch.repeat(4, *rows(pixels, BLUE))
    assert percept.pose is None
    bearing = percept.long_range
    assert bearing is not None
    assert angle_to(bearing, pixels_of(truth, np.zeros((1, 3)))[0]) < np.radians(1.0)
    assert bearing.range_m == pytest.approx(15.0, rel=0.35)


def test_stray_light_does_not_pull_the_group():
    """Five blue lights of the station too close together for a pose, one stray 250 px away."""
    watch = Watch()
    truth = pose_at(30.0)
    pixels = pixels_of(truth, LAYOUT.positions_m[[*ARRAY[[0, 2, 3]], FAR]])
    lights = [*rows(pixels, BLUE), (70.0, 300.0, BLUE, 0.9)]
    percept = watch.repeat(4, *lights)
    assert angle_to(percept.long_range, pixels.mean(axis=0)) < np.radians(0.5)


def test_pose_takes_over_the_long_range_bearing():
    """With the array authenticated the bearing is that of its centre and carries the pose's range (2 %)."""
    watch = Watch()
    truth = pose_at(8.0, 0.5)
    pixels = pixels_of(truth, LAYOUT.positions_m[ARRAY])
    percept = watch.repeat(4, *rows(pixels, BLUE))
    assert percept.pose is not None
    centre = pixels_of(truth, np.zeros((1, 3)))[0]
    assert angle_to(percept.long_range, centre) < np.radians(0.1)
    assert percept.long_range is not None
    np.testing.assert_allclose(percept.long_range.centre_px, centre, atol=0.5)
    assert percept.long_range.range_m == pytest.approx(np.hypot(8.0, 0.5), rel=0.02)


def test_entrance_bearing_and_range():
    """Four red lamps from 2 m: their centre within 0.1°, range within 10 %; red and blue do not mix."""
    watch = Watch()
    truth = pose_at(1.0)
    red = pixels_of(truth, LAYOUT.positions_m[RED])
    percept = watch.repeat(4, *rows(red, RED_CLASS), (600.0, 40.0, BLUE, 0.9))
    assert angle_to(percept.entrance, red.mean(axis=0)) < np.radians(0.1)
    assert percept.entrance is not None
    assert percept.entrance.range_m == pytest.approx(2.13, rel=0.1)
    assert angle_to(percept.long_range, np.array([600.0, 40.0])) < 1e-6


def test_entrance_bearing_survives_a_false_red():
    watch = Watch()
    red = pixels_of(pose_at(1.0), LAYOUT.positions_m[RED])
    percept = watch.repeat(5, *rows(red, RED_CLASS))
    before = percept.entrance
    percept = watch.show(*rows(red, RED_CLASS), (40.0, 20.0, RED_CLASS, 1.0))
    assert before is not None
    assert percept.entrance is not None
    np.testing.assert_allclose(percept.entrance.ray_camera, before.ray_camera, atol=1e-6)
    # Even a lasting false red far off is left out of the group.
    percept = watch.repeat(5, *rows(red, RED_CLASS), (40.0, 20.0, RED_CLASS, 1.0))
    assert percept.entrance is not None
    np.testing.assert_allclose(percept.entrance.ray_camera, before.ray_camera, atol=1e-6)


def test_bearing_is_bridged_and_then_dropped():
    watch = Watch()
    red = pixels_of(pose_at(1.0), LAYOUT.positions_m[RED])
    for _ in range(6):
        watch.show(*rows(red, RED_CLASS))
    assert watch.show().entrance is not None
    percept = watch.repeat(6)
    assert percept.entrance is None


@pytest.mark.parametrize(("field", "value"), [("min_occurrences", 0), ("group_size", 1), ("loyalty", 0.0)])
def test_bad_setting_is_refused(field: str, value: Any):
    with pytest.raises(ConfigError, match=field):
        LineOfSightCfg(**{field: value})
