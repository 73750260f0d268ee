"""Labelled lights and the attitude prior: the compiled loops against NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from perception_scenes import CAMERA

from auvdock.core.arrays import Array
from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx
from auvdock.perception.labelled import labelled_lights
from auvdock.perception.prior import AttitudePrior


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), tracks=st.integers(0, 12), seen_share=st.floats(0.0, 1.0))
def test_lights_are_those_that_numpy_finds(seed: int, tracks: int, seen_share: float):
    rng = np.random.default_rng(seed)
    array_m, centre_px = rng.normal(size=(8, 3)), rng.uniform(0.0, 600.0, (tracks, 2))
    half = rng.uniform(0.5, 10.0, (tracks, 2))
    xyxy = np.hstack([centre_px - half, centre_px + half])
    numbers = rng.uniform(1.0, 600.0, (tracks, 13))
    labels = rng.integers(0, 5, (tracks, 6))
    labels[:, 2] = np.where(np.arange(tracks) < 8, np.arange(tracks), -1)
    labels[:, 2] = rng.permutation(np.where(rng.uniform(size=tracks) < 0.7, labels[:, 2], -1))
    labels[:, 5] = np.where(rng.uniform(size=tracks) < seen_share, rng.permutation(tracks), -1)
    lights, owners, seen = labelled_lights(numbers, labels, centre_px, xyxy, (640, 360), array_m, 0.5)

    rows = np.flatnonzero(labels[:, 2] >= 0)
    rows = rows[np.argsort(labels[rows, 2])]
    there = rows[labels[rows, 5] >= 0]
    assert seen == len(there)
    rows = there if len(there) >= 4 else rows
    found = labels[rows, 5] >= 0
    assert owners[:, 0].tolist() == rows.tolist()
    assert owners[:, 1].tolist() == labels[rows, 2].tolist()
    assert lights[:, :3].tolist() == array_m[labels[rows, 2]].tolist()
    pixels = np.where(found[:, None], centre_px[labels[rows, 5]], numbers[rows, :2])
    assert lights[:, 3:5].tolist() == pixels.tolist()
    boxes = xyxy[labels[rows, 5]]
    cut = (boxes[:, :2] <= 0.0).any(axis=1) | (boxes[:, 2:] >= np.array([639.0, 359.0])).any(axis=1)
    half_box = 0.5 * (boxes[:, 2:] - boxes[:, :2]).max(axis=1) if len(rows) else np.zeros(0)
    sigma = np.where(found, 0.5 + cut * half_box, 0.5 + np.sqrt(numbers[rows, 4]))
    assert lights[:, 5] == pytest.approx(sigma)
    assert lights[:, 6].tolist() == found.tolist()


def rotation_z(angle_rad: float) -> Array:
    return rotation_from_euler_zyx(0.0, 0.0, angle_rad)


@settings(max_examples=50, deadline=None)
@given(
    euler=st.tuples(*[st.floats(-math.pi, math.pi)] * 3),
    surveyed=st.floats(-math.pi, math.pi),
    heading=st.none() | st.floats(-math.pi, math.pi),
)
def test_prior_is_the_product_of_its_rotations(
    euler: tuple[float, float, float], surveyed: float, heading: float | None
):
    down = make_camera(CameraCfg(), np.zeros(3), np.array([0.8, 0.1, -0.5]), np.array([0.0, 0.0, 1.0]))
    zero = np.zeros(3)
    sample = Proprioception(0.0, 8.0, np.array(euler), zero, zero, zero)
    for camera in (CAMERA, down):
        found = AttitudePrior(camera, surveyed).rotation(sample, heading)
        world_camera = rotation_from_euler_zyx(*euler) @ camera.T_body_camera[:3, :3]
        wanted = world_camera.T @ rotation_z(surveyed if heading is None else heading)
        np.testing.assert_allclose(found, wanted, atol=1e-12)
