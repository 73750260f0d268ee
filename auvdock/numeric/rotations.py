"""Rotations in three dimensions: of Euler angles, of a quaternion, of a rotation vector, and back.

World, body and camera frames are those of `core.transforms`, which has the like for plain Python.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.scalars import Vector

__all__ = [
    "back",
    "headed",
    "left_jacobian",
    "rotation_of",
    "rotation_of_euler_zyx",
    "rotation_of_quat_wxyz",
    "sine_axis",
    "turn_matrix",
    "vector_of",
]


@compiled
def rotation_of_euler_zyx(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Array:
    """(3, 3) Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp = math.cos(roll_rad), math.sin(roll_rad), math.cos(pitch_rad), math.sin(pitch_rad)
    cy, sy = math.cos(yaw_rad), math.sin(yaw_rad)
    rotation = np.empty((3, 3))
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = -sp, cp * sr, cp * cr
    return rotation


@compiled
def headed(heading_rad: float, level: Array) -> Array:
    """(3, 3) Rz(heading) R of a rotation R (3, 3) from body axes to level ones."""
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    turned = np.empty((3, 3))
    for i in range(3):
        turned[0, i] = cosine * level[0, i] - sine * level[1, i]
        turned[1, i] = sine * level[0, i] + cosine * level[1, i]
        turned[2, i] = level[2, i]
    return turned


@compiled
def rotation_of_quat_wxyz(quat: Array) -> tuple[Vector, Vector, Vector]:
    """Rows of the rotation of a unit quaternion (4,); tuples, so that who needs one row pays for no more."""
    w, x, y, z = quat[0], quat[1], quat[2], quat[3]
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


@compiled
def rotation_of(vector: Array) -> Array:
    """(3, 3) exp([r]) of a rotation vector (3,) (Rodrigues)."""
    x, y, z = vector[0], vector[1], vector[2]
    angle2 = x * x + y * y + z * z
    angle = math.sqrt(angle2)
    if angle < 1e-8:
        sine, rest = 1.0, 0.5
    else:
        sine, rest = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    rotation = np.empty((3, 3))
    rotation[0, 0], rotation[0, 1] = 1.0 - rest * (y * y + z * z), rest * x * y - sine * z
    rotation[0, 2] = rest * x * z + sine * y
    rotation[1, 0], rotation[1, 1] = rest * x * y + sine * z, 1.0 - rest * (x * x + z * z)
    rotation[1, 2] = rest * y * z - sine * x
    rotation[2, 0], rotation[2, 1] = rest * x * z - sine * y, rest * y * z + sine * x
    rotation[2, 2] = 1.0 - rest * (x * x + y * y)
    return rotation


@compiled
def sine_axis(rotation: Array) -> Vector:
    """The axis of a rotation (3, 3) times the sine of its angle: to first order its rotation vector."""
    return (
        0.5 * (rotation[2, 1] - rotation[1, 2]),
        0.5 * (rotation[0, 2] - rotation[2, 0]),
        0.5 * (rotation[1, 0] - rotation[0, 1]),
    )


@compiled
def vector_of(rotation: Array) -> Array:
    """(3,) rotation vector of a rotation matrix; at half a turn that whose first component is not negative."""
    vector = np.empty(3)
    vector[0], vector[1], vector[2] = sine_axis(rotation)
    sine = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    cosine = 0.5 * (rotation[0, 0] + rotation[1, 1] + rotation[2, 2] - 1.0)
    if sine > 1e-6:
        vector *= math.atan2(sine, cosine) / sine
    elif cosine < 0.0:
        # R = 2 a aᵀ - 1: from the greatest component of the axis a, known best, follow the others.
        k = 0
        for i in range(1, 3):
            if rotation[i, i] > rotation[k, k]:
                k = i
        for i in range(3):
            vector[i] = 0.25 * (rotation[i, k] + rotation[k, i]) + (0.5 if i == k else 0.0)
        size = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
        vector *= (-math.pi if vector[0] < 0.0 else math.pi) / size
    return vector


@compiled
def left_jacobian(vector: Array) -> Array:
    """(3, 3) J_l with exp([r + dr]) = exp([J_l dr]) exp([r]) to first order (Barfoot 2017, equation 7.77)."""
    x, y, z = vector[0], vector[1], vector[2]
    angle = math.sqrt(x * x + y * y + z * z)
    left = np.eye(3)
    if angle < 1e-8:
        return left
    sine = math.sin(angle) / angle
    a, b, c = x / angle, y / angle, z / angle
    k, h = 1.0 - sine, (1.0 - math.cos(angle)) / angle
    left[0, 0], left[0, 1], left[0, 2] = sine + k * a * a, k * a * b - h * c, k * a * c + h * b
    left[1, 0], left[1, 1], left[1, 2] = k * a * b + h * c, sine + k * b * b, k * b * c - h * a
    left[2, 0], left[2, 1], left[2, 2] = k * a * c - h * b, k * b * c + h * a, sine + k * c * c
    return left


@compiled
def back(rotation: Array, vector: Array) -> Array:
    """(3,) Rᵀ v."""
    out = np.empty(3)
    for i in range(3):
        out[i] = rotation[0, i] * vector[0] + rotation[1, i] * vector[1] + rotation[2, i] * vector[2]
    return out


@compiled
def turn_matrix(matrix: Array, rotation: Array) -> Array:
    """(6, 6) T M Tᵀ with T = diag(R, 1) of a matrix M (6, 6), linear parts first, and a rotation R (3, 3)."""
    half, whole = np.empty((6, 6)), np.empty((6, 6))
    for j in range(6):
        a, b, c = matrix[0, j], matrix[1, j], matrix[2, j]
        for i in range(3):
            half[i, j] = rotation[i, 0] * a + rotation[i, 1] * b + rotation[i, 2] * c
            half[3 + i, j] = matrix[3 + i, j]
    for i in range(6):
        a, b, c = half[i, 0], half[i, 1], half[i, 2]
        for j in range(3):
            whole[i, j] = a * rotation[j, 0] + b * rotation[j, 1] + c * rotation[j, 2]
            whole[i, 3 + j] = half[i, 3 + j]
    return whole
