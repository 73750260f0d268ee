"""A free body's attitude in plain floats."""

from __future__ import annotations

__all__ = ["rotation_rows"]


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
