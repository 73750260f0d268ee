"""Detectors beside each other: what is counted is what is labelled."""

import json

import numpy as np
import pytest

from auvdock.cli.main import main
from auvdock.dataset.frames import FrameLabels, LabelledImage
from auvdock.experiments import detection_a
from auvdock.experiments.detection_a import BANDS, ROWS, score_detector

pytest.importorskip("pycocotools")


def frame(places, ignored=None, c_range=3.0):
    """Sharp blue lights on a dark picture with noise."""
    v, u = np.mgrid[:160, :240]
    image = np.random.default_rng(0).normal(8.0, 1.5, (160, 240, 3))
    for x, y in places:
        spot = 240.0 * np.exp(-0.5 * ((u - x) ** 2 + (v - y) ** 2) / 4.0)
        image += spot[:, :, None] * np.array([0.3, 0.7, 1.0])
    centre = np.array(places, dtype=float).reshape(-1, 2)
    none = np.zeros(len(centre), dtype=bool) if ignored is None else np.array(ignored)
    box = np.hstack([centre - 5.0, centre + 5.0])
    labels = FrameLabels(np.zeros(len(centre), dtype=np.int64), box, centre, none, np.full(len(centre), c_range))
    return LabelledImage(np.clip(np.rint(image), 0, 255).astype(np.uint8), labels)


PLACES = [(40.3, 50.7), (120.0, 80.2), (200.6, 30.1)]


def test_lights_that_count_are_found_in_their_band_where_they_are():
    told = []
    frames = [frame(PLACES, [False, False, True]), frame(PLACES[:1], c_range=10.0), frame([])]
    score = score_detector("threshold", frames, lambda: told.append(1))
    assert (score.frames, score.lights, len(told)) == (3, 3, 3)
    assert score.recall == 1.0
    assert score.false_alarms == 0.0
    assert score.median_error_px <= score.p95_error_px < 0.3
    assert [share is not None for share in score.band_recall] == [False, True, False, True, False]
    assert score.precision.keypoint_50 == pytest.approx(1.0)


def test_lights_elsewhere_are_missed_and_false():
    moved = frame(PLACES)
    labels = moved.labels
    far = FrameLabels(labels.class_id, labels.xyxy + 30.0, labels.centre_px + 30.0, labels.ignored, labels.c_range)
    score = score_detector("threshold", [LabelledImage(moved.image, far)])
    assert score.recall == 0.0
    assert score.false_alarms == 3.0
    assert score.precision.keypoint_50 == 0.0


def test_the_command_tells_of_all_detectors(monkeypatch, capsys):
    monkeypatch.setattr(detection_a, "stream_frames", lambda *_: iter([frame(PLACES)] * 9))
    assert main(["reproduce", "detection-a", "--frames", "2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["detector"] for row in told["rows"]] == list(ROWS)
    assert {"threshold", "blob", "paper_a_light"} <= set(ROWS)
    assert all(row["lights"] == 6 and len(row["band_recall"]) == len(BANDS) - 1 for row in told["rows"])
    assert main(["reproduce", "detection-a", "--frames", "2"]) == 0
    shown = capsys.readouterr().out
    assert all(shown.count(name) == 3 for name in ROWS)


def test_a_folder_that_is_none_is_one_line(tmp_path, capsys):
    assert main(["reproduce", "detection-a", "--data", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
