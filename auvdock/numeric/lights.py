"""Lights that a pose is solved from, and what the solution tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.numeric.arrays import Array
from auvdock.numeric.records import Record

__all__ = ["Light", "Pose", "Solution"]


@dataclass
class Light(Record):
    """A light of the station and its image."""

    place_m: Annotated[Array, 3]
    """X, Y, Z in the station frame."""
    centre_px: Annotated[Array, 2]
    """u, v of its image."""
    sigma_px: float
    """Standard deviation of either."""
    is_seen: bool
    """Whether it was detected in this frame; else its image is predicted."""


@dataclass
class Pose(Record):
    """A pose p_camera = R p_station + t."""

    rotation_vector: Annotated[Array, 3]
    """r of R = exp([r]) (Rodrigues)."""
    translation_m: Annotated[Array, 3]
    """t."""


@dataclass
class Solution(Record):
    """A pose of the station in the camera frame, and all that is asked about it."""

    pose: Pose
    rotation: Annotated[Array, 3, 3]
    """R."""
    T_station_camera: Annotated[Array, 4, 4]
    """Pose of the camera in the station frame: [Rᵀ, -Rᵀ t]."""
    covariance: Annotated[Array, 6, 6]
    """Of (camera position in the station frame, small rotation in the camera frame)."""
    attitude_error_rad: float
    """Angle to the attitude prior."""
    cost: float
    """χ² of the reprojection and of the attitude prior; nan where there is no pose and nothing else counts."""
    lights_cost: float
    """χ² of the reprojection alone."""
    error_px: float
    """Mean residual of the lights that were seen, or of all where none was."""
