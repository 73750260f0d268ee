"""Paper B's formulae and its algorithm 2."""

import math

import numpy as np
import pytest

from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import BLUE, Detections
from auvdock.core.errors import ConfigError
from auvdock.perception.rotating.algorithm_2 import PaperBCfg, PaperBForwardBeacon
from auvdock.perception.rotating.paper_b import (
    azimuth_from_time_deg,
    deviation_angles_rad,
    error_budget_deg,
    max_scan_rate_rev_s,
)

CAMERA = make_camera(
    CameraCfg(width_px=1920, height_px=1080), np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
)


def test_the_papers_own_numbers() -> None:
    """Section 4.1: 0.83 rev/s for 10° at 30 Hz; 8° for 0.5 rev/s and e = 2°."""
    assert max_scan_rate_rev_s(30.0, 10.0) == pytest.approx(0.83, abs=0.005)
    assert error_budget_deg(30.0, 0.5, 2.0) == pytest.approx(8.0)


def test_azimuth_goes_with_time_and_wraps_every_turn() -> None:
    """0.5 rev/s: a quarter turn in 0.5 s, the same after any number of turns."""
    assert azimuth_from_time_deg(10.5, 10.0, 0.5) == pytest.approx(90.0)
    assert azimuth_from_time_deg(10.5 + 7 * 2.0, 10.0, 0.5) == pytest.approx(90.0, abs=1e-6)


def test_deviation_angles_agree_with_the_camera_in_the_middle_and_at_the_edges() -> None:
    """Half fields of view at the edges, 0 in the middle; in between, equation 6 lacks the distortion."""
    middle_u, middle_v = 959.5, 539.5
    assert deviation_angles_rad(middle_u, middle_v, CAMERA) == (0.0, 0.0)
    right, _ = deviation_angles_rad(1919.5, middle_v, CAMERA)
    _, down = deviation_angles_rad(middle_u, 1079.5, CAMERA)
    assert math.degrees(right) == pytest.approx(42.5, abs=0.01)
    assert math.degrees(down) == pytest.approx(25.0, abs=0.01)
    x, _ = CAMERA.normalise(np.array([[1500.0, middle_v]]))[0].tolist()
    paper, _ = deviation_angles_rad(1500.0, middle_v, CAMERA)
    assert 0.3 < math.degrees(abs(paper - math.atan(x))) < 3.0


def _frame(width: float, height: float) -> Detections:
    box = np.array([[100.0 - width / 2, 50.0 - height / 2, 100.0 + width / 2, 50.0 + height / 2]])
    return Detections(box, np.array([[100.0, 50.0]]), np.array([0.9]), np.array([BLUE]))


def _run(sizes: list[tuple[float, float] | None], cfg: PaperBCfg, drop: tuple[int, ...] = ()) -> list[float]:
    """Times of the answers over frames at 30 Hz; None stands for a frame without detection."""
    forward = PaperBForwardBeacon(cfg, 30.0)
    found: list[float] = []
    for k, size in enumerate([*sizes, *([None] * 8)]):
        if k in drop:
            continue
        answer = forward.update(_frame(*size) if size else Detections.empty(), k / 30.0)
        if answer is not None:
            found.append(answer.time_s)
    last = forward.finish()
    return found if last is None else [*found, last.time_s]


SWEEP: list[tuple[float, float] | None] = [(4, 2), (6, 4), (9, 8), (12, 12), (10, 8), (6, 3), (3, 2)]


def test_the_largest_and_roundest_frame_wins() -> None:
    """The fourth of seven frames is both."""
    assert _run(SWEEP, PaperBCfg()) == [pytest.approx(3 / 30.0)]


def test_fewer_than_five_detections_give_nothing_as_printed() -> None:
    """The 10° beam's own two frames never fire with the printed minimum, and do with 2."""
    two: list[tuple[float, float] | None] = [(6, 5), (8, 8)]
    assert _run(two, PaperBCfg()) == []
    assert _run(two, PaperBCfg(min_detections=2)) == [pytest.approx(1 / 30.0)]
    assert _run([], PaperBCfg()) == []


def test_a_dropped_frame_is_filled_between_its_neighbours() -> None:
    """Without the best frame the gap is interpolated; without interpolation a neighbour wins."""
    sweep: list[tuple[float, float] | None] = [(4, 2), (8, 8), (12, 12), (8, 8), (10, 9), (6, 4), (3, 2)]
    times = _run(sweep, PaperBCfg(), drop=(3,))
    assert times == [pytest.approx(2 / 30.0)]
    uneven: list[tuple[float, float] | None] = [(4, 2), (10, 9), (12, 12), (12, 12), (6, 4), (3, 2)]
    without = _run(uneven, PaperBCfg(interpolate=False), drop=(2,))
    assert without == [pytest.approx(3 / 30.0)]


def test_passes_are_apart_after_five_frames_without_detection() -> None:
    """Two sweeps with a dark half turn between them are two answers."""
    dark: list[tuple[float, float] | None] = [None] * 20
    assert len(_run([*SWEEP, *dark, *SWEEP], PaperBCfg())) == 2


def test_senseless_settings_are_refused() -> None:
    """No weights, no counts."""
    with pytest.raises(ConfigError, match="min_detections"):
        PaperBCfg(min_detections=0)
    with pytest.raises(ConfigError, match="weight"):
        PaperBCfg(area_weight=0.0, shape_weight=0.0)
