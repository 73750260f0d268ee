"""Synthetic approaches: the lights of the conical station projected into a moving camera, with noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.contracts import BLUE, Detections, Percept, Proprioception
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx

LAYOUT = load_conical_station("conical").layout
CAMERA: Camera = make_camera(
    CameraCfg(), np.array([0.61, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
)
ARRAY = np.array(LAYOUT.indices("array"))
FAR = LAYOUT.indices("long_range")[0]
RED = np.array(LAYOUT.indices("entrance"))


@dataclass(frozen=True)
class Motion:
    """Camera motion with constant rates."""

    position_m: Array
    euler_rad: Array
    velocity_m_s: Array
    rate_rad_s: Array

    def at(self, time_s: float) -> tuple[Array, Array]:
        """(T_station_camera, body euler angles) at a time."""
        euler = self.euler_rad + time_s * self.rate_rad_s
        rotation = rotation_from_euler_zyx(*euler.tolist()) @ CAMERA.T_body_camera[:3, :3]
        return make_transform(rotation, self.position_m + time_s * self.velocity_m_s), euler


def pixels_of(T_station_camera: Array, points_m: Array) -> Array:
    """Pixels of station points seen from a camera pose."""
    return CAMERA.project((points_m - T_station_camera[:3, 3]) @ T_station_camera[:3, :3])


def all_in_view(T_station_camera: Array, points_m: Array) -> bool:
    """Whether every point falls on the sensor; for points less than 55° off the optical axis."""
    pixels = pixels_of(T_station_camera, points_m)
    return bool(pixels.min() >= 0.0 and pixels[:, 0].max() < CAMERA.width_px and pixels[:, 1].max() < CAMERA.height_px)


def random_motion(rng: np.random.Generator, points_m: Array, duration_s: float = 0.5) -> Motion:
    """An approach in the mid range: 2.5 to 12 m out, within 20° of the axis, roll within ±20°, all lights in view."""
    while True:
        distance = rng.uniform(2.5, 12.0)
        off_axis, around = math.radians(20.0) * math.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * math.pi)
        position = distance * np.array(
            [
                math.cos(off_axis),
                math.sin(off_axis) * math.cos(around),
                math.sin(off_axis) * math.sin(around),
            ]
        )
        yaw = math.atan2(-position[1], -position[0]) + math.radians(rng.uniform(-15.0, 15.0))
        pitch = math.atan2(position[2], math.hypot(position[0], position[1])) + math.radians(rng.uniform(-8.0, 8.0))
        motion = Motion(
            position,
            np.array([math.radians(rng.uniform(-20.0, 20.0)), pitch, yaw]),
            np.array([-rng.uniform(0.3, 0.7), *rng.uniform(-0.1, 0.1, 2)]),
            np.radians(rng.uniform(-4.0, 4.0, 3)),
        )
        if all_in_view(motion.at(0.0)[0], points_m) and all_in_view(motion.at(duration_s)[0], points_m):
            return motion


def proprioception(
    rng: np.random.Generator, euler: Array, time_s: float = 0.0, bias_rad: Array | None = None
) -> Proprioception:
    """The vehicle's own sensors: a constant attitude error plus 0.1° of noise."""
    bias = np.zeros(3) if bias_rad is None else bias_rad
    measured = euler + bias + rng.normal(0.0, math.radians(0.1), 3)
    zero = np.zeros(3)
    return Proprioception(time_s, 8.0, measured, zero, zero, zero)


def attitude_bias(rng: np.random.Generator) -> Array:
    """Constant error of one episode: inclinometer 0.5°, compass 2° (standard deviations)."""
    return rng.normal(0.0, 1.0, 3) * np.radians([0.5, 0.5, 2.0])


def blue_detections(
    rng: np.random.Generator, centres_px: Array, sigma_px: float = 0.5, score: float = 0.9
) -> tuple[Detections, IntArray]:
    """Noisy detections in shuffled order, and for each the row of `centres_px` it came from."""
    n = len(centres_px)
    order = rng.permutation(n)
    noise = rng.standard_normal((n, 3))
    centres = centres_px[order] + sigma_px * noise[:, :2]
    scores = np.minimum(np.abs(score + 0.05 * noise[:, 2]), 1.0)
    return Detections.from_points(centres, scores, np.full(n, BLUE, dtype=np.int64)), order


def labels_by_detection(percept: Percept, detections: Detections) -> dict[int, int]:
    """{row of the detection: beacon id} of the tracks that were seen in this frame."""
    seen = [track for track in percept.tracks if track.beacon_id is not None and track.missed == 0]
    if not seen:
        return {}
    centres = np.array([track.centre_px for track in seen])
    gap = ((centres[:, None] - detections.centre_px[None]) ** 2).sum(axis=2)
    return {
        row: track.beacon_id
        for row, track in zip(gap.argmin(axis=1).tolist(), seen, strict=True)
        if track.beacon_id is not None
    }
