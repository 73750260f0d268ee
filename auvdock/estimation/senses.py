"""Proprioception unpacked once a period, for scalar code and for compiled code."""

from __future__ import annotations

import math
from typing import NamedTuple

from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception
from auvdock.numeric.compiled import compiled
from auvdock.numeric.motion import Motion
from auvdock.numeric.records import Records, new_rows
from auvdock.numeric.rotations import headed, rotation_of_euler_zyx
from auvdock.numeric.scalars import Vector

__all__ = ["Senses", "Vector", "cross", "read_senses"]

_MOTION = Motion.dtype()


class Senses(NamedTuple):
    """One sample; body axes x forward, y port, z up.

    Attributes:
        time_s: time.
        depth_m: positive down.
        yaw_rad: compass heading of the body, the last of the Euler angles zyx in the world; positive to port.
        contact: bow switch.
        latched: latch reported closed.
        motion: (1,) what compiled code reads, never written to.
    """

    time_s: float
    depth_m: float
    yaw_rad: float
    contact: bool
    latched: bool
    motion: Records[Motion]

    @property
    def roll_rad(self) -> float:
        """Positive to starboard."""
        return self.motion["roll_rad"].item()

    @property
    def pitch_rad(self) -> float:
        """Positive nose down."""
        return self.motion["pitch_rad"].item()

    @property
    def rate_rad_s(self) -> Vector:
        """p, q, r."""
        p, q, r = self.motion["rate_rad_s"][0].tolist()
        return p, q, r

    @property
    def ground_m_s(self) -> Vector:
        """Velocity over ground, body axes."""
        x, y, z = self.motion["ground_m_s"][0].tolist()
        return x, y, z

    @property
    def ground_age_s(self) -> float:
        """Time since that was last measured."""
        return self.motion["ground_age_s"].item()

    @property
    def surge_water_m_s(self) -> float:
        """Forward velocity through the water."""
        return self.motion["water_m_s"].item(0)

    def level(self, heading_rad: float, vector: Vector) -> Vector:
        """A vector of body axes in level axes against which the vehicle heads `heading_rad` to port: Rz R v."""
        return _level(self.motion, heading_rad, vector[0], vector[1], vector[2])

    def level_ray(self, heading_rad: float, R_body_camera: Array, ray_camera: Array) -> Vector:
        """As `level` for a direction (3,) in the frame of a camera whose mounting is R_body_camera (3, 3)."""
        return _level_ray(self.motion, heading_rad, R_body_camera, ray_camera)


def read_senses(proprioception: Proprioception) -> Senses:
    """Unpack; a reading that is not finite counts as 0, so that no command ever becomes NaN."""
    depth, time = proprioception.depth_m, proprioception.time_s
    euler = proprioception.euler_zyx_rad
    yaw = float(euler[2])
    motion: Records[Motion] = new_rows(1, _MOTION)
    _sense(
        motion,
        euler,
        proprioception.angular_velocity_rad_s,
        proprioception.velocity_ground_m_s,
        proprioception.velocity_water_m_s,
        proprioception.ground_age_s,
    )
    return Senses(
        time if math.isfinite(time) else 0.0,
        depth if math.isfinite(depth) else 0.0,
        yaw if math.isfinite(yaw) else 0.0,
        proprioception.contact,
        proprioception.latched,
        motion,
    )


@compiled
def _sense(
    motion: Records[Motion], euler_rad: Array, rate_rad_s: Array, ground_m_s: Array, water_m_s: Array, age_s: float
) -> None:
    """Write `Senses.motion` (1,)."""
    now = motion[0]
    now.ground_age_s = _finite(age_s)
    now.roll_rad, now.pitch_rad = _finite(euler_rad[0]), _finite(euler_rad[1])
    for i in range(3):
        now.rate_rad_s[i] = _finite(rate_rad_s[i])
        now.ground_m_s[i] = _finite(ground_m_s[i])
        now.water_m_s[i] = _finite(water_m_s[i])
    level = rotation_of_euler_zyx(now.roll_rad, now.pitch_rad, 0.0)
    for i in range(3):
        for j in range(3):
            now.R_level_body[i, j] = level[i, j]


@compiled
def _finite(value: float) -> float:
    """The value, or 0 in the place of one that is not finite."""
    return value if math.isfinite(value) else 0.0


@compiled
def _level(motion: Records[Motion], heading_rad: float, x: float, y: float, z: float) -> Vector:
    """`Senses.level`, from `Senses.motion`."""
    R = headed(heading_rad, motion[0].R_level_body)
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@compiled
def _level_ray(motion: Records[Motion], heading_rad: float, R_body_camera: Array, ray_camera: Array) -> Vector:
    """`Senses.level_ray`, from `Senses.motion`."""
    R, (x, y, z) = R_body_camera, (ray_camera[0], ray_camera[1], ray_camera[2])
    return _level(
        motion,
        heading_rad,
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
