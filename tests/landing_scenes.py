"""Synthetic landings: lights and tag of the landing station in a moving belly camera, with noise; tags as images."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np

from auvdock.core.arrays import Array, Image
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, Detections, Frame, Proprioception, TagDetection
from auvdock.core.landing_station import load_landing_station
from auvdock.core.response import CameraResponse
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx, rotation_looking_along
from auvdock.perception.landing.tag import tag_corners_m
from auvdock.sim.sensors import SensorCfg, Sensors

STATION = load_landing_station()
LIGHTS = STATION.layout.array_positions_m
CORNERS = tag_corners_m(STATION.tag)
CAMERA = Camera(
    800,
    600,
    np.array([[857.5, 0.0, 417.6], [0.0, 856.5, 285.2], [0.0, 0.0, 1.0]]),
    np.array([-0.12, 0.02, 1.8e-4, 2.7e-3, 0.0]),
    make_transform(
        rotation_looking_along(np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])), np.array([0.05, 0.02, -0.12])
    ),
    20.0,
)
"""Paper C's intrinsics with a barrel distortion of the usual size (ours)."""


@dataclass(frozen=True)
class Descent:
    """A smooth landing: exponential approach from a start to a hover, with a swell in every axis."""

    start_m: Array
    yaw_rad: float
    end_height_m: float = 0.35
    time_constant_s: float = 5.0

    def body(self, time_s: float) -> tuple[Array, Array]:
        """(position of the body in the station frame, Euler angles)."""
        left = math.exp(-time_s / self.time_constant_s)
        sway = np.array([math.sin(0.9 * time_s), math.sin(0.7 * time_s + 1.0), math.sin(1.1 * time_s + 2.0)])
        target = np.array([0.0, 0.0, self.end_height_m])
        position = target + left * (self.start_m - target) + 0.02 * sway
        euler = np.array([0.03 * sway[1], 0.02 * sway[2], left * self.yaw_rad + 0.01 * sway[0]])
        return position, euler

    def camera(self, time_s: float) -> Array:
        """(4, 4) T_station_camera."""
        position, euler = self.body(time_s)
        return make_transform(rotation_from_euler_zyx(*euler.tolist()), position) @ CAMERA.T_body_camera

    def rates(self, time_s: float) -> tuple[Array, Array]:
        """(velocity, angular velocity), both in the body frame, by central differences."""
        h = 1e-4
        (p0, e0), (p1, e1), (_, e) = self.body(time_s - h), self.body(time_s + h), self.body(time_s)
        rotation = rotation_from_euler_zyx(*e.tolist())
        turn = rotation_from_euler_zyx(*e0.tolist()).T @ rotation_from_euler_zyx(*e1.tolist())
        omega = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4.0 * h)
        return rotation.T @ (p1 - p0) / (2.0 * h), omega


@dataclass
class Senses:
    """The vehicle's sensors and marks with noise along a descent."""

    descent: Descent
    rng: np.random.Generator
    light_sigma_px: float = 0.05
    tag_sigma_px: float = 0.05
    sensors: Sensors = field(default_factory=lambda: Sensors(SensorCfg()))

    def __post_init__(self) -> None:
        """Draw this flight's biases."""
        self.sensors.reset(np.random.default_rng(self.rng.integers(2**63)))

    def proprioception(self, time_s: float) -> Proprioception:
        """One sample."""
        position, euler = self.descent.body(time_s)
        velocity, omega = self.descent.rates(time_s)
        nu = np.concatenate([velocity, omega])
        roll, pitch, yaw = euler.tolist()
        depth = STATION.depth_m - float(position[2])
        return self.sensors.sample(time_s, depth, np.array([roll, pitch, yaw]), nu, nu, 0.0, False)

    def lights(self, time_s: float, dead: tuple[int, ...] = (), spurious_n: int = 0) -> Detections:
        """The lights in view but the dead ones, and spots that are none, shuffled."""
        T = self.descent.camera(time_s)
        q = (LIGHTS - T[:3, 3]) @ T[:3, :3]
        keep = CAMERA.in_view(q)
        keep[list(dead)] = False
        pixels = CAMERA.project(q[keep]) if keep.any() else np.zeros((0, 2))
        pixels = pixels + self.rng.normal(0.0, self.light_sigma_px, pixels.shape)
        stray = self.rng.uniform((0.0, 0.0), (800.0, 600.0), (spurious_n, 2))
        centres = np.vstack([pixels, stray])[self.rng.permutation(len(pixels) + spurious_n)]
        return Detections.from_points(centres, np.full(len(centres), 0.9), np.full(len(centres), BLUE), 0.01)

    def tags(self, time_s: float, far_m: float = 4.0) -> tuple[TagDetection, ...]:
        """The tag if all of it is in view and it is near enough."""
        T = self.descent.camera(time_s)
        q = (CORNERS - T[:3, 3]) @ T[:3, :3]
        if not CAMERA.in_view(q).all() or float(q[:, 2].mean()) > far_m:
            return ()
        pixels = CAMERA.project(q) + self.rng.normal(0.0, self.tag_sigma_px, (4, 2))
        return (TagDetection(STATION.tag.tag_id, pixels, self.tag_sigma_px),)


def tag_frame(
    T_station_camera: Array,
    rng: np.random.Generator | None = None,
    *,
    tag_id: int = 0,
    family: int = cv2.aruco.DICT_APRILTAG_36h11,
    white: float = 150.0,
    black: float = 40.0,
    blur_px: float = 0.8,
    noise_dn: float = 2.0,
) -> Frame:
    """The tag through the distorting lens, two samples a pixel each way, blurred and noisy; codes linear in light."""
    dictionary = cv2.aruco.getPredefinedDictionary(family)
    edge = dictionary.markerSize + 2
    marker = cv2.aruco.generateImageMarker(dictionary, tag_id, edge)
    cells = np.pad(np.asarray(marker, dtype=np.float64) / 255.0, 1, constant_values=1.0)
    fine = 2
    grid = (np.arange(800 * fine) + 0.5) / fine - 0.5, (np.arange(600 * fine) + 0.5) / fine - 0.5
    coarse_u, coarse_v = np.meshgrid(np.linspace(-1, 800, 101), np.linspace(-1, 600, 76))
    xy = CAMERA.normalise(np.column_stack([coarse_u.ravel(), coarse_v.ravel()]))
    map_u = ((grid[0] + 1.0) / 801.0 * 100.0).astype(np.float32)
    map_v = ((grid[1] + 1.0) / 601.0 * 75.0).astype(np.float32)
    at = np.meshgrid(map_u, map_v)
    x, y = (
        np.asarray(cv2.remap(part.reshape(76, 101).astype(np.float32), at[0], at[1], cv2.INTER_CUBIC), dtype=np.float64)
        for part in (xy[:, 0], xy[:, 1])
    )
    R, p = T_station_camera[:3, :3], T_station_camera[:3, 3]
    down = R[2, 0] * x + R[2, 1] * y + R[2, 2]
    scale = (STATION.tag.position_m[2] - p[2]) / down
    forward = p[0] + scale * (R[0, 0] * x + R[0, 1] * y + R[0, 2]) - STATION.tag.position_m[0]
    port = p[1] + scale * (R[1, 0] * x + R[1, 1] * y + R[1, 2]) - STATION.tag.position_m[1]
    cell, last = STATION.tag.size_m / edge, edge + 1
    middle = 0.5 * edge + 1.0
    row, column = np.floor(middle - forward / cell).astype(int), np.floor(middle - port / cell).astype(int)
    inside = (row >= 0) & (row <= last) & (column >= 0) & (column <= last)
    level = np.where(inside, cells[np.clip(row, 0, last), np.clip(column, 0, last)], 0.3)
    image = level.reshape(600, fine, 800, fine).mean(axis=(1, 3)) * (white - black) + black
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), blur_px), dtype=np.float64) if blur_px > 0.0 else image
    if rng is not None:
        image = image + rng.normal(0.0, noise_dn, image.shape)
    grey: Image = np.clip(np.round(image), 0, 255).astype(np.uint8)
    return Frame(np.repeat(grey[:, :, None], 3, axis=2), 0.0, CAMERA, response=CameraResponse(encoding="linear"))
