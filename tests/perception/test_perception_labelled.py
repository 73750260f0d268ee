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
from auvdock.numeric.lights import Light
from auvdock.numeric.tracks import Track
from auvdock.perception.labelled import Owner, gather_lights
from auvdock.perception.prior import AttitudePrior


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), tracks=st.integers(0, 12), seen_share=st.floats(0.0, 1.0))
def test_lights_are_those_that_numpy_finds(seed: int, tracks: int, seen_share: float):
    rng = np.random.default_rng(seed)
    array_m, centre_px = rng.normal(size=(8, 3)), rng.uniform(0.0, 600.0, (tracks, 2))
    half = rng.uniform(0.5, 10.0, (tracks, 2))
    xyxy = np.hstack([centre_px - half, centre_px + half])
    place, variance = rng.uniform(1.0, 600.0, (tracks, 2)), rng.uniform(1.0, 600.0, tracks)
    beacon = np.where(np.arange(tracks) < 8, np.arange(tracks), -1)
    beacon = rng.permutation(np.where(rng.uniform(size=tracks) < 0.7, beacon, -1))
    detection = np.where(rng.uniform(size=tracks) < seen_share, rng.permutation(tracks), -1)
    table = Track.zeros(tracks)
    table["centre_px"], table["p00_px2"] = place, variance
    table["beacon_id"], table["detection"] = beacon, detection
    lights, owners = Light.zeros(8), Owner.zeros(8)
    count, seen = gather_lights(table, centre_px, xyxy, (640, 360), array_m, 0.5, lights, owners)
    lights, owners = lights[:count], owners[:count]

    rows = np.flatnonzero(beacon >= 0)
    rows = rows[np.argsort(beacon[rows])]
    there = rows[detection[rows] >= 0]
    assert seen == len(there)
    rows = there if len(there) >= 4 else rows
    found = detection[rows] >= 0
    assert owners["track"].tolist() == rows.tolist()
    assert owners["beacon"].tolist() == beacon[rows].tolist()
    assert lights["place_m"].tolist() == array_m[beacon[rows]].tolist()
    pixels = np.where(found[:, None], centre_px[detection[rows]], place[rows])
    assert lights["centre_px"].tolist() == pixels.tolist()
    boxes = xyxy[detection[rows]]
    cut = (boxes[:, :2] <= 0.0).any(axis=1) | (boxes[:, 2:] >= np.array([639.0, 359.0])).any(axis=1)
    half_box = 0.5 * (boxes[:, 2:] - boxes[:, :2]).max(axis=1) if len(rows) else np.zeros(0)
    sigma = np.where(found, 0.5 + cut * half_box, 0.5 + np.sqrt(variance[rows]))
    assert lights["sigma_px"] == pytest.approx(sigma)
    assert lights["is_seen"].tolist() == found.tolist()


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
