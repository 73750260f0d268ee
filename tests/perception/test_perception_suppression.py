"""One detection a light: what algorithm 1 promises of any boxes; OpenCV's suppression where keypoints say nothing."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.arrays import ShapeError
from auvdock.core.errors import ConfigError
from auvdock.perception.suppression import SuppressionCfg, box_overlap, keypoint_similarity, suppress


def crowd(seed, count=40, keypoints=1):
    """Boxes of several sizes about a few lights, their keypoints a little off, scores that differ."""
    rng = np.random.default_rng(seed)
    lights = rng.uniform(40.0, 200.0, (6, 2))
    centre = lights[rng.integers(6, size=count)] + rng.normal(0.0, 4.0, (count, 2))
    half = rng.uniform(3.0, 30.0, (count, 2))
    points = centre[:, None] + rng.normal(0.0, 3.0, (count, keypoints, 2))
    return np.hstack((centre - half, centre + half)), rng.permutation(np.linspace(0.02, 0.98, count)), points


def area(box):
    return (box[2] - box[0]) * (box[3] - box[1])


@given(
    seed=st.integers(0, 2**32 - 1),
    overlap=st.floats(0.05, 0.95),
    similarity=st.floats(0.05, 0.95),
    keypoints=st.integers(0, 3),
)
@settings(max_examples=25, deadline=None)
def test_who_stays_and_who_goes(seed, overlap, similarity, keypoints):
    xyxy, scores, points = crowd(seed, keypoints=keypoints)
    cfg = SuppressionCfg(min_score=0.1, max_overlap=overlap, max_similarity=similarity)

    def like(surer, other):
        if box_overlap(xyxy[surer], xyxy[[other]])[0] >= overlap:
            return True
        if not keypoints:
            return False
        close = keypoint_similarity(points[surer], points[[other]], area(xyxy[surer]), cfg.keypoint_constant)
        return close[0] >= similarity

    kept = suppress(xyxy, scores, points, cfg)
    assert np.all(np.diff(scores[kept]) < 0.0)
    assert scores[kept].min() >= 0.1
    for place, row in enumerate(kept):
        assert not any(like(surer, row) for surer in kept[:place])
    for row in set(range(len(scores))) - set(kept.tolist()):
        assert scores[row] < 0.1 or any(like(surer, row) for surer in kept if scores[surer] > scores[row])


@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(0.2, 5.0))
@settings(max_examples=30, deadline=None)
def test_neither_order_nor_place_nor_scale_of_the_picture_matter(seed, scale):
    xyxy, scores, points = crowd(seed)
    cfg = SuppressionCfg()
    kept = suppress(xyxy, scores, points, cfg)
    order = np.random.default_rng(seed).permutation(len(scores))
    again = suppress(xyxy[order] * scale + 100.0, scores[order], points[order] * scale + 100.0, cfg)
    assert order[again].tolist() == kept.tolist()


@pytest.mark.parametrize("overlap", [0.2, 0.45, 0.7])
def test_by_overlap_alone_it_is_what_opencv_does(overlap):
    for seed in range(20):
        xyxy, scores, points = crowd(seed, 80)
        kept = suppress(xyxy, scores, points, SuppressionCfg(max_overlap=overlap, max_similarity=2.0))
        boxes = np.hstack((xyxy[:, :2], xyxy[:, 2:] - xyxy[:, :2]))
        assert kept.tolist() == np.ravel(cv2.dnn.NMSBoxes(boxes.tolist(), scores.tolist(), 0.1, overlap)).tolist()


def test_a_halos_large_box_goes_and_a_neighbours_box_stays():
    small, halo, neighbour = [95.0, 95.0, 105.0, 105.0], [80.0, 80.0, 120.0, 120.0], [102.0, 95.0, 112.0, 105.0]
    xyxy, scores = np.array([small, halo, neighbour]), np.array([0.9, 0.8, 0.7])
    points = np.array([[[100.0, 100.0]], [[100.5, 100.0]], [[107.0, 100.0]]])
    assert suppress(xyxy, scores, points, SuppressionCfg()).tolist() == [0, 2]
    assert suppress(xyxy, scores, points, SuppressionCfg(max_similarity=2.0)).tolist() == [0, 1, 2]
    # With the usual constant of one keypoint a neighbour 0.7 sides away is the same light.
    assert suppress(xyxy, scores, points, SuppressionCfg(keypoint_constant=2.0)).tolist() == [0]


def test_half_a_side_apart_is_similarity_one_half():
    points, others = np.array([[10.0, 10.0]]), np.array([[[10.0, 10.0]], [[13.0, 14.0]]])
    similarity = keypoint_similarity(points, others, 100.0, SuppressionCfg().keypoint_constant)
    np.testing.assert_allclose(similarity, [1.0, 0.5])


def test_no_detections_and_empty_boxes():
    assert suppress(np.empty((0, 4)), np.empty(0), np.empty((0, 1, 2)), SuppressionCfg()).shape == (0,)
    flat = np.array([[5.0, 5.0, 5.0, 5.0], [5.0, 5.0, 5.0, 5.0]])
    kept = suppress(flat, np.array([0.5, 0.4]), np.array([[[5.0, 5.0]], [[9.0, 5.0]]]), SuppressionCfg())
    assert kept.tolist() == [0, 1]


def test_shapes_and_settings_that_do_not_fit():
    with pytest.raises(ShapeError):
        suppress(np.zeros((2, 4)), np.zeros(3), np.zeros((3, 1, 2)), SuppressionCfg())
    with pytest.raises(ConfigError, match="min_score"):
        SuppressionCfg(min_score=1.5)
