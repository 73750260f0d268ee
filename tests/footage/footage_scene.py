"""An approach rendered by the package's own light model, as files that a person might have."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from auvdock.assets import asset
from auvdock.core.arrays import Array, Image
from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.optics.imaging import ImagingCfg, UnderwaterCamera
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import load_water

STATION = load_conical_station()
ARRAY_M = STATION.layout.array_positions_m
CAMERA = make_camera(CameraCfg(), np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
T_WORLD_STATION = make_transform(np.eye(3), np.array([0.0, 0.0, -STATION.depth_m]))


def camera_pose(range_m: float, roll_deg: float = 0.0, pitch_deg: float = 0.0) -> Array:
    """(4, 4) T_station_camera of a vehicle before the mouth; body angles: roll to starboard, pitch nose down."""
    rotation = rotation_from_euler_zyx(math.radians(roll_deg), math.radians(pitch_deg), math.pi)
    return make_transform(rotation, np.array([range_m, 0.2, -0.1])) @ CAMERA.T_body_camera


def approach(count: int, roll_deg: float = 0.0, pitch_deg: float = 0.0) -> list[Array]:
    return [camera_pose(6.0 - 0.02 * k, roll_deg, pitch_deg) for k in range(count)]


def images(poses: Sequence[Array], seed: int = 0) -> list[Image]:
    """Rendered frames of a pool, (H, W, 3) RGB; lights, haze and noise, no surfaces: no OpenGL is needed."""
    imaging = ImagingCfg(surfaces=False)
    setup = OpticalSetup(CAMERA, load_water("pool"), STATION.layout, T_WORLD_STATION, imaging, NuisanceCfg())
    imager = UnderwaterCamera(setup)
    imager.reset(np.random.default_rng(seed))
    to_body = np.linalg.inv(CAMERA.T_body_camera)
    taken = [imager.capture(T_WORLD_STATION @ T @ to_body, k / 30.0).image for k, T in enumerate(poses)]
    imager.close()
    return taken


def write_images(folder: Path, taken: Sequence[Image]) -> list[str]:
    """Write PNG files; numbers without leading zeros. Their names."""
    folder.mkdir()
    names = [f"shot{k + 1}.png" for k in range(len(taken))]
    for name, image in zip(names, taken, strict=True):
        assert cv2.imwrite(str(folder / name), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    return names


def write_settings(folder: Path) -> list[str]:
    """Write station and camera, and give the flags that name them."""
    station, camera = folder / "station.toml", folder / "camera.toml"
    station.write_text(asset("stations", "conical").read_text(encoding="utf-8"), encoding="utf-8")
    (fx, _, cx), (_, fy, cy), _ = CAMERA.matrix.tolist()
    camera.write_text(
        f"width_px = {CAMERA.width_px}\nheight_px = {CAMERA.height_px}\nrate_hz = 30.0\n"
        f"focal_px = [{fx}, {fy}]\nprincipal_point_px = [{cx}, {cy}]\ndistortion = {CAMERA.distortion.tolist()}\n",
        encoding="utf-8",
    )
    return ["--station", str(station), "--camera", str(camera)]
