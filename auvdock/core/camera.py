"""Camera models: pinhole with Brown–Conrady distortion, as OpenCV's."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import cv2
import numpy as np

from auvdock.core.arrays import Array, BoolArray, check_shape
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import above, at_most, between
from auvdock.core.transforms import make_transform, rotation_looking_along

__all__ = ["Camera", "CameraCfg", "FieldOfView", "FrameRate", "SidePx", "make_camera"]

_MOST_PX = 8192
"""Along one side: a frame of as many either way takes 0.8 GB while it is rendered."""


SidePx = Annotated[int, between(16, _MOST_PX)]
"""Pixels along one side of an image: enough to show anything, not too many to render."""
FrameRate = Annotated[float, above(0.0), at_most(1000.0)]
"""Frames a second."""
FieldOfView = Annotated[float, between(1.0, 150.0)]
"""Full angle that a camera sees, degrees."""


@dataclass(frozen=True)
class CameraCfg(Checked):
    """A camera as its data sheet gives it."""

    width_px: SidePx = 640
    """Image width in pixels."""
    height_px: SidePx = 360
    """Image height in pixels."""
    rate_hz: FrameRate = 30.0
    """Frames a second; must divide the physics rate."""
    horizontal_fov_deg: FieldOfView = 85.0
    """Full horizontal field of view in water (paper B: 85)."""
    vertical_fov_deg: FieldOfView = 50.0
    """Full vertical field of view in water (paper B: 50)."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera ready for use: intrinsics, distortion and mounting.

    Attributes:
        width_px: image width.
        height_px: image height.
        matrix: (3, 3) intrinsic matrix K in pixels; pixel centres have integer coordinates.
        distortion: (5,) Brown–Conrady coefficients k1, k2, p1, p2, k3.
        T_body_camera: (4, 4) pose of the camera frame (x right, y down, z forward) in the body frame.
        rate_hz: frames a second.
    """

    width_px: int
    height_px: int
    matrix: Array
    distortion: Array
    T_body_camera: Array
    rate_hz: float

    def __post_init__(self) -> None:
        """Check shapes."""
        check_shape("matrix", self.matrix, (3, 3))
        check_shape("distortion", self.distortion, (5,))
        check_shape("T_body_camera", self.T_body_camera, (4, 4))

    def project(self, points_camera: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) in the camera frame, metres; points must have z > 0 to mean anything."""
        x, y = points_camera[:, 0] / points_camera[:, 2], points_camera[:, 1] / points_camera[:, 2]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.column_stack([xd * self.matrix[0, 0] + self.matrix[0, 2], yd * self.matrix[1, 1] + self.matrix[1, 2]])

    def in_view(self, points_camera: Array) -> BoolArray:
        """(n,) whether points (n, 3) in the camera frame fall on the sensor.

        The field of view is tested on the undistorted angles as well: far outside it a polynomial distortion folds
        back into the image.
        """
        visible = points_camera[:, 2] > 1e-6
        pixels = self.project(np.where(visible[:, None], points_camera, np.array([0.0, 0.0, 1.0])))
        limit = self._max_tangent
        tangent = np.hypot(points_camera[:, 0], points_camera[:, 1]) <= limit * points_camera[:, 2]
        return (
            visible
            & tangent
            & (pixels[:, 0] >= -0.5)
            & (pixels[:, 0] < self.width_px - 0.5)
            & (pixels[:, 1] >= -0.5)
            & (pixels[:, 1] < self.height_px - 0.5)
        )

    @cached_property
    def _max_tangent(self) -> float:
        right, bottom = self.width_px - 0.5, self.height_px - 0.5
        corner = self.normalise(np.array([[-0.5, -0.5], [right, bottom], [right, -0.5], [-0.5, bottom]]))
        return float(np.max(np.hypot(corner[:, 0], corner[:, 1])))

    def normalise(self, pixels: Array) -> Array:
        """Undistorted normalised image coordinates (n, 2) of pixels (n, 2): x/z and y/z of the ray."""
        if len(pixels) == 0:
            return np.zeros((0, 2))
        points = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
        accuracy = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-12)
        undistorted = cv2.undistortPoints(points, self.matrix, self.distortion, criteria=accuracy)
        return np.asarray(undistorted, dtype=np.float64).reshape(-1, 2)

    def rays(self, pixels: Array) -> Array:
        """Unit rays (n, 3) in the camera frame through pixels (n, 2)."""
        xy = self.normalise(pixels)
        rays = np.column_stack([xy, np.ones(len(xy))])
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def make_camera(cfg: CameraCfg, position_body_m: Array, direction_body: Array, up_body: Array) -> Camera:
    """A camera with square pixels whose two fields of view are both as published.

    One focal length f and one radial coefficient k1 satisfy W/2 = f t_h (1 + k1 t_h²) and H/2 = f t_v (1 + k1 t_v²)
    with t = tan(FOV/2): the lens distortion follows from the two published angles. For 85° × 50° at 16:9 this gives a
    barrel distortion k1 = -0.148.

    Raises:
        ConfigError: the two angles need a distortion that folds the image.
    """
    t_h = math.tan(math.radians(cfg.horizontal_fov_deg) / 2)
    t_v = math.tan(math.radians(cfg.vertical_fov_deg) / 2)
    ratio = (cfg.width_px / cfg.height_px) * (t_v / t_h)
    denominator = t_h**2 - ratio * t_v**2
    k1 = (ratio - 1.0) / denominator if abs(denominator) > 1e-12 else 0.0
    corner = t_h**2 + t_v**2
    if abs(k1) * corner > 0.3:
        raise ConfigError(
            "vertical_fov_deg",
            cfg.vertical_fov_deg,
            f"an angle that suits {cfg.horizontal_fov_deg:g}° on {cfg.width_px} × {cfg.height_px} px, near "
            f"{2 * math.degrees(math.atan(t_h * cfg.height_px / cfg.width_px)):.0f}°",
        )
    focal_px = cfg.width_px / 2 / (t_h * (1.0 + k1 * t_h**2))
    matrix = np.array(
        [
            [focal_px, 0.0, (cfg.width_px - 1) / 2],
            [0.0, focal_px, (cfg.height_px - 1) / 2],
            [0.0, 0.0, 1.0],
        ]
    )
    T_body_camera = make_transform(rotation_looking_along(direction_body, up_body), position_body_m)
    distortion = np.array([k1, 0.0, 0.0, 0.0, 0.0])
    return Camera(cfg.width_px, cfg.height_px, matrix, distortion, T_body_camera, cfg.rate_hz)
