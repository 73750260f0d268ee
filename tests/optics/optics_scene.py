"""A small scene for the optics tests: one camera, lamps, no simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconCfg, BeaconLayout, ring_layout
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import make_transform
from auvdock.optics.imaging import ExposureCfg, ImagingCfg, UnderwaterCamera
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import WaterCfg, load_water
from auvdock.sim.mj import mujoco

DEPTH_M = 8.0
T_WORLD_STATION = make_transform(np.eye(3), np.array([0.0, 0.0, -DEPTH_M]))
QUIET = ImagingCfg(noise=False, surfaces=False)


@dataclass
class Scene:
    """Owner of a model, as the simulator is."""

    model: Any


def camera(width_px: int = 640, height_px: int = 360) -> Camera:
    cfg = CameraCfg(width_px=width_px, height_px=height_px)
    return make_camera(cfg, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def pose(x: float, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Array:
    """Body pose in the world: at (x, y, z) of the station frame, looking at it, turned by yaw."""
    c, s = math.cos(math.pi + yaw), math.sin(math.pi + yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return make_transform(rotation, np.array([x, y, z - DEPTH_M]))


def station_layout() -> BeaconLayout:
    return load_conical_station().layout


def far_ring() -> tuple[BeaconCfg, ...]:
    """An array that a layout must have, far behind the camera."""
    return tuple(
        BeaconCfg(f"B{k}", "array", (900.0, float(k), 0.0), (1.0, 0.0, 0.0), 450.0, 1e-9, 0.35, 45.0) for k in range(4)
    )


def one_lamp(wavelength_nm: float = 450.0, power_w: float = 10.0, beam_angle_deg: float = 60.0) -> BeaconLayout:
    lamp = BeaconCfg(
        "lamp", "long_range", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), wavelength_nm, power_w, 0.35, beam_angle_deg
    )
    return BeaconLayout((*far_ring(), lamp))


def imager(
    layout: BeaconLayout | None = None,
    water: WaterCfg | None = None,
    cfg: ImagingCfg = QUIET,
    nuisance: NuisanceCfg | None = None,
    scene: Scene | None = None,
    width_px: int = 640,
    height_px: int = 360,
) -> UnderwaterCamera:
    seen_by, seen = camera(width_px, height_px), layout or station_layout()
    setup = OpticalSetup(seen_by, water or load_water("clear"), seen, T_WORLD_STATION, cfg, nuisance or NuisanceCfg())
    return UnderwaterCamera(setup, scene)


def fixed_exposure(
    time_s: float, *, noise: bool = False, surfaces: bool = False, lamp_spill: float = 0.1
) -> ImagingCfg:
    exposure = ExposureCfg(automatic=False, initial_s=time_s, max_s=max(time_s, 0.016))
    return ImagingCfg(exposure=exposure, noise=noise, surfaces=surfaces, lamp_spill=lamp_spill)


def wall_scene(distance_m: float) -> Scene:
    """A white wall across the view at x = 0 of the station frame for a camera at x = distance."""
    model = mujoco.MjModel.from_xml_string(f"""
      <mujoco><worldbody>
        <geom type="box" size="0.05 70 70" pos="{-0.05} 0 {-DEPTH_M}" rgba="1 1 1 1"/>
        <body pos="{distance_m} 0 {-DEPTH_M}"><freejoint/><geom type="sphere" size="0.3" rgba="1 0 0 1"/></body>
      </worldbody></mujoco>""")
    return Scene(model)


def ring() -> BeaconLayout:
    return BeaconLayout(ring_layout(6, 1.0))
