"""What goes into a network and comes out: pixels stay where they are."""

import numpy as np
import pytest

from auvdock.perception.network_pictures import network_input, network_objects
from auvdock.perception.suppression import SuppressionCfg

SIZE = (50, 40)


def said(*rows):
    """(8, n): box's middle and size, score, keypoint and its visibility."""
    return np.array(rows, dtype=float).reshape(-1, 8).T


@pytest.mark.parametrize(("height", "width"), [(40, 50), (64, 96), (1, 1)])
def test_a_picture_is_padded_by_its_own_border_and_does_not_move(height, width):
    image = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    given = network_input(image, 32)
    assert given.dtype == np.float32
    assert [size % 32 for size in given.shape[2:]] == [0, 0]
    assert [size - there < 32 for size, there in zip(given.shape[2:], image.shape, strict=False)] == [True, True]
    codes = np.rint(given[0] * 255.0).transpose(1, 2, 0)
    np.testing.assert_array_equal(codes[:height, :width], image)
    np.testing.assert_array_equal(codes[height:, :width], np.broadcast_to(image[-1:], codes[height:, :width].shape))
    np.testing.assert_array_equal(
        codes[:, width:], np.broadcast_to(codes[:, width - 1 : width], codes[:, width:].shape)
    )


def test_the_middle_of_the_first_pixel_is_half_a_pixel_for_the_network_and_zero_here():
    found = network_objects(said([12.5, 20.5, 10.0, 8.0, 0.9, 13.0, 21.0, 1.0]), 1, SIZE, SuppressionCfg())
    np.testing.assert_allclose(found.xyxy, [[7.0, 16.0, 17.0, 24.0]])
    np.testing.assert_allclose(found.keypoints_px, [[[12.5, 20.5]]])


def test_what_lies_in_the_padding_is_left_out_and_boxes_end_at_the_border():
    inside, beside = [49.0, 39.0, 12.0, 12.0, 0.5, 49.9, 39.9, 1.0], [56.0, 20.0, 10.0, 10.0, 0.9, 56.0, 20.0, 1.0]
    found = network_objects(said(inside, beside), 1, SIZE, SuppressionCfg())
    np.testing.assert_allclose(found.scores, [0.5])
    np.testing.assert_allclose(found.xyxy[0, 2:], [49.5, 39.5])


def test_the_surest_are_kept():
    rows = [[10.0 * k, 10.0, 4.0, 4.0, 0.2 * k, 10.0 * k, 10.0, 1.0] for k in range(1, 5)]
    found = network_objects(said(*rows), 1, SIZE, SuppressionCfg(min_score=0.3), most=2)
    np.testing.assert_allclose(found.scores, [0.8, 0.6])


@pytest.mark.parametrize("keypoints", [0, 1])
def test_nothing_sure_enough_is_nothing(keypoints):
    found = network_objects(np.zeros((5 + 3 * keypoints, 21)), 1, SIZE, SuppressionCfg())
    assert found.xyxy.shape == (0, 4)
    assert found.keypoints_px.shape == (0, keypoints, 2)
