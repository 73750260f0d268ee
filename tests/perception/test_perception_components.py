"""Components and smoothed channels against OpenCV's."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.perception.components import components, components_and_peaks
from auvdock.perception.spots import brightest_channel, mean_channel


@st.composite
def images(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = draw(st.tuples(st.integers(1, 60), st.integers(1, 60)))
    image = (rng.random(shape) * 255).astype(np.uint8)
    sigma = draw(st.sampled_from([0.0, 0.5, 1.0, 2.0]))
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma)) if sigma else image


@settings(max_examples=200, deadline=None)
@given(images(), st.floats(0.0, 255.0))
def test_components_are_opencvs(image, threshold):
    _, mask = cv2.threshold(image, threshold, 255, cv2.THRESH_BINARY)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    found = components(image, threshold)
    assert sorted(found.tolist()) == sorted(map(tuple, stats[1:].tolist()))
    rng = np.random.default_rng(0)
    taken = np.column_stack([rng.integers(0, image.shape[1], 3), rng.integers(0, image.shape[0], 3)])
    again, peaks = components_and_peaks(image, threshold, taken)
    assert np.array_equal(again, found)
    for area, (peak, column, row, held) in zip(found["area"], peaks.tolist(), strict=True):
        part = labels == labels[row, column]
        assert area == np.count_nonzero(part)
        assert peak == image[part].max() == image[row, column]
        assert held == np.count_nonzero(part[taken[:, 1], taken[:, 0]])


def test_components_come_row_by_row():
    image = np.zeros((6, 9), dtype=np.uint8)
    image[4, 0] = image[2, 7] = image[2, 3] = image[3, 4] = 200
    assert components(image, 100.0).tolist() == [(3, 2, 2, 2, 2), (7, 2, 1, 1, 1), (0, 4, 1, 1, 1)]


def test_a_spiral_is_one_and_parts_of_an_image_are_read():
    spiral = np.zeros((9, 9), dtype=np.uint8)
    spiral[0, :] = spiral[:, 8] = spiral[8, :] = 90
    spiral[2:, 0] = spiral[2, :7] = spiral[2:7, 6] = spiral[6, 2:7] = spiral[4, 3] = 90
    assert len(components(spiral, 50.0)) == 2
    wide = np.zeros((20, 30), dtype=np.uint8)
    wide[5:14, 7:16] = spiral
    assert np.array_equal(components(wide[5:14, 7:16], 50.0), components(spiral, 50.0))


@pytest.mark.parametrize("size", [(16, 16), (17, 40), (360, 640)])
def test_smoothed_channels_are_opencvs(size):
    image = (np.random.default_rng(1).random((*size, 3)) * 255.99).astype(np.uint8)
    red, green, blue = cv2.split(image)
    brightest = cv2.GaussianBlur(cv2.max(cv2.max(red, green), blue), (3, 3), 0.8)
    assert np.array_equal(brightest_channel(image), brightest)
    mean = cv2.GaussianBlur(cv2.transform(image, np.full((1, 3), 1.0 / 3.0)), (3, 3), 0.8)
    assert np.array_equal(mean_channel(image), mean)
    assert np.array_equal(mean_channel(image[2:14, 3:15]), mean_channel(image[2:14, 3:15].copy()))
