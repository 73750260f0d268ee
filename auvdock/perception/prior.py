"""The attitude prior: how the station must be turned as the camera sees it, from inclinometer and compass."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import Bearing, Proprioception
from auvdock.core.transforms import rotation_from_euler_zyx, wrap_angle

__all__ = ["AttitudePrior", "FacingHeading"]

_FACING_SIGMA_RAD = math.radians(25.0)
"""The lamps of the array shine 22.5° to either side at half of their intensity, and are seen some way beyond."""


class AttitudePrior:
    """R_camera_station from the vehicle's own attitude and the station's surveyed heading.

    R_camera_station = R_camera_body R_body_world R_world_station, with R_world_station = Rz(station yaw): stations
    stand upright.
    """

    def __init__(self, camera: Camera, station_yaw_rad: float) -> None:
        """Precompute the constant factors."""
        self._camera_body = np.ascontiguousarray(camera.T_body_camera[:3, :3].T)
        self._world_station = _turn(station_yaw_rad)

    def rotation(self, proprioception: Proprioception, station_yaw_rad: float | None = None) -> Array:
        """(3, 3) R_camera_station, for the surveyed heading or another."""
        roll, pitch, yaw = proprioception.euler_zyx_rad.tolist()
        station = self._world_station if station_yaw_rad is None else _turn(station_yaw_rad)
        return self._camera_body.dot(rotation_from_euler_zyx(roll, pitch, yaw).T).dot(station)


class FacingHeading:
    """Heading of a station that nobody surveyed, from seeing its lamps at all: they shine to the front only.

    Approach axis = compass bearing to the lamps + π, within some 25°.
    """

    def __init__(self, camera: Camera) -> None:
        """Keep the mounting."""
        self._body_camera = camera.T_body_camera[:3, :3]
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


def _turn(yaw_rad: float) -> Array:
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
