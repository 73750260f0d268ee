"""The compiled bearings against plain ones: the camera's own projection, and groups by NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from perception_scenes import ARRAY, CAMERA, FAR, LAYOUT, RED

from auvdock.core.arrays import Array, IntArray
from auvdock.core.contracts import BLUE
from auvdock.core.contracts import RED as RED_CLASS
from auvdock.numeric.rotations import rotation_of
from auvdock.perception.sights import ENTRANCE, FOLLOWED, LONG_RANGE, SCORE, find_sights, sight_terms

MIN_OCCURRENCES, MAX_MISSED, GROUP_SIZE, LOYALTY = 3, 5, 3, 0.7
TERMS = sight_terms(CAMERA, LAYOUT, MIN_OCCURRENCES, MAX_MISSED, GROUP_SIZE, LOYALTY)
NO_POSE = np.zeros(0)
WINDOW = 6


def spread_m(points_m: Array) -> float:
    return float(np.sqrt(np.var(points_m[:, 1:], axis=0).sum()))


SPREADS_M = {
    BLUE: spread_m(LAYOUT.positions_m[[*ARRAY, FAR]]),
    RED_CLASS: spread_m(LAYOUT.positions_m[RED]),
}


def tables(rng: np.random.Generator, count: int, apart_px: float) -> tuple[Array, IntArray]:
    """Tracks about one place, some far off, with scores and counts on either side of every threshold."""
    numbers, labels = np.zeros((count, 7 + WINDOW)), np.zeros((count, 6), dtype=np.int64)
    place = rng.uniform((0.0, 0.0), (640.0, 360.0))
    # Far outside the image no iteration on the distortion ends: OpenCV's as little as ours.
    numbers[:, :2] = np.clip(place + rng.normal(0.0, apart_px, (count, 2)), 0.0, (639.0, 359.0))
    stray = rng.uniform(size=count) < 0.15
    numbers[stray, :2] = rng.uniform((0.0, 0.0), (639.0, 359.0), (int(stray.sum()), 2))
    numbers[:, 7:] = rng.uniform(0.2, 1.2, (count, WINDOW)) * (rng.uniform(size=(count, WINDOW)) < 0.75)
    labels[:, 0] = rng.permutation(1000)[:count]
    labels[:, 1] = rng.choice([BLUE, RED_CLASS], count)
    labels[:, 3] = rng.integers(0, 8, count) * (rng.uniform(size=count) < 0.3)
    labels[:, 4] = rng.integers(1, 20, count)
    return numbers, labels


def steady(numbers: Array, labels: IntArray, class_id: int) -> IntArray:
    good = (labels[:, 1] == class_id) & (labels[:, 4] >= MIN_OCCURRENCES) & (labels[:, 3] <= MAX_MISSED)
    return np.flatnonzero(good & (np.count_nonzero(numbers[:, 7:], axis=1) >= MIN_OCCURRENCES))


def bearing(pixel: Array, score: float, range_m: float) -> Array:
    return np.array([*CAMERA.rays(pixel[None])[0], *pixel, min(score, 1.0), range_m])


def group(pixels: Array, weight: Array, spread: float) -> Array:
    n = len(pixels)
    if n == 2:
        kept = np.array([int(np.argmax(weight))])
    elif n > 2:
        far = np.linalg.norm(pixels - np.sort(pixels, axis=0)[n // 2], axis=1)
        kept = np.flatnonzero(far <= 3.0 * np.sort(far)[n // 2] + 2.0)
    else:
        kept = np.arange(n)
    pixels, weight = pixels[kept], weight[kept]
    square = np.var(pixels, axis=0).sum()
    range_m = spread * CAMERA.matrix[0, 0] / np.sqrt(square) if len(kept) >= 3 and square > 1.0 else np.nan
    return bearing(pixels.mean(axis=0), float(weight.mean()), float(range_m))


def plain(numbers: Array, labels: IntArray, followed: int) -> Array:
    """What `find_sights` gives without a pose."""
    result = np.full(15, np.nan)
    result[FOLLOWED] = followed
    weight = numbers[:, 7:].mean(axis=1)
    red, blue = steady(numbers, labels, RED_CLASS), steady(numbers, labels, BLUE)
    if len(red):
        result[ENTRANCE:FOLLOWED] = group(numbers[red, :2], weight[red], SPREADS_M[RED_CLASS])
    if len(blue) >= GROUP_SIZE:
        result[LONG_RANGE:ENTRANCE] = group(numbers[blue, :2], weight[blue], SPREADS_M[BLUE])
    elif len(blue):
        best = blue[np.argmax(weight[blue])]
        loyal = blue[labels[blue, 0] == followed]
        if len(loyal) and weight[loyal[0]] >= LOYALTY * weight[best]:
            best = loyal[0]
        result[LONG_RANGE:ENTRANCE] = bearing(numbers[best, :2], weight[best], np.nan)
        result[FOLLOWED] = labels[best, 0]
    return result


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 14),
    apart_px=st.sampled_from([0.2, 3.0, 40.0]),
    loyal=st.booleans(),
)
def test_bearings_equal_the_plain_ones(seed: int, count: int, apart_px: float, loyal: bool):
    rng = np.random.default_rng(seed)
    numbers, labels = tables(rng, count, apart_px)
    followed = int(rng.choice(labels[:, 0])) if loyal and count else -1
    found = find_sights(numbers, labels, NO_POSE, TERMS, followed)
    np.testing.assert_allclose(found, plain(numbers, labels, followed), rtol=1e-9, atol=1e-8)


def test_pose_gives_the_array_centre_and_leaves_the_entrance():
    rng = np.random.default_rng(4)
    centre_m = LAYOUT.array_positions_m.mean(axis=0)
    for _ in range(20):
        numbers, labels = tables(rng, 10, 3.0)
        vector, t = rng.normal(size=3), rng.uniform((-1.0, -0.5, 3.0), (1.0, 0.5, 9.0))
        rotation = rotation_of(vector)
        found = find_sights(numbers, labels, np.concatenate([vector, t, rotation.ravel()]), TERMS, 7)
        centre = rotation @ centre_m + t
        wanted = [*centre / np.linalg.norm(centre), *CAMERA.project(centre[None])[0], 1.0, np.linalg.norm(centre)]
        assert found[LONG_RANGE:ENTRANCE] == pytest.approx(wanted)
        expected = plain(numbers, labels, -1)[ENTRANCE:FOLLOWED]
        np.testing.assert_allclose(found[ENTRANCE:FOLLOWED], expected, rtol=1e-9, atol=1e-8)
        assert found[FOLLOWED] == 7


def test_no_track_no_bearing():
    found = find_sights(np.zeros((0, 13)), np.zeros((0, 6), dtype=np.int64), NO_POSE, TERMS, 3)
    assert np.isnan(found[[LONG_RANGE + SCORE, ENTRANCE + SCORE]]).all()
    assert found[FOLLOWED] == 3
