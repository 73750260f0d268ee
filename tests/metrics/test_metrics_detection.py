"""Figures of detection: known answers give known figures."""

import numpy as np
import pytest

from auvdock.metrics.detection import Found, Truth, average_precision, match_centres


def boxes(centres, side=12.0):
    centre = np.array(centres, dtype=float).reshape(-1, 2)
    return np.hstack([centre - side / 2, centre + side / 2]), centre


def truth(centres, ignored=None):
    box, centre = boxes(centres)
    return Truth(box, centre, np.zeros(len(centre), dtype=bool) if ignored is None else np.array(ignored))


def found(centres, scores=None, side=12.0):
    box, centre = boxes(centres, side)
    return Found(box, centre, np.full(len(centre), 0.9) if scores is None else np.array(scores))


class TestAveragePrecision:
    @pytest.fixture(autouse=True)
    def _need(self):
        pytest.importorskip("pycocotools")

    def test_all_found_in_place_is_one_and_nothing_found_is_nought(self):
        places = [[20.0, 20.0], [60.0, 30.0]]
        perfect = average_precision([truth(places)] * 3, [found(places)] * 3)
        assert perfect.box_50 == perfect.box == perfect.keypoint_50 == pytest.approx(1.0)
        nothing = average_precision([truth(places)], [found([])])
        assert nothing.box_50 == nothing.box == nothing.keypoint_50 == 0.0

    def test_half_of_the_lights_is_half(self):
        score = average_precision([truth([[20.0, 20.0], [60.0, 30.0]])], [found([[20.0, 20.0]])])
        assert score.box_50 == pytest.approx(0.5, abs=0.01)

    def test_what_is_ignored_is_neither_missed_nor_false(self):
        places = [[20.0, 20.0], [60.0, 30.0]]
        there = [truth(places, [False, True])]
        for answer in (found(places, [0.5, 0.9]), found(places[:1])):
            assert average_precision(there, [answer]).box_50 == pytest.approx(1.0)
        assert average_precision(there, [found([*places, [90.0, 90.0]], [0.5, 0.4, 0.9])]).box_50 < 0.6

    def test_keypoints_half_a_side_away_are_the_limit(self):
        for shift, expected in ((5.9, 1.0), (6.1, 0.0)):
            answer = Found(*boxes([[20.0, 20.0]])[:1], np.array([[20.0 + shift, 20.0]]), np.array([0.9]))
            score = average_precision([truth([[20.0, 20.0]])], [answer])
            assert score.keypoint_50 == pytest.approx(expected)
            assert score.box_50 == pytest.approx(1.0)

    def test_a_box_twice_as_large_is_no_box_at_half_overlap(self):
        score = average_precision([truth([[20.0, 20.0]])], [found([[20.0, 20.0]], side=24.0)])
        assert (score.box_50, score.keypoint_50) == (pytest.approx(0.0), pytest.approx(1.0))


def test_each_light_is_given_to_one_detection_the_surest_first():
    match = match_centres(truth([[20.0, 20.0]]), found([[23.0, 20.0], [20.5, 20.0]], [0.9, 0.8]), 0.0)
    assert match.found.tolist() == [True]
    assert match.error_px.tolist() == [3.0]
    assert match.false_alarms == 1


def test_far_off_unsure_and_ignored():
    there = truth([[20.0, 20.0], [60.0, 20.0], [90.0, 20.0]], [False, False, True])
    answer = found([[27.0, 20.0], [60.0, 21.0], [90.0, 20.0], [20.0, 20.0]], [0.9, 0.8, 0.7, 0.1])
    match = match_centres(there, answer, 0.2)
    assert match.found.tolist() == [False, True]
    assert match.false_alarms == 1
    assert np.isnan(match.error_px[0])
    assert match.error_px[1] == 1.0
