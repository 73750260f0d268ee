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
from auvdock.numeric.lights import Solution
from auvdock.numeric.records import Records
from auvdock.numeric.rotations import rotation_of
from auvdock.numeric.tracks import Track
from auvdock.perception.sights import ENTRANCE, LONG_RANGE, Sight, SightLaw, find_sights

MIN_OCCURRENCES, MAX_MISSED, GROUP_SIZE, LOYALTY = 3, 5, 3, 0.7
NO_POSE = Solution.zeros(0)
WINDOW = 6


def spread_m(points_m: Array) -> float:
    return float(np.sqrt(np.var(points_m[:, 1:], axis=0).sum()))


SPREADS_M = {
    BLUE: spread_m(LAYOUT.positions_m[[*ARRAY, FAR]]),
    RED_CLASS: spread_m(LAYOUT.positions_m[RED]),
}
LENS = np.array([*CAMERA.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *CAMERA.distortion])
CENTRE_M = LAYOUT.array_positions_m.mean(axis=0)
LAW = SightLaw(
    LENS, SPREADS_M[BLUE], SPREADS_M[RED_CLASS], CENTRE_M, MIN_OCCURRENCES, MAX_MISSED, GROUP_SIZE, LOYALTY
).packed()


def tables(rng: np.random.Generator, count: int, apart_px: float) -> tuple[Records[Track], Array]:
    """Tracks about one place, some far off, with scores and counts on either side of every threshold."""
    tracks = Track.zeros(count)
    place = rng.uniform((0.0, 0.0), (640.0, 360.0))
    # Far outside the image no iteration on the distortion ends: OpenCV's as little as ours.
    centre = np.clip(place + rng.normal(0.0, apart_px, (count, 2)), 0.0, (639.0, 359.0))
    stray = rng.uniform(size=count) < 0.15
    centre[stray] = rng.uniform((0.0, 0.0), (639.0, 359.0), (int(stray.sum()), 2))
    scores = rng.uniform(0.2, 1.2, (count, WINDOW)) * (rng.uniform(size=(count, WINDOW)) < 0.75)
    tracks["centre_px"] = centre
    tracks["track_id"] = rng.permutation(1000)[:count]
    tracks["class_id"] = rng.choice([BLUE, RED_CLASS], count)
    tracks["missed"] = rng.integers(0, 8, count) * (rng.uniform(size=count) < 0.3)
    tracks["hits"] = rng.integers(1, 20, count)
    return tracks, scores


def steady(tracks: Records[Track], scores: Array, class_id: int) -> IntArray:
    good = (tracks["class_id"] == class_id) & (tracks["hits"] >= MIN_OCCURRENCES) & (tracks["missed"] <= MAX_MISSED)
    return np.flatnonzero(good & (np.count_nonzero(scores, axis=1) >= MIN_OCCURRENCES))


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


def plain(tracks: Records[Track], scores: Array, followed: int) -> tuple[Array, Array, int]:
    """What `find_sights` gives without a pose: seven numbers of either bearing, nan for none, and the track."""
    long_range, entrance = np.full((2, 7), np.nan)
    weight, centre = scores.mean(axis=1), tracks["centre_px"]
    red, blue = steady(tracks, scores, RED_CLASS), steady(tracks, scores, BLUE)
    if len(red):
        entrance = group(centre[red], weight[red], SPREADS_M[RED_CLASS])
    if len(blue) >= GROUP_SIZE:
        long_range = group(centre[blue], weight[blue], SPREADS_M[BLUE])
    elif len(blue):
        best = blue[np.argmax(weight[blue])]
        loyal = blue[tracks["track_id"][blue] == followed]
        if len(loyal) and weight[loyal[0]] >= LOYALTY * weight[best]:
            best = loyal[0]
        long_range = bearing(centre[best], weight[best], np.nan)
        followed = int(tracks["track_id"][best])
    return long_range, entrance, followed


def numbers(sights: Records[Sight], row: int) -> Array:
    """Seven numbers of a bearing, nan for none."""
    sight = Sight.read(sights, row)
    if np.isnan(sight.score):
        return np.full(7, np.nan)
    return np.array([*sight.ray_camera, *sight.pixel, sight.score, sight.range_m])


def same(sights: Records[Sight], row: int, wanted: Array) -> None:
    np.testing.assert_allclose(numbers(sights, row), wanted, rtol=1e-9, atol=1e-8)


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(0, 14),
    apart_px=st.sampled_from([0.2, 3.0, 40.0]),
    loyal=st.booleans(),
)
def test_bearings_equal_the_plain_ones(seed: int, count: int, apart_px: float, loyal: bool):
    rng = np.random.default_rng(seed)
    tracks, scores = tables(rng, count, apart_px)
    before = int(rng.choice(tracks["track_id"])) if loyal and count else -1
    sights, followed = find_sights(tracks, scores, NO_POSE, LAW, before)
    long_range, entrance, wanted = plain(tracks, scores, before)
    same(sights, LONG_RANGE, long_range)
    same(sights, ENTRANCE, entrance)
    assert followed == wanted


def test_pose_gives_the_array_centre_and_leaves_the_entrance():
    rng = np.random.default_rng(4)
    for _ in range(20):
        tracks, scores = tables(rng, 10, 3.0)
        rotation, t = rotation_of(rng.normal(size=3)), rng.uniform((-1.0, -0.5, 3.0), (1.0, 0.5, 9.0))
        solution = Solution.zeros()
        solution["rotation"], solution["pose"]["translation_m"] = rotation, t
        sights, followed = find_sights(tracks, scores, solution, LAW, 7)
        centre = rotation @ CENTRE_M + t
        wanted = [*centre / np.linalg.norm(centre), *CAMERA.project(centre[None])[0], 1.0, np.linalg.norm(centre)]
        assert numbers(sights, LONG_RANGE) == pytest.approx(wanted)
        same(sights, ENTRANCE, plain(tracks, scores, -1)[1])
        assert followed == 7


def test_no_track_no_bearing():
    sights, followed = find_sights(Track.zeros(0), np.zeros((0, WINDOW)), NO_POSE, LAW, 3)
    assert np.isnan(sights["score"]).all()
    assert followed == 3
