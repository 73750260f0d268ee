"""What the landing pilot believes: the estimate as it is in a frame, dead reckoning between frames."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from landing_bench import CAMERAS, STATION, VEHICLES, glance_of
from landing_scenes import Descent

from auvdock.controllers.landing.belief import BeliefReader
from auvdock.core.contracts import PoseEstimate, Proprioception
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.estimation.senses import read_senses

DT_S = 0.025
AXIS_YAW_RAD = 2.9
WALK_M_RS = 0.006
VEHICLE, CAMERA = VEHICLES["bluerov2_heavy"], CAMERAS["bluerov2_heavy"]
READER = BeliefReader(VEHICLE, STATION, CAMERA, WALK_M_RS, DT_S)
FLIGHT = Descent(np.array([0.4, -0.3, 3.0]), 0.4, 0.5)


def body(time_s):
    position, euler = FLIGHT.body(time_s)
    return make_transform(rotation_from_euler_zyx(*euler.tolist()), position)


def seat(time_s):
    """ξ, η, ζ, ψ of the true seat."""
    T = body(time_s)
    x, y, z = (T @ np.append(VEHICLE.seat_body_m, 1.0))[:3].tolist()
    return np.array([x, y, z - STATION.guide.seat_height_m, math.atan2(T[1, 0], T[0, 0])])


def senses(time_s):
    _, euler = FLIGHT.body(time_s)
    velocity, rates = FLIGHT.rates(time_s)
    return read_senses(
        Proprioception(time_s, 6.0, euler + np.array([0.0, 0.0, AXIS_YAW_RAD]), rates, velocity, velocity)
    )


def percept(time_s, measured=True, restarts=0, sigma_m=(0.01, 0.02)):
    covariance = np.diag([*np.square(sigma_m), 1e-4, 1e-6, 1e-6, 1e-6])
    pose = PoseEstimate(body(time_s) @ CAMERA.T_body_camera, covariance, (), "", 0.0, measured)
    return dataclasses.replace(glance_of(pose, None, "tracking"), restarts=restarts)


def test_in_a_frame_the_estimate_counts_as_it_is():
    """Not filtered again: whatever was believed before, the place is that of the pose, and so is the doubt."""
    belief = None
    for k in range(5):
        belief = READER.advance(belief, percept(0.7 * k), senses(0.7 * k))
        assert belief is not None
        np.testing.assert_allclose(belief.place, seat(0.7 * k), atol=1e-12)
        assert belief.axis_yaw_rad == pytest.approx(AXIS_YAW_RAD)
        assert belief.variance_m2 == pytest.approx(0.02**2)
        assert (belief.since_fix_s, belief.fixes) == (0.0, k + 1)


def test_between_frames_it_is_reckoned_on():
    """Two seconds without a frame, on an exact path: a first-order step errs by less than a centimetre."""
    belief = READER.advance(None, percept(0.0), senses(0.0))
    for k in range(1, 81):
        belief = READER.advance(belief, None, senses(k * DT_S))
        assert belief is not None
        np.testing.assert_allclose(belief.place, seat(k * DT_S), atol=0.01)
    assert belief is not None
    assert belief.since_fix_s == pytest.approx(2.0)
    assert belief.variance_m2 == pytest.approx(0.02**2 + 2.0 * WALK_M_RS**2)
    assert belief.fixes == 1


def test_a_held_pose_is_believed_but_is_no_fix():
    belief = READER.advance(None, percept(0.0), senses(0.0))
    belief = READER.advance(belief, percept(0.5, measured=False), senses(0.5))
    assert belief is not None
    np.testing.assert_allclose(belief.place, seat(0.5), atol=1e-12)
    assert (belief.since_fix_s, belief.fixes) == (DT_S, 1)


def test_an_estimate_begun_anew_has_to_be_confirmed_anew():
    belief = None
    for _ in range(4):
        belief = READER.advance(belief, percept(0.0), senses(0.0))
    belief = READER.advance(belief, percept(0.0, restarts=1), senses(0.0))
    assert belief is not None
    assert (belief.restarts, belief.fixes) == (1, 1)


def test_rubbish_is_no_pose():
    belief = READER.advance(None, percept(0.0), senses(0.0))
    good = percept(0.0).pose
    assert good is not None
    nan = np.full((6, 6), math.nan)
    for bad in (dataclasses.replace(good, covariance=nan), dataclasses.replace(good, T_station_camera=nan[:4, :4])):
        assert READER.advance(None, glance_of(bad, None, "tracking"), senses(0.0)) is None
        after = READER.advance(belief, glance_of(bad, None, "tracking"), senses(0.0))
        assert after is not None
        assert np.isfinite(after.place).all()
        assert after.since_fix_s == DT_S


def test_without_bottom_lock_the_doubt_grows_faster():
    grown = []
    for age_s in (0.0, 0.3, 3.0):
        old = senses(0.0).motion.copy()
        old["ground_age_s"] = age_s
        belief = READER.advance(None, percept(0.0), senses(0.0))
        belief = READER.advance(belief, None, senses(0.0)._replace(motion=old))
        assert belief is not None
        grown.append(belief.variance_m2)
    assert grown[0] < grown[1] < grown[2]
