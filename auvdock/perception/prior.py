"""The attitude prior: how the station must be turned as the camera sees it, from inclinometer and compass."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Bearing, Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx, wrap_angle
from auvdock.numeric.compiled import compiled
from auvdock.numeric.rotations import rotation_of_euler_zyx

__all__ = ["AttitudePrior", "FacingHeading"]

_FACING_SIGMA_RAD = math.radians(25.0)
"""The lamps of the array shine 22.5° to either side at half of their intensity, and are seen some way beyond."""


class AttitudePrior:
    """R_camera_station from the vehicle's own attitude and the station's surveyed heading.

    R_camera_station = R_camera_body R_body_world R_world_station, with R_world_station = Rz(station yaw): stations
    stand upright.
    """

    def __init__(self, camera: Camera, station_yaw_rad: float) -> None:
        """Keep the mounting and the heading."""
        self._camera_body = np.ascontiguousarray(camera.T_body_camera[:3, :3].T)
        self._station_yaw_rad = station_yaw_rad

    def rotation(self, proprioception: Proprioception, station_yaw_rad: float | None = None) -> Array:
        """(3, 3) R_camera_station, for the surveyed heading or another."""
        station = self._station_yaw_rad if station_yaw_rad is None else station_yaw_rad
        return _camera_station(self._camera_body, proprioception.euler_zyx_rad, station)


class FacingHeading:
    """Heading of a station that nobody surveyed, from seeing its lamps at all: they shine to the front only.

    Approach axis = compass bearing to the lamps + π, within some 25°.
    """

    def __init__(self, camera: Camera) -> None:
        """Keep the mounting."""
        self._body_camera = camera.T_body_camera[:3, :3].copy()
        self.reset()

    def reset(self) -> None:
        """Forget where the lamps were."""
        self._ray_camera = np.array([0.0, 0.0, 1.0])

    def note(self, lamps: Bearing | None) -> None:
        """Take note of where the lamps were seen in this frame."""
        if lamps is not None:
            self._ray_camera = lamps.ray_camera

    def heading(self, proprioception: Proprioception) -> tuple[float, float]:
        """Compass heading of the approach axis and its standard deviation, both in rad."""
        roll, pitch, yaw = proprioception.euler_zyx_rad.tolist()
        x, y, _ = (rotation_from_euler_zyx(roll, pitch, yaw) @ (self._body_camera @ self._ray_camera)).tolist()
        return wrap_angle(math.atan2(y, x) + math.pi), _FACING_SIGMA_RAD


@compiled
def _camera_station(camera_body: Array, euler_zyx_rad: Array, station_yaw_rad: float) -> Array:
    """(3, 3) R_camera_body (Rz(yaw) Ry(pitch) Rx(roll))ᵀ Rz(station yaw)."""
    world_body = rotation_of_euler_zyx(euler_zyx_rad[0], euler_zyx_rad[1], euler_zyx_rad[2])
    world_station = np.zeros((3, 3))
    cs, ss = math.cos(station_yaw_rad), math.sin(station_yaw_rad)
    world_station[0, 0], world_station[0, 1], world_station[1, 0], world_station[1, 1] = cs, -ss, ss, cs
    world_station[2, 2] = 1.0
    return camera_body @ world_body.T @ world_station
