"""Proprioception unpacked into plain floats: the controllers' arithmetic is scalar, which is faster than 3-vectors."""

from __future__ import annotations

import math
from typing import NamedTuple

from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception

__all__ = [
    "Rows",
    "Senses",
    "Vector",
    "cross",
    "read_senses",
    "rotate",
    "rotate_back",
    "rotation_zyx",
    "rows_of",
    "turn",
]

Vector = tuple[float, float, float]
Rows = tuple[float, float, float, float, float, float, float, float, float]
"""A (3, 3) matrix, row by row."""


class Senses(NamedTuple):
    """One sample; body axes x forward, y port, z up.

    Attributes:
        time_s: time.
        depth_m: positive down.
        roll_rad, pitch_rad, yaw_rad: Euler angles zyx of the body in the world; positive pitch is nose down.
        rate_rad_s: p, q, r.
        ground_m_s: velocity over ground, body axes.
        water_m_s: velocity through the water, body axes.
        contact: bow switch.
        latched: latch reported closed.
        level: rotation from body axes to the level heading frame (ahead, port, up).
    """

    time_s: float
    depth_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    rate_rad_s: Vector
    ground_m_s: Vector
    water_m_s: Vector
    contact: bool
    latched: bool
    level: Rows


def read_senses(proprioception: Proprioception) -> Senses:
    """Unpack; a reading that is not finite counts as 0, so that no command ever becomes NaN."""
    roll, pitch, yaw = _finite(proprioception.euler_zyx_rad.tolist())
    depth, time = proprioception.depth_m, proprioception.time_s
    return Senses(
        time_s=time if math.isfinite(time) else 0.0,
        depth_m=depth if math.isfinite(depth) else 0.0,
        roll_rad=roll,
        pitch_rad=pitch,
        yaw_rad=yaw,
        rate_rad_s=_finite(proprioception.angular_velocity_rad_s.tolist()),
        ground_m_s=_finite(proprioception.velocity_ground_m_s.tolist()),
        water_m_s=_finite(proprioception.velocity_water_m_s.tolist()),
        contact=proprioception.contact,
        latched=proprioception.latched,
        level=rotation_zyx(roll, pitch, 0.0),
    )


def _finite(values: list[float]) -> Vector:
    x, y, z = values
    if math.isfinite(x + y + z):
        return x, y, z
    clean = [value if math.isfinite(value) else 0.0 for value in values]
    return clean[0], clean[1], clean[2]


def rows_of(matrix: Array) -> Rows:
    """A (3, 3) array as plain rows."""
    a, b, c, d, e, f, g, h, i = matrix.ravel().tolist()
    return a, b, c, d, e, f, g, h, i


def rotation_zyx(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Rows:
    """Rz(yaw) Ry(pitch) Rx(roll), as `auvdock.core.transforms.rotation_from_euler_zyx`."""
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    cy, sy = math.cos(yaw_rad), math.sin(yaw_rad)
    return (
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    )


def turn(level: Rows, yaw_rad: float) -> Rows:
    """Rz(yaw) R: from a level heading frame to one that is turned by −yaw against it."""
    a, b, c, d, e, f, g, h, i = level
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    return (
        cosine * a - sine * d,
        cosine * b - sine * e,
        cosine * c - sine * f,
        sine * a + cosine * d,
        sine * b + cosine * e,
        sine * c + cosine * f,
        g,
        h,
        i,
    )


def rotate(rows: Rows, vector: Vector) -> Vector:
    """R v."""
    x, y, z = vector
    return (
        rows[0] * x + rows[1] * y + rows[2] * z,
        rows[3] * x + rows[4] * y + rows[5] * z,
        rows[6] * x + rows[7] * y + rows[8] * z,
    )


def rotate_back(rows: Rows, vector: Vector) -> Vector:
    """Rᵀ v."""
    x, y, z = vector
    return (
        rows[0] * x + rows[3] * y + rows[6] * z,
        rows[1] * x + rows[4] * y + rows[7] * z,
        rows[2] * x + rows[5] * y + rows[8] * z,
    )


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
