"""A camera from a file: TOML of this package, or the `camera_info` YAML that ROS' calibration tools write."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.calibrated_camera import CalibratedCameraCfg, make_calibrated_camera
from auvdock.core.camera import Camera, CameraCfg, FrameRate, SidePx, make_camera
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.strict import from_mapping, read_toml
from auvdock.core.transforms import make_transform, rotation_looking_along

__all__ = ["Mount", "PixelCameraCfg", "read_camera"]

Mount = Literal["forward", "down"]
"""Where a camera looks in the vehicle: along the bow, image upright, or down with the bow at the image's upper edge."""
_LOOKING: dict[Mount, tuple[Array, Array]] = {
    "forward": (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])),
    "down": (np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])),
}
_PLUMB_BOB = ("plumb_bob", "rational_polynomial")
"""Names of OpenCV's polynomial in `camera_info`; of the second only what the first can say as well is taken."""


@dataclass(frozen=True)
class PixelCameraCfg(Checked):
    """A camera as OpenCV's calibration gives it, in pixels."""

    width_px: SidePx
    """Image width in pixels."""
    height_px: SidePx
    """Image height in pixels."""
    focal_px: tuple[float, float]
    """f over the pitch of the pixels along a row and along a column."""
    principal_point_px: tuple[float, float]
    """Column and row of the principal point; pixel centres have integer coordinates."""
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Brown–Conrady coefficients k1, k2, p1, p2, k3."""
    rate_hz: FrameRate = 25.0
    """Frames a second."""

    def __post_init__(self) -> None:
        """Refuse what no camera can be."""
        if min(self.focal_px) <= 0.0:
            raise ConfigError("focal_px", self.focal_px, "two positive lengths in pixels")
        column, row = self.principal_point_px
        if not (0.0 <= column < self.width_px and 0.0 <= row < self.height_px):
            raise ConfigError("principal_point_px", self.principal_point_px, "a point on the sensor")


def read_camera(path: Path, mount: Mount, rate_hz: float | None = None) -> Camera:
    """The camera of a file, in the middle of the vehicle.

    TOML holds the fields of `PixelCameraCfg`, of `CameraCfg` (known by `horizontal_fov_deg`) or of
    `CalibratedCameraCfg` (known by `focal_length_m`); .yaml or .yml is ROS' `sensor_msgs/CameraInfo` as its
    calibration tools write it.

    Args:
        path: the file.
        mount: where the camera looks.
        rate_hz: frames a second in place of the file's.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    direction, up = _LOOKING[mount]
    with located("camera."):
        if path.suffix in (".yaml", ".yml"):
            cfg = _of_ros(path)
        else:
            table = read_toml(path)
            kinds = ((CameraCfg, "horizontal_fov_deg"), (CalibratedCameraCfg, "focal_length_m"))
            kind = next((kind for kind, mark in kinds if mark in table), PixelCameraCfg)
            if kind is PixelCameraCfg:
                _demand_all(table, path)
            cfg = from_mapping(kind, table)
        if rate_hz is not None:
            cfg = replace(cfg, rate_hz=rate_hz)
        if isinstance(cfg, CameraCfg):
            return make_camera(cfg, np.zeros(3), direction, up)
        if isinstance(cfg, CalibratedCameraCfg):
            return make_calibrated_camera(cfg, np.zeros(3), direction, up)
        return _make(cfg, direction, up)


def _make(cfg: PixelCameraCfg, direction: Array, up: Array) -> Camera:
    (fx, fy), (column, row) = cfg.focal_px, cfg.principal_point_px
    matrix = np.array([[fx, 0.0, column], [0.0, fy, row], [0.0, 0.0, 1.0]])
    T_body_camera = make_transform(rotation_looking_along(direction, up), np.zeros(3))
    return Camera(cfg.width_px, cfg.height_px, matrix, np.array(cfg.distortion), T_body_camera, cfg.rate_hz)


def _demand_all(table: Mapping[str, Any], path: Path) -> None:
    missing = [name for name in ("width_px", "height_px", "focal_px", "principal_point_px") if name not in table]
    if missing:
        known = ", ".join(field.name for field in fields(PixelCameraCfg))
        raise ConfigError("file", str(path), f"a camera with {known} ({', '.join(missing)} missing)")


def _of_ros(path: Path) -> PixelCameraCfg:
    """`camera_info` YAML: image_width, image_height, camera_matrix, distortion_model, distortion_coefficients."""
    import yaml  # for this alone

    try:
        said = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        why = " ".join(str(error).split())
        raise ConfigError("file", str(path), f"a readable camera_info YAML file ({why})") from error
    if not isinstance(said, Mapping):
        raise ConfigError("file", str(path), "a camera_info YAML file as ROS' calibration tools write it")
    table = cast(Mapping[str, Any], said)
    model = table.get("distortion_model", "plumb_bob")
    if model not in _PLUMB_BOB:
        raise ConfigError("distortion_model", model, "plumb_bob, OpenCV's k1, k2, p1, p2, k3")
    matrix = _numbers(table, "camera_matrix", 9)
    lens = _numbers(table, "distortion_coefficients", None)
    if len(lens) not in (0, 4, 5, 8) or any(lens[5:]):
        raise ConfigError("distortion_coefficients", lens, "k1, k2, p1, p2, k3")
    return from_mapping(
        PixelCameraCfg,
        {
            "width_px": table.get("image_width"),
            "height_px": table.get("image_height"),
            "focal_px": [matrix[0], matrix[4]],
            "principal_point_px": [matrix[2], matrix[5]],
            "distortion": (lens[:5] + [0.0] * 5)[:5],
        },
    )


def _numbers(table: Mapping[str, Any], key: str, count: int | None) -> list[float]:
    """`data` of one of the file's matrices."""
    inner: Any = table.get(key)
    data: Any = cast(Mapping[str, Any], inner).get("data") if isinstance(inner, Mapping) else None
    numbers = cast(list[Any], data) if isinstance(data, list) else None
    finite = numbers is not None and all(isinstance(n, int | float) and math.isfinite(n) for n in numbers)
    if numbers is None or not finite or (count is not None and len(numbers) != count):
        raise ConfigError(key, data, f"{count or 'some'} numbers under `data`")
    return [float(number) for number in numbers]
