"""The camera's own motion: attitude steadied by the gyroscopes, place dead-reckoned from ground velocity."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx, wrap_angle

__all__ = ["CameraMotion", "CameraPlace"]

_ATTITUDE_S = 4.0
"""Time constant with which compass and inclinometer correct the gyroscopes (ours): white noise of 0.2° per frame leaves
0.02°, and a gyroscope bias of 0.0002 rad/s costs 0.05°."""
_LONGEST_STEP_S = 1.0
_KEPT_S = 4.0


class CameraPlace(NamedTuple):
    """Where the camera was in one frame.

    Attributes:
        time_s: vehicle time.
        R_compass_camera: (3, 3) attitude in level compass axes.
        place_m: (2,) horizontal position in the same axes since the last reset.
    """

    time_s: float
    R_compass_camera: Array
    place_m: Array


class CameraMotion:
    """Attitude and place of the camera, frame by frame.

    φ̇ = p + tan θ (q sin φ + r cos φ), θ̇ = q cos φ - r sin φ, ψ̇ = (q sin φ + r cos φ) / cos θ (Fossen 2011, equation
    2.28), drawn to compass and inclinometer with a time constant of 4 s, faster at first. Place: ẋ = R (v + ω × l) with
    v the velocity over ground and l the camera's lever arm.
    """

    def __init__(self, camera: Camera) -> None:
        """Keep the mounting."""
        self._R_body_camera = camera.T_body_camera[:3, :3].copy()
        self._lever_m = camera.T_body_camera[:3, 3].copy()
        self.reset()

    def reset(self) -> None:
        """Forget the past; the next frame is the origin."""
        self._euler: Array | None = None
        self._age_s = 0.0
        self._times: list[float] = []
        self._places: list[CameraPlace] = []

    @property
    def now(self) -> CameraPlace:
        """The latest frame's."""
        return self._places[-1]

    def update(self, sample: Proprioception) -> CameraPlace:
        """Take a frame's sensors in."""
        step = sample.time_s - self._times[-1] if self._times else 0.0
        place = self._places[-1].place_m if self._places else np.zeros(2)
        if self._euler is None or not 0.0 < step <= _LONGEST_STEP_S:
            euler = sample.euler_zyx_rad.copy()
        else:
            euler = self._steady(sample, step)
        self._euler = euler
        rotation = rotation_from_euler_zyx(*euler.tolist())
        if 0.0 < step <= _LONGEST_STEP_S:
            velocity = sample.velocity_ground_m_s + np.cross(sample.angular_velocity_rad_s, self._lever_m)
            place = place + step * (rotation @ velocity)[:2]
        now = CameraPlace(sample.time_s, rotation @ self._R_body_camera, place)
        self._times.append(sample.time_s)
        self._places.append(now)
        if self._times[0] < sample.time_s - _KEPT_S:
            kept = bisect_left(self._times, sample.time_s - _KEPT_S)
            del self._times[:kept], self._places[:kept]
        return now

    def at(self, time_s: float) -> CameraPlace:
        """Place at a time between frames that are still kept, attitude included."""
        index = min(max(bisect_left(self._times, time_s), 1), len(self._times) - 1) if len(self._times) > 1 else 0
        if index == 0:
            return self._places[0]
        a, b = self._places[index - 1], self._places[index]
        share = min(max((time_s - a.time_s) / (b.time_s - a.time_s), 0.0), 1.0)
        u, _, vt = np.linalg.svd((1.0 - share) * a.R_compass_camera + share * b.R_compass_camera)
        return CameraPlace(time_s, u @ vt, (1.0 - share) * a.place_m + share * b.place_m)

    def _steady(self, sample: Proprioception, step: float) -> Array:
        assert self._euler is not None
        roll, pitch, _ = self._euler.tolist()
        p, q, r = sample.angular_velocity_rad_s.tolist()
        turn = q * math.sin(roll) + r * math.cos(roll)
        rate = np.array(
            [
                p + math.tan(pitch) * turn,
                q * math.cos(roll) - r * math.sin(roll),
                turn / max(math.cos(pitch), 0.05),
            ]
        )
        euler = self._euler + step * rate
        self._age_s += step
        gain = step / min(_ATTITUDE_S, max(self._age_s, step))
        for k in range(3):
            euler[k] += gain * wrap_angle(float(sample.euler_zyx_rad[k] - euler[k]))
        euler[2] = wrap_angle(float(euler[2]))
        return euler
