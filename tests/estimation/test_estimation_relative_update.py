"""The relative filter's compiled loops against filterpy's extended Kalman filter, over whole voyages."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter

from auvdock.core.arrays import Array
from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import PoseEstimate, Proprioception
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.estimation.relative_state import FilterCfg, RelativeFilter, RelativeState
from auvdock.estimation.relative_update import RelativeBelief
from auvdock.estimation.senses import Senses, read_senses

DT_S = 0.1
TARGET_M = np.array([-1.2, 0.1, 0.05])
CAMERA = make_camera(CameraCfg(), np.array([0.9, 0.05, -0.1]), np.array([1.0, 0.0, 0.1]), np.array([0.0, 0.0, 1.0]))
CFG = FilterCfg(gate=1e9, bearing_gate=1e9, max_rotation_mismatch_rad=math.pi)
"""Nothing is refused: filterpy knows no gates."""
FILTER = RelativeFilter(CFG, CAMERA.T_body_camera, DT_S, target_m=(-1.2, 0.1, 0.05))


class Moment(NamedTuple):
    """What the filter is given in a period."""

    senses: Senses
    pose: PoseEstimate
    ray: Array


def expected_rotation(senses: Senses, axis_yaw_rad: float) -> Array:
    heading = senses.yaw_rad - axis_yaw_rad
    return rotation_from_euler_zyx(senses.roll_rad, senses.pitch_rad, heading) @ CAMERA.T_body_camera[:3, :3]


def turned(a: Array, b: Array) -> Array:
    """The sine-scaled axis of aᵀ b, which is the rotation vector for the small angles here."""
    e = a.T @ b
    return 0.5 * np.array([e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1]])


def spread(rng: np.random.Generator, sigma: Array) -> Array:
    root = sigma[:, None] * (np.eye(6) + 0.3 * rng.normal(size=(6, 6)))
    return root @ root.T


def moment(state: RelativeState, rng: np.random.Generator) -> Moment:
    """Senses of a manoeuvre, and a pose and a direction near what the state expects."""
    roll, pitch, yaw = (np.array([0.0, 0.1, 3.0]) + rng.uniform(-0.2, 0.2, 3)).tolist()
    rates, ground = rng.uniform(-0.3, 0.3, 3), rng.uniform(-1.0, 1.0, 3)
    senses = read_senses(Proprioception(0.0, 8.0, np.array([roll, pitch, yaw]), rates, ground, ground))
    expected = expected_rotation(senses, state.axis_yaw_rad)
    turn = rotation_from_euler_zyx(*rng.uniform(-0.03, 0.03, 3).tolist())
    T = make_transform(expected @ turn, np.array(state.camera_m) + rng.uniform(-0.1, 0.1, 3))
    ray = expected.T @ (TARGET_M - np.array(state.camera_m)) + rng.uniform(-0.1, 0.1, 3)
    noise = spread(rng, np.array([0.05, 0.05, 0.05, 0.02, 0.02, 0.02]))
    return Moment(senses, PoseEstimate(T, noise, (), "", 0.0), ray / np.linalg.norm(ray))


def reference(state: RelativeState) -> ExtendedKalmanFilter:
    kalman = ExtendedKalmanFilter(dim_x=4, dim_z=6)
    kalman.x, kalman.P = np.array([*state.camera_m, state.axis_yaw_rad]), state.covariance.copy()
    return kalman


def agrees(state: RelativeState, kalman: ExtendedKalmanFilter) -> None:
    np.testing.assert_allclose([*state.camera_m, state.axis_yaw_rad], kalman.x, atol=1e-9)
    np.testing.assert_allclose(state.covariance, kalman.P, rtol=1e-6, atol=1e-10)


def begun(rng: np.random.Generator) -> RelativeState:
    root = 0.2 * rng.normal(size=(4, 4))
    return RelativeState(RelativeBelief(np.array([8.0, 0.5, -0.3]), 0.2, root @ root.T).packed(), 0.0, 1, 0, 0)


def test_dead_reckoning_is_filterpys_prediction():
    rng = np.random.default_rng(1)
    state = begun(rng)
    for _ in range(30):
        seen, kalman = moment(state, rng), reference(state)
        body = np.array(seen.senses.ground_m_s) + np.cross(seen.senses.rate_rad_s, CAMERA.T_body_camera[:3, 3])
        heading = seen.senses.yaw_rad - state.axis_yaw_rad
        way = rotation_from_euler_zyx(seen.senses.roll_rad, seen.senses.pitch_rad, heading) @ body * DT_S
        # The step, turned the other way with ψ_s, is linear in it to first order.
        kalman.F[:2, 3] = way[1], -way[0]
        kalman.Q = np.diag([CFG.position_walk_m_rs**2 * DT_S] * 3 + [CFG.heading_walk_rad_rs**2 * DT_S])
        kalman.predict()
        kalman.x = np.array([*(np.array(state.camera_m) + way), state.axis_yaw_rad])
        state = FILTER.advance(state, seen.senses)
        agrees(state, kalman)


def test_a_pose_and_a_bearing_are_filterpys_updates():
    """Thirty periods, each from the compiled filter's own belief; the bearing as one update of two numbers."""
    rng = np.random.default_rng(2)
    state = begun(rng)
    for _ in range(30):
        seen, kalman = moment(state, rng), reference(state)
        T, senses = seen.pose.T_station_camera, seen.senses
        rotation = expected_rotation(senses, state.axis_yaw_rad)
        pose_slopes = np.zeros((6, 4))
        pose_slopes[:3, :3] = np.eye(3)
        pose_slopes[3:, 3] = -rotation[2]
        noise = CFG.inflation * seen.pose.covariance
        noise += np.diag([CFG.position_floor_m**2] * 3 + [CFG.rotation_floor_rad**2] * 3)
        measured = np.array([*T[:3, 3], *turned(rotation, T[:3, :3])])
        kalman.update(measured, lambda _, h=pose_slopes: h, lambda x: np.array([*x[:3], 0.0, 0.0, 0.0]), noise)
        state = FILTER.update(state, senses, seen.pose)
        agrees(state, kalman)

        kalman = reference(state)
        d = expected_rotation(senses, state.axis_yaw_rad).T @ (TARGET_M - np.array(state.camera_m))
        variance = CFG.bearing_floor_rad**2 + (CFG.entrance_spread_m / d[2]) ** 2
        kalman.update(
            seen.ray[:2] / seen.ray[2],
            lambda x, s=senses: numeric_slopes(lambda y: direction(y, s), x),
            lambda x, s=senses: direction(x, s),
            variance * np.eye(2),
        )
        state = FILTER.update(state, senses, ray_camera=seen.ray)
        agrees(state, kalman)
        state = FILTER.advance(state, senses)


def direction(x: Array, senses: Senses) -> Array:
    d = expected_rotation(senses, float(x[3])).T @ (TARGET_M - x[:3])
    return d[:2] / d[2]


def numeric_slopes(function, x: Array) -> Array:
    h = 1e-6
    return np.column_stack([(function(x + step) - function(x - step)) / (2.0 * h) for step in h * np.eye(4)])


def test_a_singular_innovation_is_refused():
    state = begun(np.random.default_rng(3))
    seen = moment(state, np.random.default_rng(3))
    blunt = PoseEstimate(seen.pose.T_station_camera, -np.eye(6), (), "", 0.0)
    after = FILTER.update(state, seen.senses, blunt)
    assert after.refused == 1
    assert after.camera_m == pytest.approx(state.camera_m)
