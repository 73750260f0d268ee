"""What a detector of one's own gives is checked where it comes in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from perception_scenes import CAMERA

from auvdock.core.contracts import Detections, Frame
from auvdock.core.errors import ConfigError
from auvdock.perception.checked_detector import CheckedDetector

FRAME = Frame(np.zeros((CAMERA.height_px, CAMERA.width_px, 3), np.uint8), 0.25, CAMERA)
RIGHT = {
    "xyxy": np.array([[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]),
    "centre_px": np.array([[2.0, 3.0], [6.0, 7.0]]),
    "score": np.array([0.0, 1.0]),
    "class_id": np.array([0, 1]),
    "flux": np.array([0.0, 2.5]),
}


class Own:
    def __init__(self, make):
        self._make = make

    def detect(self, frame, regions=()):
        return self._make()


def checked(**columns):
    return CheckedDetector("mine:Own", Own(lambda: Detections(**{**RIGHT, **columns}))).detect(FRAME)


def test_what_is_right_passes_unchanged_and_in_the_types_that_are_promised():
    small = {"xyxy": RIGHT["xyxy"].astype(np.float32), "class_id": RIGHT["class_id"].astype(np.uint8), "flux": None}
    for columns in ({}, small):
        found = checked(**columns)
        for name in ("xyxy", "centre_px", "score", "class_id"):
            assert np.array_equal(getattr(found, name), RIGHT[name])
        assert (found.xyxy.dtype, found.class_id.dtype) == (np.float64, np.int64)
    assert len(CheckedDetector("mine:Own", Own(Detections.empty)).detect(FRAME)) == 0


@settings(max_examples=100, derandomize=True, deadline=None, database=None)
@given(data=st.data())
def test_one_wrong_number_is_refused_with_detector_and_field(data: st.DataObject):
    name = data.draw(st.sampled_from(sorted(RIGHT)))
    values = np.array(RIGHT[name], dtype=float)
    wrong = [np.nan, np.inf, -np.inf]
    wrong += [-0.1, 1.1] if name == "score" else [0.5, 2.0, -1.0] if name == "class_id" else []
    place = data.draw(st.integers(0, values.size - 1))
    values.flat[place] = data.draw(st.sampled_from(wrong))
    with pytest.raises(ConfigError) as caught:
        checked(**{name: values})
    assert (caught.value.field, caught.value.value) == ("perception.detector", "mine:Own")
    assert name in caught.value.remedy
    assert "0.250 s" in caught.value.remedy


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ({"xyxy": RIGHT["xyxy"][:, [2, 1, 0, 3]]}, "left <= right"),
        ({"xyxy": np.zeros((2, 3))}, "xyxy has shape"),
        ({"xyxy": np.zeros((3, 4))}, "xyxy has shape"),
        ({"centre_px": [[1.0, 2.0], [3.0, 4.0]]}, "centre_px is a list"),
        ({"score": 0.5}, "score is a float"),
        ({"score": np.array(0.5)}, "score has shape"),
        ({"score": np.array(["a", "b"])}, "score as an array of numbers"),
        ({"flux": np.zeros(3)}, "flux has shape"),
    ],
)
def test_what_does_not_belong_together_is_refused(columns, told):
    with pytest.raises(ConfigError, match=told):
        checked(**columns)


@pytest.mark.parametrize("answer", [None, [], np.zeros((0, 4))])
def test_another_kind_of_answer_is_refused(answer):
    with pytest.raises(ConfigError, match="type Detections"):
        CheckedDetector("mine:Own", Own(lambda: answer)).detect(FRAME)
