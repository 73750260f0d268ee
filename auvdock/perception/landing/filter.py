"""The landing filter: an extended Kalman filter over ξ, η, ζ, ψ with dead reckoning between frames (paper C, remark 1).

State x = (p, ψ, b_φ, b_θ): position p = (ξ, η, ζ) of the camera in the station frame (x to the head, y to port, z up;
the paper's own axes point down), heading ψ of the body in the station frame, and the constant errors of the
inclinometer, without which its error would be averaged as if it were white. Roll and pitch are measured less their
errors. Between frames p moves with the ground velocity of the DVL (trapezoid rule), ψ with the gyroscopes:

    ṗ = R_station_body (v + ω × r_camera),    ψ̇ = (q sin φ + r cos φ) / cos θ.

A level's pose of the pixels alone (`LevelPose.pull`, `.information`) is the measurement; the attitude prior that
steadied its solution is not counted twice.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Proprioception
from auvdock.core.linear import solve_positive
from auvdock.core.transforms import (
    cross,
    euler_zyx_from_rotation,
    make_transform,
    rotation_from_euler_zyx,
    wrap_angle,
)
from auvdock.perception.landing.config import AttitudeCfg, FilterCfg
from auvdock.perception.landing.level import LevelPose, pose_offset

__all__ = ["LandingFilter"]

_WIDE_M2 = 1e4
_CORRELATION_S = 2.0
"""For how long a constant error of DVL and gyroscopes acts before a measurement takes its effect out again."""


class LandingFilter:
    """State, covariance and the last proprioception; empty until `start` or `place`."""

    def __init__(self, cfg: FilterCfg, attitude: AttitudeCfg, camera: Camera, station_yaw_rad: float) -> None:
        """Precompute for one camera and station."""
        self._cfg = cfg
        self._body_camera = np.ascontiguousarray(camera.T_body_camera[:3, :3])
        self._arm_m = np.ascontiguousarray(camera.T_body_camera[:3, 3])
        self._station_yaw = station_yaw_rad
        self._tilt_noise = math.radians(attitude.tilt_noise_deg) ** 2
        self._tilt_bias = math.radians(attitude.tilt_bias_deg) ** 2
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._state: Array | None = None
        self._covariance: Array = np.zeros((6, 6))
        self._last: Proprioception | None = None
        self._ahead: tuple[Proprioception, Array | None, Array] | None = None
        """What `expected` found for a sample, until the state changes: `predict` is asked for the same."""

    @property
    def running(self) -> bool:
        """Whether there is a state."""
        return self._state is not None

    def attitude(self, proprioception: Proprioception) -> Array:
        """(3, 3) R_station_camera by inclinometer (less its known error) and the best heading there is."""
        if self._state is not None:
            return self._transform(self._state, proprioception)[:3, :3]
        roll, pitch, yaw = proprioception.euler_zyx_rad.tolist()
        return rotation_from_euler_zyx(roll, pitch, yaw - self._station_yaw) @ self._body_camera

    def measured_attitude(self, proprioception: Proprioception) -> Array:
        """(3, 3) R_station_camera by inclinometer and compass alone."""
        roll, pitch, yaw = proprioception.euler_zyx_rad.tolist()
        return rotation_from_euler_zyx(roll, pitch, yaw - self._station_yaw) @ self._body_camera

    def predict(self, proprioception: Proprioception) -> None:
        """Move the state on to the time of a sample."""
        last, self._last = self._last, proprioception
        ahead, self._ahead = self._ahead, None
        if self._state is None or last is None:
            return
        if ahead is not None and ahead[0] is proprioception:
            _, self._state, self._covariance = ahead
            return
        dt = proprioception.time_s - last.time_s
        if dt <= 0.0:
            return
        moved = self._moved(self._state, last, proprioception, dt)
        self._covariance = self._spread(last, proprioception, moved - self._state, dt)
        self._state = moved

    def expected(self, proprioception: Proprioception) -> tuple[Array, Array] | None:
        """(pose (4, 4), covariance (6, 6)) that `predict` would give, the filter left as it is; None while empty."""
        if self._state is None or self._last is None:
            return None
        before = self._state, self._covariance, self._last
        self.predict(proprioception)
        answer = self.pose(proprioception)
        ahead = proprioception, self._state, self._covariance
        self._state, self._covariance, self._last = before
        self._ahead = ahead
        return answer

    def pose(self, proprioception: Proprioception) -> tuple[Array, Array]:
        """(T_station_camera (4, 4), covariance (6, 6)) at the sample to which the state was moved."""
        state = self._state
        if state is None:
            raise ValueError("the filter holds no state yet")
        T = self._transform(state, proprioception)
        by_state, by_noise = self._jacobians(state, proprioception, T[:3, :3])
        covariance = by_state @ self._covariance @ by_state.T + self._tilt_noise * (by_noise @ by_noise.T)
        return T, 0.5 * (covariance + covariance.T)

    def distance2(self, level: LevelPose, proprioception: Proprioception) -> float:
        """Squared Mahalanobis distance of a level's pose from the state."""
        innovation, by_state, noise = self._innovation([level], proprioception)
        spread = by_state @ self._covariance @ by_state.T + noise
        weighed = solve_positive(spread, innovation)
        return math.inf if weighed is None else float(innovation @ weighed)

    def update(self, levels: Sequence[LevelPose], proprioception: Proprioception) -> None:
        """Correct the state by one or two levels of the same frame; they share the inclinometer's noise."""
        if self._state is None or not levels:
            return
        innovation, by_state, noise = self._innovation(levels, proprioception)
        spread = by_state @ self._covariance @ by_state.T + noise
        gain = np.linalg.solve(spread, by_state @ self._covariance).T
        self._ahead = None
        self._state = self._state + gain @ innovation
        self._state[3] = wrap_angle(float(self._state[3]))
        kept = np.eye(6) - gain @ by_state
        covariance = kept @ self._covariance @ kept.T + gain @ noise @ gain.T
        self._covariance = 0.5 * (covariance + covariance.T)

    def start(self, levels: Sequence[LevelPose], proprioception: Proprioception) -> None:
        """Begin with the levels of one frame: no knowledge of position and heading before them."""
        first = levels[0].T_station_camera
        yaw = euler_zyx_from_rotation(first[:3, :3] @ self._body_camera.T)[2]
        self._state = np.array([*first[:3, 3].tolist(), yaw, 0.0, 0.0])
        self._covariance = np.diag([_WIDE_M2] * 3 + [1.0] + [self._tilt_bias] * 2)
        self._last, self._ahead = proprioception, None
        self.update(levels, proprioception)

    def place(self, T_station_camera: Array, covariance: Array, proprioception: Proprioception) -> None:
        """Take a pose as it is: what bare weighted fusion does with each frame."""
        roll, pitch, yaw = euler_zyx_from_rotation(T_station_camera[:3, :3] @ self._body_camera.T)
        measured = proprioception.euler_zyx_rad
        state = np.array([*T_station_camera[:3, 3].tolist(), yaw, measured[0] - roll, measured[1] - pitch])
        by_state, _ = self._jacobians(state, proprioception, T_station_camera[:3, :3])
        back = np.linalg.inv(by_state)
        self._state, self._last, self._ahead = state, proprioception, None
        self._covariance = back @ covariance @ back.T

    def _transform(self, state: Array, proprioception: Proprioception) -> Array:
        return make_transform(_R_station_body(state, proprioception) @ self._body_camera, state[:3])

    def _jacobians(self, state: Array, proprioception: Proprioception, rotation: Array) -> tuple[Array, Array]:
        """d(error coordinates of the pose) / d(state) (6, 6) and / d(noise of roll, pitch) (6, 2)."""
        yaw = float(state[3])
        about_yaw = rotation[2]
        about_pitch = rotation.T @ np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        about_roll = self._body_camera[0]
        by_state = np.zeros((6, 6))
        by_state[0, 0] = by_state[1, 1] = by_state[2, 2] = 1.0
        by_state[3:, 3], by_state[3:, 4], by_state[3:, 5] = about_yaw, -about_roll, -about_pitch
        return by_state, by_state[:, 4:]

    def _innovation(self, levels: Sequence[LevelPose], proprioception: Proprioception) -> tuple[Array, Array, Array]:
        """(6 k,) measured less expected error coordinates, their (6 k, 6) Jacobian and (6 k, 6 k) noise."""
        state = self._state
        if state is None:
            raise ValueError("the filter holds no state yet")
        expected = self._transform(state, proprioception)
        k = len(levels)
        innovation, by_state = np.empty(6 * k), np.empty((6 * k, 6))
        tilt, noise = np.empty((6 * k, 2)), np.zeros((6 * k, 6 * k))
        for index, level in enumerate(levels):
            rows = slice(6 * index, 6 * index + 6)
            innovation[rows] = level.pull - pose_offset(level.T_station_camera, expected)
            by_state[rows], tilt[rows] = self._jacobians(state, proprioception, level.T_station_camera[:3, :3])
            trace = float(np.trace(level.information))
            noise[rows, rows] = np.linalg.inv(level.information + 1e-9 * trace / 6.0 * np.eye(6))
        return innovation, by_state, noise + self._tilt_noise * (tilt @ tilt.T)

    def _moved(self, state: Array, last: Proprioception, now: Proprioception, dt: float) -> Array:
        moved = state.copy()
        moved[3] = state[3] + 0.5 * dt * (_yaw_rate(last) + _yaw_rate(now))
        moved[:3] += 0.5 * dt * (self._velocity(state, last) + self._velocity(moved, now))
        moved[3] = wrap_angle(float(moved[3]))
        return moved

    def _velocity(self, state: Array, sample: Proprioception) -> Array:
        """(3,) velocity of the camera in the station frame."""
        body = sample.velocity_ground_m_s + cross(sample.angular_velocity_rad_s, self._arm_m)
        return _R_station_body(state, sample) @ body

    def _spread(self, last: Proprioception, now: Proprioception, moved: Array, dt: float) -> Array:
        """F P Fᵀ + Q."""
        cfg = self._cfg
        across, along = -float(moved[1]), float(moved[0])
        by_state = np.eye(6)
        # A heading error turns the step.
        by_state[0, 3], by_state[1, 3] = across, along
        covariance = by_state @ self._covariance @ by_state.T
        speed2 = float(now.velocity_ground_m_s @ now.velocity_ground_m_s)
        # The trapezoid shares each sample between two steps, so the white error of a step is one sample's.
        step = (cfg.velocity_noise_m_s**2 + 0.5 * cfg.gyro_noise_rad_s**2 * float(self._arm_m @ self._arm_m)) * dt * dt
        step += cfg.velocity_scale_error**2 * speed2 * dt * _CORRELATION_S
        turn = cfg.gyro_noise_rad_s**2 * dt * dt + cfg.gyro_bias_rad_s**2 * dt * _CORRELATION_S
        covariance[0, 0] += step
        covariance[1, 1] += step
        covariance[2, 2] += step
        covariance[3, 3] += turn
        return covariance


def _R_station_body(state: Array, sample: Proprioception) -> Array:
    roll, pitch, _ = sample.euler_zyx_rad.tolist()
    _, _, _, yaw, roll_error, pitch_error = state.tolist()
    return rotation_from_euler_zyx(roll - roll_error, pitch - pitch_error, yaw)


def _yaw_rate(sample: Proprioception) -> float:
    roll, pitch, _ = sample.euler_zyx_rad.tolist()
    _, q, r = sample.angular_velocity_rad_s.tolist()
    return (q * math.sin(roll) + r * math.cos(roll)) / math.cos(pitch)
