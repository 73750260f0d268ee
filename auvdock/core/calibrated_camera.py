"""A camera from its calibration: metric focal length, pixels, principal point, distortion on the sensor.

The landing paper (paper C, section 4.1.2) gives its camera so. Its equation for the distortion takes *distorted*
coordinates (ū_d, v̄_d) on the sensor, measured from the principal point, and gives the correction that leads to the
ideal point of a pinhole:

    D_u = ū_d (k1 r_d² + k2 r_d⁴ + k3 r_d⁶) + 2 p1 ū_d v̄_d + p2 (r_d² + 2 ū_d²)
    D_v = v̄_d (k1 r_d² + k2 r_d⁴ + k3 r_d⁶) + p1 (r_d² + 2 v̄_d²) + 2 p2 ū_d v̄_d

in metres, so the coefficients carry units of 1/m², 1/m⁴, 1/m⁶ and 1/m. OpenCV's model runs the other way, from ideal
to distorted. `fit_opencv_distortion` re-expresses one by the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera, FrameRate, SidePx
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive
from auvdock.core.transforms import make_transform, rotation_looking_along

__all__ = ["CalibratedCameraCfg", "fit_opencv_distortion", "ideal_coordinates", "make_calibrated_camera"]


@dataclass(frozen=True)
class CalibratedCameraCfg(Checked):
    """A camera as its calibration gives it; the defaults are the downward camera of paper C (tables 3, section 4.1.2).

    The published text has lost its minus signs. Those of k1, k2, k3 are ours, by reasoning: a flat port makes a ray
    of slope t in water (n = 1.33) strike the lens with slope n t / √(1 - (n² - 1) t²), whose inverse in scaled
    coordinates is s / √(1 + (n² - 1) s²) with a leading coefficient of -(n² - 1) / 2 = -0.38; the published |k1| f²
    is 0.358. Of the eight sign patterns only (-, -, +) follows that curve to 1.5 px rms over the sensor; (-, +, +)
    comes next with 2.1 px, all others are off by 7 px to 86 px. All eight are monotonic over the sensor, so folding
    decides nothing. Nothing decides the signs of p1 and p2: they stand as printed and move a corner by less than 3 px.
    """

    width_px: SidePx = 800
    """Image width in pixels."""
    height_px: SidePx = 600
    """Image height in pixels."""
    rate_hz: FrameRate = 20.0
    """Frames a second; must divide the physics rate."""
    focal_length_m: Positive = 7.109e-3
    """Focal length in water (paper C: 7.109 mm)."""
    pixel_width_m: Positive = 8.29e-6
    """Pitch of the pixels along a row (paper C, table 3)."""
    pixel_height_m: Positive = 8.30e-6
    """Pitch of the pixels along a column (paper C, table 3)."""
    principal_point_px: tuple[float, float] = (417.582, 285.199)
    """Column and row of the principal point; pixel centres have integer coordinates."""
    radial: tuple[float, float, float] = (-7093.46, -3.96219e6, 3.88195e12)
    """k1 in 1/m², k2 in 1/m⁴, k3 in 1/m⁶, from distorted to ideal coordinates on the sensor."""
    tangential: tuple[float, float] = (0.0249934, 0.374426)
    """p1 and p2 in 1/m."""

    def __post_init__(self) -> None:
        """Refuse what no camera can be."""
        for side_px, pitch_m in ((self.width_px, self.pixel_width_m), (self.height_px, self.pixel_height_m)):
            seen_deg = math.degrees(2.0 * math.atan2(0.5 * side_px * pitch_m, self.focal_length_m))
            if not 1.0 <= seen_deg <= 150.0:
                remedy = "a length with which the sensor sees 1 to 150 degrees either way"
                raise ConfigError("focal_length_m", self.focal_length_m, f"{remedy} ({seen_deg:.3g} with this)")
        column, row = self.principal_point_px
        if not (0.0 <= column < self.width_px and 0.0 <= row < self.height_px):
            raise ConfigError("principal_point_px", self.principal_point_px, "a point on the sensor")
        if not _is_monotonic(self):
            raise ConfigError("radial", self.radial, "a distortion that does not fold the image on the sensor")

    @property
    def sensor_width_m(self) -> float:
        """Width of the sensor."""
        return self.width_px * self.pixel_width_m

    @property
    def matrix(self) -> Array:
        """(3, 3) intrinsic matrix K in pixels: f over the pitch."""
        column, row = self.principal_point_px
        fx, fy = self.focal_length_m / self.pixel_width_m, self.focal_length_m / self.pixel_height_m
        return np.array([[fx, 0.0, column], [0.0, fy, row], [0.0, 0.0, 1.0]])


def ideal_coordinates(cfg: CalibratedCameraCfg, pixels: Array) -> Array:
    """Ideal normalised coordinates (n, 2), x/z and y/z, of pixels (n, 2) by the calibration's own polynomial."""
    u = (pixels[:, 0] - cfg.principal_point_px[0]) * cfg.pixel_width_m
    v = (pixels[:, 1] - cfg.principal_point_px[1]) * cfg.pixel_height_m
    k1, k2, k3 = cfg.radial
    p1, p2 = cfg.tangential
    r2 = u * u + v * v
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    x = u * radial + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u)
    y = v * radial + p1 * (r2 + 2.0 * v * v) + 2.0 * p2 * u * v
    return np.column_stack([x, y]) / cfg.focal_length_m


def fit_opencv_distortion(cfg: CalibratedCameraCfg) -> Array:
    """(5,) OpenCV's k1, k2, p1, p2, k3 whose projection is nearest to the calibration's polynomial over the sensor.

    Linear least squares of the distance in pixels on a grid that covers the sensor to its edges. For paper C's camera
    the two agree to 0.1 px rms, 0.25 px over 99 % of the sensor and 0.8 px in the outermost corner.
    """
    columns = np.linspace(-0.5, cfg.width_px - 0.5, 81)
    rows = np.linspace(-0.5, cfg.height_px - 0.5, 61)
    pixels = np.stack(np.meshgrid(columns, rows), axis=2).reshape(-1, 2)
    x, y = ideal_coordinates(cfg, pixels).T
    fx, fy = cfg.matrix[0, 0], cfg.matrix[1, 1]
    r2 = x * x + y * y
    across = np.column_stack([x * r2, x * r2**2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2**3]) * fx
    down = np.column_stack([y * r2, y * r2**2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2**3]) * fy
    wanted = pixels - np.array(cfg.principal_point_px) - np.column_stack([x * fx, y * fy])
    solution = np.linalg.lstsq(np.concatenate([across, down]), np.concatenate([wanted[:, 0], wanted[:, 1]]), rcond=None)
    return np.asarray(solution[0], dtype=np.float64)


def make_calibrated_camera(
    cfg: CalibratedCameraCfg, position_body_m: Array, direction_body: Array, up_body: Array
) -> Camera:
    """The camera with OpenCV's distortion, mounted at a place (3,) looking along a direction (3,), both in the body.

    Raises:
        ConfigError: OpenCV's polynomial, fitted to this distortion, folds the image.
    """
    distortion = fit_opencv_distortion(cfg)
    corners = np.array([(c, r) for c in (-0.5, cfg.width_px - 0.5) for r in (-0.5, cfg.height_px - 0.5)])
    reach = float(np.max(np.hypot(*ideal_coordinates(cfg, corners).T)))
    if not _rises(tuple(distortion[[0, 1, 4]]), reach):
        raise ConfigError("radial", cfg.radial, "a milder distortion, OpenCV's model folds the image with this")
    T_body_camera = make_transform(rotation_looking_along(direction_body, up_body), position_body_m)
    return Camera(cfg.width_px, cfg.height_px, cfg.matrix, distortion, T_body_camera, cfg.rate_hz)


def _is_monotonic(cfg: CalibratedCameraCfg) -> bool:
    column, row = cfg.principal_point_px
    across = max(column, cfg.width_px - column) * cfg.pixel_width_m
    down = max(row, cfg.height_px - row) * cfg.pixel_height_m
    return _rises(cfg.radial, math.hypot(across, down))


def _rises(radial: tuple[float, ...], reach: float) -> bool:
    """Whether r (1 + k1 r² + k2 r⁴ + k3 r⁶) rises with r all the way to `reach`."""
    k1, k2, k3 = radial
    r2 = np.linspace(0.0, reach, 200) ** 2
    return bool(np.all(1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3)) > 0.0))
