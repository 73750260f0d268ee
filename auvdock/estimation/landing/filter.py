"""The landing filter: an extended Kalman filter over ξ, η, ζ, ψ with dead reckoning between frames (paper C, remark 1).

State x = (p, ψ, b_φ, b_θ): position p = (ξ, η, ζ) of the camera in the station frame (x to the head, y to port, z up;
the paper's own axes point down), heading ψ of the body in the station frame, and the constant errors of the
inclinometer, without which its error would be averaged as if it were white. Roll and pitch are measured less their
errors. Between frames p moves with the ground velocity of the DVL (trapezoid rule), ψ with the gyroscopes:

    ṗ = R_station_body (v + ω × r_camera),    ψ̇ = (q sin φ + r cos φ) / cos θ.

A level's pose of the pixels alone (`LevelPose.pull`, `.information`) is the measurement; the attitude prior that
steadied its solution is not counted twice. The filter's own arithmetic is filterpy's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

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
from auvdock.numeric.motion import stale_walk_m2_s
from auvdock.perception.landing.config import AttitudeCfg, FilterCfg
from auvdock.perception.landing.level import LevelPose, pose_offset

__all__ = ["Innovation", "LandingFilter"]

_CORRELATION_S = 2.0
"""For how long a constant error of DVL and gyroscopes acts before a measurement takes its effect out again."""


class Innovation(NamedTuple):
    """A level's pose less what is expected of it.

    Attributes:
        level: the pose.
        gap: (6,) measured less expected error coordinates.
        by_state: (6, 6) derivative of the expected ones by the state.
        by_tilt: (6, 2) and by the white noise of roll and pitch.
        noise: (6, 6) covariance of the pixels' share.
        distance2: squared Mahalanobis distance.
    """

    level: LevelPose
    gap: Array
    by_state: Array
    by_tilt: Array
    noise: Array
    distance2: float


class LandingFilter:
    """State, covariance and the last proprioception; empty until `start` or `place`."""

    def __init__(self, cfg: FilterCfg, attitude: AttitudeCfg, camera: Camera) -> None:
        """Precompute for one camera."""
        self._cfg = cfg
        self._body_camera = np.ascontiguousarray(camera.T_body_camera[:3, :3])
        self._arm_m = np.ascontiguousarray(camera.T_body_camera[:3, 3])
        self._tilt_noise = math.radians(attitude.tilt_noise_deg) ** 2
        self._tilt_bias = math.radians(attitude.tilt_bias_deg) ** 2
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._kalman: ExtendedKalmanFilter | None = None
        self._last: Proprioception | None = None

    @property
    def running(self) -> bool:
        """Whether there is a state."""
        return self._kalman is not None

    def predict(self, proprioception: Proprioception) -> None:
        """Move the state on to the time of a sample; the same sample again changes nothing."""
        last, self._last = self._last, proprioception
        kalman = self._kalman
        if kalman is None or last is None:
            return
        dt = proprioception.time_s - last.time_s
        if dt <= 0.0:
            return
        moved = self._moved(kalman.x, last, proprioception, dt)
        step = moved - kalman.x
        # A heading error turns the step.
        kalman.F[0, 3], kalman.F[1, 3] = -float(step[1]), float(step[0])
        kalman.Q = self._process(proprioception, dt)
        kalman.predict()
        kalman.x = moved  # no matrix product: filterpy moves the covariance alone

    def expected(self, proprioception: Proprioception) -> tuple[Array, Array] | None:
        """Move the state on to the time of a sample: the pose (4, 4) there and its covariance (6, 6), None if empty."""
        self.predict(proprioception)
        return self.pose(proprioception) if self._kalman is not None else None

    def pose(self, proprioception: Proprioception) -> tuple[Array, Array]:
        """(T_station_camera (4, 4), covariance (6, 6)) at the sample to which the state was moved."""
        kalman = self._running()
        T = self._transform(kalman.x, proprioception)
        by_state, by_noise = self._jacobians(kalman.x, T[:3, :3])
        covariance = by_state @ kalman.P @ by_state.T + self._tilt_noise * (by_noise @ by_noise.T)
        return T, 0.5 * (covariance + covariance.T)

    def compare(self, level: LevelPose, proprioception: Proprioception) -> Innovation:
        """Hold a level's pose against the state."""
        kalman = self._running()
        gap = level.pull - pose_offset(level.T_station_camera, self._transform(kalman.x, proprioception))
        by_state, tilt = self._jacobians(kalman.x, level.T_station_camera[:3, :3])
        trace = float(np.trace(level.information))
        known = level.information + 1e-9 * trace / 6.0 * np.eye(6)
        noise = np.asarray(np.linalg.inv(known), dtype=np.float64)
        spread = by_state @ kalman.P @ by_state.T + noise + self._tilt_noise * (tilt @ tilt.T)
        weighed = solve_positive(spread, gap)
        return Innovation(level, gap, by_state, tilt, noise, math.inf if weighed is None else float(gap @ weighed))

    def update(self, innovations: Sequence[Innovation]) -> None:
        """Correct the state by one or two levels of the same frame; they share the inclinometer's noise."""
        kalman = self._running()
        gap, by_state, noise = self._joint(innovations)
        kalman.update(gap, _known, _known, noise, args=(by_state,), hx_args=(np.zeros(len(gap)),))
        self._settle(kalman, kalman.x)

    def start(self, levels: Sequence[LevelPose], proprioception: Proprioception) -> None:
        """Begin with the levels of one frame: no knowledge of position and heading before them.

        P⁻¹ = Hᵀ R⁻¹ H + Λ, Λ the inclinometer's alignment: a wide covariance to begin with would cost the digits of P.
        """
        first = levels[0].T_station_camera
        yaw = euler_zyx_from_rotation(first[:3, :3] @ self._body_camera.T)[2]
        kalman = self._begin(np.array([*first[:3, 3].tolist(), yaw, 0.0, 0.0]), np.zeros((6, 6)), proprioception)
        gap, by_state, noise = self._joint([self.compare(level, proprioception) for level in levels])
        weighed = np.linalg.solve(noise, by_state)
        known = np.diag([0.0] * 4 + [1.0 / self._tilt_bias] * 2)
        kalman.P = np.linalg.inv(by_state.T @ weighed + known)
        self._settle(kalman, kalman.x + kalman.P @ (weighed.T @ gap))

    def place(self, T_station_camera: Array, covariance: Array, proprioception: Proprioception) -> None:
        """Take a pose as it is: what bare weighted fusion does with each frame."""
        roll, pitch, yaw = euler_zyx_from_rotation(T_station_camera[:3, :3] @ self._body_camera.T)
        measured = proprioception.euler_zyx_rad
        state = np.array([*T_station_camera[:3, 3].tolist(), yaw, measured[0] - roll, measured[1] - pitch])
        back = np.linalg.inv(self._jacobians(state, T_station_camera[:3, :3])[0])
        self._begin(state, back @ covariance @ back.T, proprioception)

    def _begin(self, state: Array, covariance: Array, proprioception: Proprioception) -> ExtendedKalmanFilter:
        self._kalman = kalman = ExtendedKalmanFilter(dim_x=6, dim_z=6)
        kalman.x, kalman.P = state, covariance
        self._last = proprioception
        return kalman

    @staticmethod
    def _settle(kalman: ExtendedKalmanFilter, state: Array) -> None:
        """Take a state, its heading within ±π, and make P symmetric."""
        state[3] = wrap_angle(float(state[3]))
        kalman.x, kalman.P = state, 0.5 * (kalman.P + kalman.P.T)

    def _running(self) -> ExtendedKalmanFilter:
        if self._kalman is None:
            raise ValueError("the filter holds no state yet")
        return self._kalman

    def _transform(self, state: Array, proprioception: Proprioception) -> Array:
        return make_transform(_R_station_body(state, proprioception) @ self._body_camera, state[:3])

    def _jacobians(self, state: Array, rotation: Array) -> tuple[Array, Array]:
        """d(error coordinates of the pose) / d(state) (6, 6) and / d(noise of roll, pitch) (6, 2)."""
        yaw = float(state[3])
        about_yaw = rotation[2]
        about_pitch = rotation.T @ np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        about_roll = self._body_camera[0]
        by_state = np.zeros((6, 6))
        by_state[0, 0] = by_state[1, 1] = by_state[2, 2] = 1.0
        by_state[3:, 3], by_state[3:, 4], by_state[3:, 5] = about_yaw, -about_roll, -about_pitch
        return by_state, by_state[:, 4:]

    def _joint(self, innovations: Sequence[Innovation]) -> tuple[Array, Array, Array]:
        """Gap (6 k,), Jacobian (6 k, 6) and noise (6 k, 6 k) of k levels together."""
        tilt = np.concatenate([each.by_tilt for each in innovations])
        noise = self._tilt_noise * (tilt @ tilt.T)
        for index, each in enumerate(innovations):
            rows = slice(6 * index, 6 * index + 6)
            noise[rows, rows] += each.noise
        gap = np.concatenate([each.gap for each in innovations])
        return gap, np.concatenate([each.by_state for each in innovations]), noise

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

    def _process(self, now: Proprioception, dt: float) -> Array:
        """(6, 6) Q, what a step adds to the covariance."""
        cfg = self._cfg
        speed2 = float(now.velocity_ground_m_s @ now.velocity_ground_m_s)
        # The trapezoid shares each sample between two steps, so the white error of a step is one sample's.
        step = (cfg.velocity_noise_m_s**2 + 0.5 * cfg.gyro_noise_rad_s**2 * float(self._arm_m @ self._arm_m)) * dt * dt
        step += cfg.velocity_scale_error**2 * speed2 * dt * _CORRELATION_S
        step += stale_walk_m2_s(now.ground_age_s) * dt
        turn = cfg.gyro_noise_rad_s**2 * dt * dt + cfg.gyro_bias_rad_s**2 * dt * _CORRELATION_S
        return np.diag([step, step, step, turn, 0.0, 0.0])


def _known(_: Array, value: Array) -> Array:
    """What filterpy asks for as a function of the state; it was worked out for this one."""
    return value


def _R_station_body(state: Array, sample: Proprioception) -> Array:
    roll, pitch, _ = sample.euler_zyx_rad.tolist()
    _, _, _, yaw, roll_error, pitch_error = state.tolist()
    return rotation_from_euler_zyx(roll - roll_error, pitch - pitch_error, yaw)


def _yaw_rate(sample: Proprioception) -> float:
    roll, pitch, _ = sample.euler_zyx_rad.tolist()
    _, q, r = sample.angular_velocity_rad_s.tolist()
    return (q * math.sin(roll) + r * math.cos(roll)) / math.cos(pitch)
