"""Where a camera is and looks, drawn about a station; the body is the camera, x along its axis."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.dataset.config import PoseDraw

__all__ = ["Room", "before_funnel", "over_platform"]

_SIDE_DEG = 80.0
_CLEAR_M = 0.5
"""From surface and floor."""
_LATERAL = 0.3
"""Of the height above a platform: standard deviation sideways."""
_TILT_DEG = 4.0
"""Standard deviation of a hovering vehicle's roll and pitch."""


class Room:
    """Water above and below a station whose origin is `depth_m` deep."""

    def __init__(self, depth_m: float, floor_below_m: float) -> None:
        """Keep a camera clear of both borders."""
        self.depth_m = depth_m
        self._low, self._high = -depth_m - floor_below_m + _CLEAR_M, -_CLEAR_M

    def place(self, station_m: Array) -> Array:
        """A point (3,) of the station frame in the world, moved up or down into the water."""
        x, y, z = station_m.tolist()
        return np.array([x, y, min(max(z - self.depth_m, self._low), self._high)])


def before_funnel(
    cfg: PoseDraw, range_m: float, camera: Camera, room: Room, rng: np.random.Generator, *, around: bool
) -> tuple[Array, float]:
    """A body pose (4, 4) at a distance from a mouth, and its azimuth in the station frame.

    Args:
        cfg: how it is drawn.
        range_m: distance from the mouth's centre.
        camera: gives the field of view in which the station lies.
        room: keeps the camera in the water.
        rng: draws.
        around: from the sides too, as a rotating beacon can be seen.
    """
    azimuth, elevation = np.radians([cfg.azimuth_deg, cfg.elevation_deg]) * rng.standard_normal(2)
    side = math.radians(_SIDE_DEG)
    azimuth = float(rng.uniform(-side, side) if around else np.clip(azimuth, -side, side))
    elevation = float(np.clip(elevation, -1.0, 1.0))
    level = range_m * math.cos(elevation)
    place = room.place(np.array([level * math.cos(azimuth), level * math.sin(azimuth), range_m * math.sin(elevation)]))
    to_mouth = np.array([0.0, 0.0, -room.depth_m]) - place
    yaw = math.atan2(to_mouth[1], to_mouth[0])
    pitch = -math.atan2(to_mouth[2], math.hypot(to_mouth[0], to_mouth[1]))
    yaw, pitch = _aside(cfg, camera, rng, yaw, pitch)
    roll = math.radians(cfg.roll_deg) * float(rng.standard_normal())
    return make_transform(rotation_from_euler_zyx(roll, pitch, yaw), place), azimuth


def over_platform(cfg: PoseDraw, height_m: float, camera: Camera, room: Room, rng: np.random.Generator) -> Array:
    """A body pose (4, 4) with the belly camera at a height above a platform, at any heading."""
    x, y = _LATERAL * height_m * rng.standard_normal(2)
    roll, pitch = np.radians(_TILT_DEG) * rng.standard_normal(2)
    yaw = float(rng.uniform(-math.pi, math.pi))
    if rng.random() < cfg.away_share:
        roll += math.radians(70.0)
    rotation = rotation_from_euler_zyx(float(roll), float(pitch), yaw)
    place = room.place(np.array([x, y, height_m]))
    return make_transform(rotation, place - rotation @ camera.T_body_camera[:3, 3])


def _aside(cfg: PoseDraw, camera: Camera, rng: np.random.Generator, yaw: float, pitch: float) -> tuple[float, float]:
    """Yaw and pitch that put what they point at anywhere in the middle share of the picture, or out of it."""
    half = np.array([camera.width_px, camera.height_px]) * 0.5 * cfg.aim_share
    middle = np.array([camera.width_px - 1, camera.height_px - 1]) * 0.5
    across, down = camera.normalise((middle + half * rng.uniform(-1.0, 1.0, 2))[None, :])[0].tolist()
    if rng.random() < cfg.away_share:
        return yaw + float(rng.uniform(0.4 * math.pi, 1.6 * math.pi)), pitch
    # Body axes: yaw to port moves a light to the right, nose down moves it up.
    return yaw + math.atan(across), pitch - math.atan(down)
