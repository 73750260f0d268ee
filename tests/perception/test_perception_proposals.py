"""The compiled proposals and candidates against NumPy's, all hypotheses at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from perception_scenes import ARRAY, LAYOUT, random_motion

from auvdock.core.arrays import Array, IntArray
from auvdock.core.contracts import BLUE, RED
from auvdock.core.transforms import invert, rotation_from_euler_zyx
from auvdock.numeric.tracks import Track
from auvdock.perception.authentication import symmetric_pairs
from auvdock.perception.proposals import propose, surest_lights

RING = np.ascontiguousarray(LAYOUT.positions_m[ARRAY])
MIN_COSINE, TOLERANCE_M, TOLERANCE = math.cos(math.radians(25.0)), 0.35, 0.004


def plain_proposals(
    xy: Array, rotation: Array, points: Array, pairs: IntArray, min_beacons: int, most: int
) -> list[list[int]]:
    q = points @ rotation.T
    a, b = np.nonzero(~np.eye(len(xy), dtype=bool))
    seen, expected = xy[b] - xy[a], q[pairs[:, 1], :2] - q[pairs[:, 0], :2]
    size = np.linalg.norm(seen, axis=1)[:, None] * np.linalg.norm(expected, axis=1) + 1e-12
    row, column = np.nonzero(seen @ expected.T / size >= MIN_COSINE)
    found: list[tuple[float, list[int]]] = []
    for i, p in zip(row, column, strict=True):
        # x (q_z + t_z) = q_x + t_x and the same in y, of two lights.
        two, point = xy[[a[i], b[i]]], q[pairs[p]]
        matrix, right = np.zeros((4, 3)), (two * point[:, 2:] - point[:, :2]).ravel()
        matrix[::2, 0] = matrix[1::2, 1] = 1.0
        matrix[:, 2] = -two.ravel()
        t = np.linalg.lstsq(matrix, right, rcond=None)[0]
        if t[2] <= 0.1 or (q[:, 2] + t[2]).min() <= 0.1:
            continue
        image = (q[:, :2] + t[:2]) / (q[:, 2:] + t[2])
        gap = np.linalg.norm(image[:, None] - xy[None], axis=2)
        reach = TOLERANCE_M / t[2] + TOLERANCE
        nearest, distance = gap.argmin(axis=1), gap.min(axis=1)
        identity = np.full(len(points), -1)
        for beacon in np.argsort(distance, kind="stable"):
            if distance[beacon] <= reach and nearest[beacon] not in identity:
                identity[beacon] = nearest[beacon]
        if np.count_nonzero(identity >= 0) >= min_beacons:
            found.append((float(np.minimum(distance / reach, 1.0).sum()), identity.tolist()))
    best: list[list[int]] = []
    for _, identity in sorted(found, key=lambda pair: pair[0]):
        if identity not in best and len(best) < most:
            best.append(identity)
    return best


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    hidden=st.integers(0, 2),
    stray=st.integers(0, 5),
    noise=st.sampled_from([0.0005, 0.005, 0.02]),
    beacons=st.sampled_from([5, 6]),
    most=st.integers(1, 4),
)
def test_proposals_are_numpys(seed: int, hidden: int, stray: int, noise: float, beacons: int, most: int):
    """Ring with lights missing and others added, some so noisy that several beacons claim one; five have every pair."""
    rng = np.random.default_rng(seed)
    points = RING[:beacons].copy()
    T_camera_station = invert(random_motion(rng, RING).at(0.0)[0])
    turn = rotation_from_euler_zyx(*rng.normal(0.0, 0.05, 3).tolist())
    rotation = np.ascontiguousarray(turn @ T_camera_station[:3, :3])
    camera = points @ T_camera_station[:3, :3].T + T_camera_station[:3, 3]
    image = camera[:, :2] / camera[:, 2:]
    strays = image.mean(axis=0) + 1.5 * image.std(axis=0) * rng.normal(size=(stray, 2))
    xy = np.vstack([image[rng.permutation(beacons)[hidden:]], strays])
    xy = np.ascontiguousarray(rng.permutation(xy + rng.normal(0.0, noise, xy.shape)))
    pairs = symmetric_pairs(points)
    found = propose(xy, rotation, points, pairs, MIN_COSINE, TOLERANCE_M, TOLERANCE, 4, most)
    assert found.tolist() == plain_proposals(xy, rotation, points, pairs, 4, most)


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_candidates_propose_nothing(count: int):
    pairs = symmetric_pairs(RING)
    found = propose(np.zeros((count, 2)), np.eye(3), RING, pairs, MIN_COSINE, TOLERANCE_M, TOLERANCE, 4, 3)
    assert found.shape == (0, 6)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(0, 15), most=st.integers(1, 12))
def test_candidates_are_numpys(seed: int, count: int, most: int):
    rng = np.random.default_rng(seed)
    tracks = Track.zeros(count)
    # Few different scores, so that equally sure ones turn up.
    scores = rng.choice([0.0, 0.0, 0.25, 0.5], (count, 6))
    blue, detection = rng.uniform(size=count) < 0.8, rng.integers(-1, 9, count)
    tracks["class_id"], tracks["detection"] = np.where(blue, BLUE, RED), detection
    rows = surest_lights(tracks, scores, 3, 0.3, most)
    occurrences = np.count_nonzero(scores, axis=1)
    confidence = scores.sum(axis=1) / np.maximum(occurrences, 1)
    good = np.flatnonzero(blue & (detection >= 0) & (occurrences >= 3) & (confidence >= 0.3))
    assert rows.tolist() == good[np.argsort(-confidence[good], kind="stable")][:most].tolist()
