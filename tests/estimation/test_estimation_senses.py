"""Senses: what is not finite counts as 0, and vectors turn as rotation matrices turn them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx
from auvdock.estimation.senses import read_senses
from auvdock.numeric.motion import Motion

angles = st.floats(-3.0, 3.0)
vectors = st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3).map(np.array)


def senses(euler, rate=(0.1, 0.2, 0.3), ground=(0.4, 0.5, 0.6), water=(0.7, 0.8, 0.9), depth=8.0):
    return read_senses(Proprioception(1.0, depth, np.array(euler), np.array(rate), np.array(ground), np.array(water)))


def test_every_reading_is_where_it_belongs():
    seen = senses([0.01, 0.02, 0.03])
    assert (seen.time_s, seen.depth_m, seen.roll_rad, seen.pitch_rad, seen.yaw_rad) == (1.0, 8.0, 0.01, 0.02, 0.03)
    assert seen.rate_rad_s == (0.1, 0.2, 0.3)
    assert seen.ground_m_s == (0.4, 0.5, 0.6)
    assert seen.surge_water_m_s == 0.7


def test_what_is_not_finite_counts_as_nothing():
    seen = senses([math.nan, 0.1, math.inf], (math.nan, 1.0, 2.0), (-math.inf, 1.0, 2.0), (math.nan,) * 3, math.nan)
    assert (seen.depth_m, seen.roll_rad, seen.pitch_rad, seen.yaw_rad) == (0.0, 0.0, 0.1, 0.0)
    assert seen.rate_rad_s == (0.0, 1.0, 2.0)
    assert seen.ground_m_s == (0.0, 1.0, 2.0)
    assert all(np.isfinite(seen.motion[name]).all() for name in Motion.dtype().names or ())


@settings(deadline=None)  # the first call may compile
@given(roll=angles, pitch=angles, heading=angles, vector=vectors)
def test_level_axes_are_those_of_the_rotation_matrix(roll, pitch, heading, vector):
    seen = senses([roll, pitch, 1.0])
    turned = rotation_from_euler_zyx(roll, pitch, heading) @ vector
    assert seen.level(heading, tuple(vector.tolist())) == pytest.approx(turned, abs=1e-12)
    R_body_camera = rotation_from_euler_zyx(0.3, -0.2, 0.5)
    assert seen.level_ray(heading, R_body_camera, R_body_camera.T @ vector) == pytest.approx(turned, abs=1e-12)
