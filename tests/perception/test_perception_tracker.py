"""Tracker: equal to filterpy's Kalman filter, unbiased, and as patient as paper A says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

from auvdock.core.contracts import BLUE, RED, Detections
from auvdock.core.errors import ConfigError
from auvdock.numeric.tracks import Track
from auvdock.perception.tracker import LightTracker, TrackerCfg

RATE_HZ = 30.0
DT = 1.0 / RATE_HZ


def tracker(cfg: TrackerCfg | None = None) -> LightTracker:
    return LightTracker(cfg or TrackerCfg(), RATE_HZ, 640, 360)


def seen(*centres: tuple[float, float], score: float = 0.9, class_id: int = BLUE) -> Detections:
    n = len(centres)
    return Detections.from_points(
        np.array(centres, dtype=np.float64).reshape(n, 2), np.full(n, score), np.full(n, class_id, dtype=np.int64)
    )


def test_equals_filterpy_kalman_filter():
    """The batched filter and filterpy's own agree to 1e-9 over updates, misses and changing confidence."""
    cfg = TrackerCfg(gate_sigmas=50.0)
    rng = np.random.default_rng(1)
    mine = tracker(cfg)
    q = np.asarray(Q_discrete_white_noise(2, DT, cfg.acceleration_px_s2**2), dtype=np.float64)
    reference: list[Any] = []
    starts = np.array([[100.0, 80.0], [500.0, 300.0]])
    for frame in range(40):
        score = float(rng.uniform(0.2, 1.0))
        centres = starts + frame * np.array([0.7, -0.4]) + rng.normal(0.0, 0.5, (2, 2))
        visible = [index for index in range(2) if frame == 0 or (frame + index) % 4]
        mine.update(seen(*[tuple(centres[i]) for i in visible], score=score))
        noise = cfg.pixel_sigma_px**2 / (score + 0.1)
        for index in range(2):
            if frame == 0:
                kf: Any = KalmanFilter(dim_x=4, dim_z=2)
                kf.F = np.kron(np.array([[1.0, DT], [0.0, 1.0]]), np.eye(2))
                kf.H = np.hstack([np.eye(2), np.zeros((2, 2))])
                kf.Q = np.kron(q, np.eye(2))
                kf.x = np.concatenate([centres[index], [0.0, 0.0]])[:, None]
                kf.P = np.diag([noise, noise, cfg.initial_speed_px_s**2, cfg.initial_speed_px_s**2])
                reference.append(kf)
                continue
            reference[index].predict()
            if index in visible:
                reference[index].update(centres[index][:, None], R=noise * np.eye(2))
        order = np.argsort(mine.centre_px[:, 0])
        for index, row in enumerate(order):
            track, p = Track.read(mine.table, int(row)), reference[index].P
            state = [*track.centre_px, *track.velocity_px_s]
            np.testing.assert_allclose(state, reference[index].x.ravel(), rtol=0, atol=1e-9)
            covariance = [track.p00_px2, track.p01_px2_s, track.p11_px2_s2]
            np.testing.assert_allclose(covariance, [p[0, 0], p[0, 2], p[2, 2]], rtol=1e-9)


def test_survives_ten_missed_frames_and_dies_at_the_eleventh():
    lights = tracker()
    for frame in range(5):
        lights.update(seen((300.0 + frame, 180.0)))
    for missed in range(1, 11):
        lights.update(Detections.empty())
        assert len(lights) == 1
        assert lights.missed[0] == missed
    # Prediction runs on at the light's own speed of 1 px a frame; 10 frames at ±1.5 px/s of filter error.
    assert lights.centre_px[0, 0] == pytest.approx(314.0, abs=1.0)
    lights.update(Detections.empty())
    assert len(lights) == 0


def test_identity_is_kept_over_a_gap():
    lights = tracker()
    for frame in range(6):
        lights.update(seen((300.0 + 2.0 * frame, 180.0)))
    track_id = int(lights.track_id[0])
    for _ in range(8):
        lights.update(Detections.empty())
    lights.update(seen((300.0 + 2.0 * 14, 180.0)))
    assert lights.track_id.tolist() == [track_id]
    assert lights.missed[0] == 0


def test_unconfirmed_track_dies_early():
    lights = tracker()
    lights.update(seen((300.0, 180.0)))
    for _ in range(TrackerCfg().max_tentative_frames):
        lights.update(Detections.empty())
        assert len(lights) == 1
    lights.update(Detections.empty())
    assert len(lights) == 0


def test_constant_velocity_is_unbiased():
    """Mean error over 400 runs within 4 standard errors of zero, in position and velocity."""
    rng = np.random.default_rng(2)
    velocity = np.array([45.0, -30.0])
    errors: list[np.ndarray] = []
    for _ in range(400):
        lights = tracker(TrackerCfg(gate_sigmas=10.0))
        truth = np.array([200.0, 150.0])
        for frame in range(25):
            truth = np.array([200.0, 150.0]) + velocity * frame * DT
            lights.update(seen(tuple(truth + rng.normal(0.0, 0.5, 2))))
        assert len(lights) == 1
        track = Track.read(lights.table)
        errors.append(np.concatenate([track.centre_px - truth, track.velocity_px_s - velocity]))
    table = np.array(errors)
    standard_error = table.std(axis=0) / np.sqrt(len(table))
    assert (np.abs(table.mean(axis=0)) < 4.0 * standard_error).all()
    # And the filter is worth having: less scatter than a single detection's 0.5 px.
    assert (table[:, :2].std(axis=0) < 0.45).all()


def test_assigns_by_motion_and_class():
    """A blue and a red light that cross keep their tracks; so do two blue lights passing 6 px apart."""
    lights = tracker()
    ids: dict[str, int] = {}
    for frame in range(30):
        x = 300.0 + 2.0 * frame
        detections = Detections.from_points(
            np.array([[x, 100.0], [360.0 - 2.0 * frame, 100.0], [x, 200.0], [360.0 - 2.0 * frame, 206.0]]),
            np.full(4, 0.9),
            np.array([BLUE, RED, BLUE, BLUE]),
        )
        lights.update(detections)
        now = {
            name: int(lights.track_id[lights.detection == index][0])
            for index, name in enumerate(("blue", "red", "low", "high"))
        }
        ids = ids or now
        assert now == ids
    assert len(lights) == 4


def test_no_detection_no_track():
    lights = tracker()
    for _ in range(5):
        lights.update(Detections.empty())
    assert len(lights) == 0
    assert lights.mean_confidence().shape == (0,)


def test_track_that_leaves_the_image_ends():
    lights = tracker()
    for frame in range(8):
        lights.update(seen((600.0 + 12.0 * frame, 180.0)))
    for _ in range(3):
        lights.update(Detections.empty())
    assert len(lights) == 0


def test_window_statistics():
    lights = tracker()
    for frame in range(6):
        lights.update(seen((300.0, 180.0), score=0.6) if frame % 2 == 0 else Detections.empty())
    assert sorted(lights.scores[0].tolist()) == [0.0] * 3 + [0.6] * 3
    assert lights.mean_confidence()[0] == pytest.approx(0.6)


@pytest.mark.parametrize("field", ["pixel_sigma_px", "acceleration_px_s2", "gate_sigmas", "confirm_hits"])
def test_bad_setting_is_refused(field: str):
    with pytest.raises(ConfigError, match=field):
        TrackerCfg(**{field: 0})
