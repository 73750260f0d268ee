"""The compiled frame of all tracks against a plain one: matrices, loops and the Hungarian method in every frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array
from auvdock.core.contracts import BLUE, RED, Detections
from auvdock.numeric.tracks import Track
from auvdock.perception.tracker import LightTracker, TrackerCfg

RATE_HZ = 30.0
WIDTH_PX, HEIGHT_PX = 640, 360
DT = 1.0 / RATE_HZ
F = np.array([[1.0, DT], [0.0, 1.0]])


@dataclass
class PlainTrack:
    """x is (2, 2): position and velocity, one column for each axis."""

    track_id: int
    class_id: int
    x: Array
    p: Array
    scores: list[float]
    missed: int = 0
    hits: int = 1
    detection: int = -1


@dataclass
class PlainTracker:
    cfg: TrackerCfg
    tracks: list[PlainTrack] = field(default_factory=list)
    next_id: int = 0

    def update(self, seen: Detections) -> None:
        cfg = self.cfg
        variance = cfg.pixel_sigma_px**2 / (seen.score + 0.1)
        q = cfg.acceleration_px_s2**2 * np.array([[DT**4 / 4, DT**3 / 2], [DT**3 / 2, DT**2]])
        for track in self.tracks:
            track.x, track.p = F @ track.x, F @ track.p @ F.T + q
        self._assign(seen, variance)
        for track in self.tracks:
            j = track.detection
            if j >= 0:
                gain = track.p[:, :1] / (track.p[0, 0] + variance[j])
                track.x = track.x + gain * (seen.centre_px[j] - track.x[0])
                track.p = track.p - gain @ track.p[:1]
                track.missed, track.hits = 0, track.hits + 1
            else:
                track.missed += 1
            track.scores = [*track.scores, seen.score[j] if j >= 0 else 0.0][-cfg.window_frames :]
        self.tracks = [track for track in self.tracks if self._goes_on(track)]
        for j in sorted(set(range(len(seen))) - {track.detection for track in self.tracks}):
            x = np.array([seen.centre_px[j], [0.0, 0.0]])
            p = np.diag([variance[j], cfg.initial_speed_px_s**2])
            scores = [float(seen.score[j])]
            self.tracks.append(PlainTrack(self.next_id, int(seen.class_id[j]), x, p, scores, detection=j))
            self.next_id += 1

    def _assign(self, seen: Detections, variance: Array) -> None:
        cost = np.full((len(self.tracks), len(seen)), 40.0)
        for i, track in enumerate(self.tracks):
            for j in range(len(seen)):
                s = track.p[0, 0] + variance[j]
                d2 = float(np.sum((seen.centre_px[j] - track.x[0]) ** 2))
                if track.class_id == seen.class_id[j] and d2 / s <= self.cfg.gate_sigmas**2:
                    cost[i, j] = d2 / s + 2.0 * math.log(s / variance[j])
            track.detection = -1
        for i, j in zip(*linear_sum_assignment(cost), strict=True):
            if cost[i, j] != 40.0:
                self.tracks[i].detection = int(j)

    def _goes_on(self, track: PlainTrack) -> bool:
        cfg, (u, v) = self.cfg, track.x[0]
        most = cfg.max_predicted_frames if track.hits >= cfg.confirm_hits else cfg.max_tentative_frames
        inside = -0.1 * WIDTH_PX < u < 1.1 * WIDTH_PX and -0.1 * HEIGHT_PX < v < 1.1 * HEIGHT_PX
        return track.missed <= most and inside


def same(lights: LightTracker, plain: PlainTracker) -> None:
    assert len(lights) == len(plain.tracks)
    for name in ("track_id", "class_id", "missed", "hits", "detection"):
        assert getattr(lights, name).tolist() == [getattr(track, name) for track in plain.tracks]
    for row, track in enumerate(plain.tracks):
        mine = Track.read(lights.table, row)
        np.testing.assert_allclose([mine.centre_px, mine.velocity_px_s], track.x, rtol=1e-9, atol=1e-8)
        covariance = [mine.p00_px2, mine.p01_px2_s, mine.p11_px2_s2]
        np.testing.assert_allclose(covariance, track.p[[0, 0, 1], [0, 1, 1]], rtol=1e-9, atol=1e-12)
        assert sorted(filter(None, lights.scores[row].tolist())) == sorted(filter(None, track.scores))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    lamps=st.integers(0, 9),
    spread_px=st.sampled_from([4.0, 15.0, 60.0, 250.0]),
    seen_share=st.sampled_from([0.5, 0.9, 1.0]),
    false_lights=st.integers(0, 3),
)
def test_frames_equal_the_plain_ones(seed: int, lamps: int, spread_px: float, seen_share: float, false_lights: int):
    """Lamps near and far apart that come, go, cross and leave the image, with false lights: the same in every frame."""
    rng = np.random.default_rng(seed)
    cfg = TrackerCfg()
    lights, plain = LightTracker(cfg, RATE_HZ, WIDTH_PX, HEIGHT_PX), PlainTracker(cfg)
    start = np.array([320.0, 180.0]) + rng.uniform(-spread_px, spread_px, (lamps, 2))
    speed = rng.normal(0.0, 8.0, 2) + rng.normal(0.0, 1.0, (lamps, 2))
    kinds = rng.choice([BLUE, RED], lamps)
    for frame in range(40):
        there = rng.uniform(size=lamps) < seen_share
        centre = (start + frame * speed + rng.normal(0.0, 0.3, (lamps, 2)))[there]
        stray = rng.uniform((0.0, 0.0), (WIDTH_PX, HEIGHT_PX), (false_lights, 2))
        centre = np.vstack([centre, stray])
        order = rng.permutation(len(centre))
        kind = np.concatenate([kinds[there], rng.choice([BLUE, RED], false_lights)])
        seen = Detections.from_points(centre[order], rng.uniform(0.1, 1.0, len(centre)), kind[order].astype(np.int64))
        lights.update(seen)
        plain.update(seen)
        same(lights, plain)


def test_room_for_any_number_of_lights():
    """More lights in one frame than there was room for: none is lost, and those known before keep their tracks."""
    lights = LightTracker(TrackerCfg(), RATE_HZ, WIDTH_PX, HEIGHT_PX)
    grid = np.array([(u, v) for u in range(20, 620, 40) for v in range(20, 340, 40)], dtype=np.float64)

    def show(count: int) -> None:
        kinds = np.full(count, BLUE, dtype=np.int64)
        lights.update(Detections.from_points(grid[:count], np.full(count, 0.8), kinds))

    show(20)
    lights.beacon_id[3] = 5
    for count in (40, len(grid)):
        show(count)
        assert lights.track_id.tolist() == list(range(count))
        assert lights.detection.tolist() == list(range(count))
        assert lights.beacon_id.tolist() == [5 if row == 3 else -1 for row in range(count)]
    assert lights.hits[:20].tolist() == [3] * 20
    np.testing.assert_allclose(lights.centre_px, grid, atol=1e-9)
    lights.reset()
    assert len(lights) == 0
    show(2)
    assert lights.track_id.tolist() == [0, 1]


def test_views_stay_when_the_tracker_goes_on():
    lights = LightTracker(TrackerCfg(), RATE_HZ, WIDTH_PX, HEIGHT_PX)
    kinds = np.array([BLUE, RED])
    lights.update(Detections.from_points(np.array([[100.0, 100.0], [300.0, 200.0]]), np.full(2, 0.9), kinds))
    views = lights.views()
    lights.update(Detections.from_points(np.array([[101.0, 100.0]]), np.full(1, 0.9), kinds[:1]))
    assert [view.centre_px.tolist() for view in views] == [[100.0, 100.0], [300.0, 200.0]]
    assert [view.missed for view in views] == [0, 0]
    assert lights.missed.tolist() == [0, 1]
