"""Small, fast questions about a free body's state, in plain floats."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["is_absurd", "rotation_rows"]

_MAX_SPEED_M_S = 10.0
_MAX_RATE_RAD_S = 50.0
_MAX_DISTANCE_M = 200.0


def is_absurd(qpos: Sequence[float], qvel: Sequence[float]) -> bool:
    """True unless the state is finite, slower than 10 m/s and 50 rad/s, and within 200 m of the world's origin.

    Args:
        qpos: position (3) and quaternion wxyz (4).
        qvel: linear (3) and angular (3) velocity.
    """
    x, y, z, qw, qx, qy, qz = qpos
    u, v, w, p, q, r = qvel
    # Written as what must hold, so that a NaN anywhere answers True.
    return not (
        x * x + y * y + z * z < _MAX_DISTANCE_M**2
        and u * u + v * v + w * w < _MAX_SPEED_M_S**2
        and p * p + q * q + r * r < _MAX_RATE_RAD_S**2
        and 0.5 < qw * qw + qx * qx + qy * qy + qz * qz < 2.0
    )


def rotation_rows(w: float, x: float, y: float, z: float) -> tuple[float, ...]:
    """Rotation matrix of a unit quaternion, row by row: as `rotation_from_quat_wxyz`, without an array."""
    return (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
