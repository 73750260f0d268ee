"""The attitude prior: how the station must be turned as the camera sees it, from inclinometer and compass."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx

__all__ = ["AttitudePrior"]


class AttitudePrior:
    """R_camera_station from the vehicle's own attitude and the station's surveyed heading.

    R_camera_station = R_camera_body R_body_world R_world_station, with R_world_station = Rz(station yaw): stations
    stand upright.
    """

    def __init__(self, camera: Camera, station_yaw_rad: float) -> None:
        """Precompute the constant factors."""
        self._camera_body = np.ascontiguousarray(camera.T_body_camera[:3, :3].T)
        c, s = math.cos(station_yaw_rad), math.sin(station_yaw_rad)
        self._world_station = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def rotation(self, proprioception: Proprioception) -> Array:
        """(3, 3) R_camera_station."""
        roll, pitch, yaw = proprioception.euler_zyx_rad.tolist()
        return self._camera_body @ rotation_from_euler_zyx(roll, pitch, yaw).T @ self._world_station
