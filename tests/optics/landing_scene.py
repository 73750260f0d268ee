"""A small landing scene for the optics tests: platform, floor, belly camera, no simulator."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from optics_scene import Scene

from auvdock.core.arrays import Array
from auvdock.core.calibrated_camera import CalibratedCameraCfg, make_calibrated_camera
from auvdock.core.camera import Camera
from auvdock.core.landing_station import LandingStationCfg, load_landing_station
from auvdock.core.transforms import make_transform, rotation_from_euler_zyx
from auvdock.optics.faults import FaultCfg
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.lamp import LampCfg
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.settings import ExposureCfg, ImagingCfg
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import WaterCfg, load_water
from auvdock.sim.mj import mujoco

STATION = load_landing_station()
T_WORLD_STATION = make_transform(np.eye(3), np.array([0.0, 0.0, -STATION.depth_m]))
QUIET = dataclasses.replace(landing_imaging(), noise=False)


def belly_camera() -> Camera:
    """The camera in the body's origin, looking down, image up forward."""
    return make_calibrated_camera(
        CalibratedCameraCfg(), np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
    )


def above(
    height_m: float, x: float = 0.0, y: float = 0.0, yaw_deg: float = 0.0, roll_deg: float = 0.0, pitch_deg: float = 0.0
) -> Array:
    """Body pose in the world at a place of the station frame."""
    rotation = rotation_from_euler_zyx(*(math.radians(a) for a in (roll_deg, pitch_deg, yaw_deg)))
    return make_transform(rotation, np.array([x, y, height_m - STATION.depth_m]))


def fixed(time_s: float, *, noise: bool = False, surfaces: bool = False) -> ImagingCfg:
    exposure = ExposureCfg(automatic=False, initial_s=time_s, max_s=max(time_s, 0.02))
    return dataclasses.replace(landing_imaging(), noise=noise, surfaces=surfaces, exposure=exposure)


def platform_scene(station: LandingStationCfg = STATION) -> Scene:
    """Platform, two V guides and a floor."""
    z, h = -station.depth_m, station.height_m
    guides: list[str] = []
    guide = station.guide
    for k, x in enumerate(guide.x_m):
        for side in (-1.0, 1.0):
            guides.append(
                f'<geom type="box" size="{guide.thickness_m / 2} 0.01 0.18" pos="{x} {side * 0.16} {z + 0.3}" '
                f'euler="{-side * 45} 0 0" rgba="0.55 0.57 0.55 1" name="guide{k}{int(side)}"/>'
            )
    tag = f'<geom name="tag" type="box" size="0.125 0.125 0.001" pos="0 0 {z}" rgba="1 0 0 1"/>'
    model: Any = mujoco.MjModel.from_xml_string(f"""
      <mujoco><worldbody>
        <geom type="box" size="{station.length_m / 2} {station.width_m / 2} {h / 2}" pos="0 0 {z - h / 2}"
          rgba="0.55 0.57 0.55 1"/>
        <geom type="plane" size="60 60 1" pos="0 0 {z - h}" rgba="0.45 0.42 0.34 1"/>
        {"".join(guides)}{tag}
      </worldbody></mujoco>""")
    return Scene(model)


def landing_setup(
    imaging: ImagingCfg = QUIET,
    water: WaterCfg | str = "clear",
    lamp: LampCfg | None = None,
    faults: FaultCfg | None = None,
    nuisance: NuisanceCfg | None = None,
    station: LandingStationCfg = STATION,
) -> OpticalSetup:
    return OpticalSetup(
        belly_camera(),
        load_water(water),
        station.layout,
        T_WORLD_STATION,
        imaging,
        nuisance or NuisanceCfg(),
        lamp=lamp,
        tag=station.tag,
        faults=faults or FaultCfg(),
        seen_from="above",
    )


def landing_camera(
    imaging: ImagingCfg = QUIET,
    water: WaterCfg | str = "clear",
    lamp: LampCfg | None = None,
    faults: FaultCfg | None = None,
    nuisance: NuisanceCfg | None = None,
    scene: Scene | None = None,
    station: LandingStationCfg = STATION,
) -> UnderwaterCamera:
    return UnderwaterCamera(landing_setup(imaging, water, lamp, faults, nuisance, station), scene)
