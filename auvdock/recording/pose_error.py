"""Errors of estimated camera poses against the simulator's truth."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["camera_in_station", "pose_errors"]


def camera_in_station(T_world_station: Array, T_world_body: Array, T_body_camera: Array) -> Array:
    """(n, 4, 4) true T_station_camera from T_world_body (n, 4, 4) and the two fixed transforms (4, 4)."""
    return np.linalg.inv(T_world_station) @ T_world_body @ T_body_camera


def pose_errors(T_estimated: Array, T_true: Array) -> tuple[Array, Array]:
    """Errors of poses (n, 4, 4) of the camera in the station frame.

    Returns:
        (n, 3) position error in metres, lateral (station y), vertical (z) and along the axis (x), estimate minus truth;
        (n,) angle in radians of the rotation R_trueᵀ R_estimated, from its trace: cos θ = (tr R - 1) / 2.
    """
    offset = T_estimated[:, :3, 3] - T_true[:, :3, 3]
    trace = np.einsum("nij,nij->n", T_true[:, :3, :3], T_estimated[:, :3, :3])
    return offset[:, [1, 2, 0]], np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))
