"""False poses: counted one by one, since a median hides them."""

import math

import pytest

from auvdock.metrics.false_poses import FalsePoses, is_false


def test_near_the_station_the_bound_is_0_3_m_and_far_away_a_tenth_of_the_range():
    error_m = [0.29, 0.31, 0.99, 1.01, 1.99, 2.01]
    range_m = [1.0, 1.0, 10.0, 10.0, 20.0, 20.0]
    assert is_false(error_m, range_m).tolist() == [False, True, False, True, False, True]


@pytest.mark.parametrize("error_m", [math.nan, math.inf, 4e14])
def test_a_pose_that_is_no_number_or_absurd_is_false(error_m):
    assert is_false([error_m], [15.0]).tolist() == [True]


def test_without_a_pose_there_is_no_rate():
    assert FalsePoses.count((), ()) == FalsePoses(0, 0, None)
