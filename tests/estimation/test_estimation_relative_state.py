"""The relative filter against exact kinematics."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import PoseEstimate, Proprioception
from auvdock.core.marine import flip_vector
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.core.vehicle import load_vehicle
from auvdock.estimation.relative_state import FilterCfg, RelativeFilter
from auvdock.estimation.relative_update import RelativeBelief
from auvdock.estimation.senses import read_senses

BOW = load_vehicle("remus_hybrid").bow_camera
CAMERA = make_camera(CameraCfg(), *(flip_vector(np.array(part)) for part in (BOW.position_m, BOW.direction, BOW.up)))
DT_S = 1.0 / 30.0
CFG = FilterCfg()
TARGET = (-1.13, 0.0, 0.0)
FILTER = RelativeFilter(CFG, CAMERA.T_body_camera, DT_S, target_m=TARGET)
SIGMA = np.array([0.05, 0.05, 0.05, 0.02, 0.02, 0.02])
AXIS_YAW = 0.7
"""Compass bearing of the station's x axis; a vehicle that flies straight in then heads AXIS_YAW + π."""


class Track:
    """A vehicle on a given smooth path in the station frame, with what its sensors would say."""

    def __init__(self, time_s):
        self.yaw = math.pi + 0.2 * math.sin(0.3 * time_s)
        self.yaw_rate = 0.06 * math.cos(0.3 * time_s)
        self.roll, self.pitch = 0.02 * math.sin(time_s), 0.05 * math.cos(0.4 * time_s)
        self.rotation = rotation_from_euler_zyx(self.roll, self.pitch, self.yaw)
        self.body = np.array([10.0 - 0.4 * time_s, math.sin(0.2 * time_s), 0.3 * math.cos(0.2 * time_s)])
        self.velocity = np.array([-0.4, 0.2 * math.cos(0.2 * time_s), -0.06 * math.sin(0.2 * time_s)])
        self.T_station_camera = make_transform(self.rotation, self.body) @ CAMERA.T_body_camera
        roll_rate, pitch_rate = 0.02 * math.cos(time_s), -0.02 * math.sin(0.4 * time_s)
        # Body rates of ZYX Euler angles (Fossen 2011, equation 2.39 inverted).
        rates = np.array(
            [
                roll_rate - self.yaw_rate * math.sin(self.pitch),
                pitch_rate * math.cos(self.roll) + self.yaw_rate * math.cos(self.pitch) * math.sin(self.roll),
                -pitch_rate * math.sin(self.roll) + self.yaw_rate * math.cos(self.pitch) * math.cos(self.roll),
            ]
        )
        ground = self.rotation.T @ self.velocity
        self.senses = read_senses(
            Proprioception(time_s, 8.0, np.array([self.roll, self.pitch, self.yaw + AXIS_YAW]), rates, ground, ground)
        )

    def pose(self, rng=None, shift_m=(0.0, 0.0, 0.0)):
        T = self.T_station_camera.copy()
        T[:3, 3] += shift_m
        if rng is not None:
            error = SIGMA * rng.standard_normal(6)
            T[:3, 3] += error[:3]
            x, y, z = error[3:]
            turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            T[:3, :3] = T[:3, :3] @ (np.eye(3) + turn + turn @ turn / 2.0)
        return PoseEstimate(T, np.diag(SIGMA**2), (0, 1, 2, 3, 4, 5), "exact", 0.3)


def run(seconds, poses=lambda step: True, rng=None, shift=lambda step: (0.0, 0.0, 0.0)):
    state = FILTER.start(Track(0.0).pose(rng), Track(0.0).senses)
    assert state is not None
    track = Track(0.0)
    for step in range(1, round(seconds / DT_S)):
        track = Track(step * DT_S)
        state = FILTER.advance(state, Track((step - 0.5) * DT_S).senses)
        if poses(step):
            state = FILTER.update(state, track.senses, track.pose(rng, shift(step)))
    return state, track


def test_dead_reckoning_follows_an_exact_path():
    state, track = run(10.0, poses=lambda step: False)
    np.testing.assert_allclose(state.camera_m, track.T_station_camera[:3, 3], atol=2e-3)
    assert state.axis_yaw_rad == pytest.approx(AXIS_YAW, abs=1e-9)


def test_fused_estimate_beats_single_poses_and_its_covariance_is_honest():
    errors = []
    normalised = []
    for seed in range(30):
        state, track = run(3.0, rng=np.random.default_rng(seed))
        error = np.array([*(np.array(state.camera_m) - track.T_station_camera[:3, 3]), state.axis_yaw_rad - AXIS_YAW])
        errors.append(error)
        normalised.append(float(error @ np.linalg.solve(state.covariance, error)))
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert np.all(rms[:3] < 0.6 * SIGMA[0])
    assert rms[3] < 0.6 * SIGMA[3]
    # Mean of 30 draws of χ² with 4 degrees of freedom stays below 5.6 in 99 %; inflation keeps it well under.
    assert np.mean(normalised) < 5.6


def test_uncertainty_grows_without_poses_and_shrinks_with_them():
    lost, _ = run(8.0, poses=lambda step: step < 60)
    seen, _ = run(8.0)
    assert lost.cross_track_sigma_m > 2.0 * seen.cross_track_sigma_m
    assert lost.since_fix_s == pytest.approx(8.0 - 60 * DT_S, abs=0.1)
    assert seen.since_fix_s == 0.0
    assert np.linalg.eigvalsh(lost.covariance).min() > 0.0


def test_single_outliers_are_refused():
    state, track = run(5.0, shift=lambda step: (0.0, 1.5, 0.0) if step % 10 == 0 else (0.0, 0.0, 0.0))
    np.testing.assert_allclose(state.camera_m, track.T_station_camera[:3, 3], atol=0.02)
    assert state.restarts == 0


def test_a_lasting_jump_starts_the_filter_anew():
    state, track = run(5.0, shift=lambda step: (0.0, 1.5, 0.0) if step > 90 else (0.0, 0.0, 0.0))
    assert state.restarts == 1
    np.testing.assert_allclose(state.camera_m, track.T_station_camera[:3, 3] + [0.0, 1.5, 0.0], atol=0.03)


def test_bearing_of_the_entrance_corrects_a_sideways_error():
    track = Track(19.0)
    start = FILTER.start(track.pose(), track.senses)
    assert start is not None
    place = np.array(start.camera_m) + np.array([0.0, 0.2, -0.15])
    belief = RelativeBelief(place, start.axis_yaw_rad, np.diag([0.04, 0.04, 0.04, 1e-4]))
    state = start._replace(belief=belief.packed())
    ray = sight_of_the_target(track)
    for _ in range(40):
        state = FILTER.update(state, track.senses, ray_camera=ray)
    truth = track.T_station_camera[:3, 3]
    assert abs(state.camera_m[1] - truth[1]) < 0.04
    assert abs(state.camera_m[2] - truth[2]) < 0.04
    assert state.cross_track_sigma_m < 0.1


def sight_of_the_target(track):
    ray = track.T_station_camera[:3, :3].T @ (np.array(TARGET) - track.T_station_camera[:3, 3])
    return ray / np.linalg.norm(ray)


def test_a_period_is_its_steps_one_after_another():
    rng = np.random.default_rng(3)
    state = FILTER.start(Track(18.0).pose(), Track(18.0).senses)
    assert state is not None
    track = Track(18.0 + DT_S)
    pose, ray = track.pose(rng), sight_of_the_target(track)
    whole = FILTER.advance(state, track.senses, pose, ray)
    steps = FILTER.update(FILTER.advance(state, track.senses), track.senses, pose)
    steps = FILTER.update(steps, track.senses, ray_camera=ray)
    np.testing.assert_array_equal(whole.belief, steps.belief)
    assert whole[1:] == steps[1:] == (0.0, 2, 0, 0)


def test_the_bearing_counts_in_the_period_in_which_the_filter_starts_anew():
    track = Track(18.0)
    start, jumped = FILTER.start(track.pose(), track.senses), track.pose(shift_m=(0.0, 1.5, 0.0))
    fresh = FILTER.start(jumped, track.senses, restarts=1)
    assert start is not None
    assert fresh is not None
    track.T_station_camera = jumped.T_station_camera
    ray = sight_of_the_target(track) + np.array([0.0, 0.01, 0.0])
    after = FILTER.advance(start._replace(refused=CFG.restart_after - 1), track.senses, jumped, ray)
    expected = FILTER.update(fresh, track.senses, ray_camera=ray)
    assert after.camera_m == expected.camera_m != fresh.camera_m
    assert after[1:] == (0.0, 1, 0, 1)


def test_updates_do_not_touch_their_arguments():
    track = Track(1.0)
    state = FILTER.start(track.pose(), track.senses)
    assert state is not None
    before = copy.deepcopy(state)
    FILTER.advance(state, track.senses)
    FILTER.update(state, track.senses, track.pose())
    FILTER.update(state, track.senses, ray_camera=np.array([0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(state.belief, before.belief)


def test_nonsense_is_refused():
    track = Track(1.0)
    pose = track.pose()
    broken = PoseEstimate(np.full((4, 4), np.nan), pose.covariance, (), "x", 0.0)
    assert FILTER.start(broken, track.senses) is None
    state = FILTER.start(pose, track.senses)
    assert state is not None
    assert FILTER.update(state, track.senses, broken) is state
    assert FILTER.update(state, track.senses, ray_camera=np.full(3, np.nan)) is state
    # Lying on its side, says the picture; upright, says the inclinometer.
    rolled = make_transform(track.rotation @ rotation_from_euler_zyx(0.8, 0.0, 0.0), track.body) @ CAMERA.T_body_camera
    assert FILTER.start(PoseEstimate(rolled, pose.covariance, (), "x", 0.0), track.senses) is None


def test_the_doubt_grows_with_the_age_of_the_velocity():
    """Two seconds by a velocity half a second old: 2 (0.15 × 0.5)² 0.5 m²/s more variance than by a fresh one."""
    state = FILTER.start(Track(0.0).pose(), Track(0.0).senses)
    assert state is not None
    fresh = stale = state
    for step in range(round(2.0 / DT_S)):
        senses = Track(step * DT_S).senses
        old = senses.motion.copy()
        old["ground_age_s"] = 0.5
        fresh, stale = FILTER.advance(fresh, senses), FILTER.advance(stale, senses._replace(motion=old))
    grown = np.diag(stale.covariance - fresh.covariance)
    np.testing.assert_allclose(grown, [*[2.0 * 2.0 * 0.075**2 * 0.5] * 3, 0.0], rtol=1e-6, atol=1e-12)
    assert stale.camera_m == fresh.camera_m
