"""Proprioception unpacked once a period, for scalar code and for compiled code."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception
from auvdock.numeric.compiled import compiled
from auvdock.numeric.motion import GROUND, LEVEL, MOTION, PITCH, RATE, ROLL, WATER
from auvdock.numeric.rotations import headed, rotation_of_euler_zyx
from auvdock.numeric.scalars import Vector

__all__ = ["Senses", "Vector", "cross", "read_senses"]


class Senses(NamedTuple):
    """One sample; body axes x forward, y port, z up.

    Attributes:
        time_s: time.
        depth_m: positive down.
        yaw_rad: compass heading of the body, the last of the Euler angles zyx in the world; positive to port.
        contact: bow switch.
        latched: latch reported closed.
        motion: (20,) what compiled code reads, never written to; its places are `numeric.motion`.
    """

    time_s: float
    depth_m: float
    yaw_rad: float
    contact: bool
    latched: bool
    motion: Array

    @property
    def roll_rad(self) -> float:
        """Positive to starboard."""
        return self.motion.item(ROLL)

    @property
    def pitch_rad(self) -> float:
        """Positive nose down."""
        return self.motion.item(PITCH)

    @property
    def rate_rad_s(self) -> Vector:
        """p, q, r."""
        p, q, r = self.motion[RATE:GROUND].tolist()
        return p, q, r

    @property
    def ground_m_s(self) -> Vector:
        """Velocity over ground, body axes."""
        x, y, z = self.motion[GROUND:WATER].tolist()
        return x, y, z

    @property
    def surge_water_m_s(self) -> float:
        """Forward velocity through the water."""
        return self.motion.item(WATER)

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
    motion = np.empty(MOTION)
    _motion(
        motion,
        euler,
        proprioception.angular_velocity_rad_s,
        proprioception.velocity_ground_m_s,
        proprioception.velocity_water_m_s,
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
def _motion(motion: Array, euler_rad: Array, rate_rad_s: Array, ground_m_s: Array, water_m_s: Array) -> None:
    """Write `Senses.motion`."""
    motion[ROLL], motion[PITCH] = euler_rad[0], euler_rad[1]
    for i in range(3):
        motion[RATE + i], motion[GROUND + i], motion[WATER + i] = rate_rad_s[i], ground_m_s[i], water_m_s[i]
    for i in range(LEVEL):
        if not math.isfinite(motion[i]):
            motion[i] = 0.0
    motion[LEVEL:] = rotation_of_euler_zyx(motion[ROLL], motion[PITCH], 0.0).ravel()


@compiled
def _level(motion: Array, heading_rad: float, x: float, y: float, z: float) -> Vector:
    """`Senses.level`, from `Senses.motion`."""
    R = headed(heading_rad, motion[LEVEL:].reshape(3, 3))
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@compiled
def _level_ray(motion: Array, heading_rad: float, R_body_camera: Array, ray_camera: Array) -> Vector:
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
