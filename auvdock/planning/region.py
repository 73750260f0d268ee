"""The precise-guidance space of a station: where at least four of its array's lights can be found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, between
from auvdock.optics.detection_model import load_detection_model
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import water_of
from auvdock.planning.detectability import Detectability
from auvdock.planning.sight import Sight
from auvdock.planning.voxels import VoxelRegion, fill_region

__all__ = ["GuidanceSpace", "PlanCfg", "forward_camera", "guidance_space", "make_detectability"]

_DIRECTIONS = 160
_RANGES_M = np.geomspace(0.4, 90.0, 36)
_NEAREST_M = 0.02
_CAP_DIRECTIONS = 1500


@dataclass(frozen=True)
class PlanCfg(Checked):
    """What the region depends on besides the station."""

    water: str = "pool"
    """Water preset."""
    attenuation_per_m: float | None = None
    """Beam attenuation at 450 nm in 1/m in place of the preset's."""
    camera: CameraCfg = CameraCfg()
    imaging: ImagingCfg = ImagingCfg()
    min_lights: Count = 4
    """Array lights that must be found; PnP needs 4."""
    resolution: Annotated[int, between(16, 400)] = 56
    """Voxels along the longest side of the region's bounding box."""


@dataclass(frozen=True, eq=False)
class GuidanceSpace:
    """The region and its measures.

    Attributes:
        region: voxels in the station frame; None if no place was found from which enough lights can be seen.
        volume_m3: its volume.
        error_m3: the volume's discretisation error, estimated from voxels of twice the side.
        near_m: least distance from the mouth along the approach axis.
        range_m: greatest distance from the mouth along the approach axis.
        half_angle_deg: half angle of the cone about the approach axis with the solid angle in which, at half of the
            range, enough lights are found.
        power_w: electrical power of the array.
    """

    region: VoxelRegion | None
    volume_m3: float
    error_m3: float
    near_m: float
    range_m: float
    half_angle_deg: float
    power_w: float


def forward_camera(cfg: CameraCfg) -> Camera:
    """The camera by itself, looking along +x of its own frame: the planner turns it towards the station."""
    return make_camera(cfg, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def make_detectability(layout: BeaconLayout, cfg: PlanCfg) -> Detectability:
    """Camera, water and detector for a layout.

    Raises:
        ConfigError: an unknown water, or more lights wanted than the layout has.
    """
    water = water_of(cfg.water, cfg.attenuation_per_m)
    count = len(layout.indices("array"))
    if cfg.min_lights > count:
        raise ConfigError("min_lights", cfg.min_lights, f"at most {count}, the array's number of lights")
    sight = Sight(forward_camera(cfg.camera), water, layout, cfg.imaging)
    return Detectability(sight, load_detection_model("threshold"))


def guidance_space(layout: BeaconLayout, cfg: PlanCfg, detectability: Detectability | None = None) -> GuidanceSpace:
    """The region in front of the mouth's plane from which at least `min_lights` array lights are found.

    Neither surface nor floor cuts it: it belongs to the lights and the water.

    Args:
        layout: all lights; those that are not the array's matter for exposure and as rivals.
        cfg: water, camera and resolution.
        detectability: in place of the one that `cfg` describes.
    """
    sees = detectability or make_detectability(layout, cfg)
    power = sum(beacon.power_w for beacon in layout.beacons if beacon.role == "array")
    mouth_x = float(layout.array_positions_m[:, 0].max())

    def predicate(points_m: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        return sees.seen(points_m, cfg.min_lights)

    bounds = _bounds(sees, mouth_x, cfg.min_lights)
    if bounds is None:
        return GuidanceSpace(None, 0.0, 0.0, 0.0, 0.0, 0.0, power)
    low, high = bounds
    voxel_m = float(np.max(high - low)) / cfg.resolution
    region = fill_region(predicate, low, high, voxel_m)
    axis = np.zeros((400, 3))
    axis[:, 0] = np.linspace(low[0] + _NEAREST_M, high[0], 400)
    axis[:, 1:] = sees.sight.target_m[1:]
    along = axis[predicate(axis), 0] - mouth_x
    near, far = (float(along.min()), float(along.max())) if len(along) else (0.0, 0.0)
    reach = 0.5 * (far if far > 0.0 else float(high[0]) - mouth_x)
    cap = _hemisphere(_CAP_DIRECTIONS)
    share = float(np.mean(predicate(sees.sight.target_m + reach * cap)))
    half_angle = math.degrees(math.acos(1.0 - share))
    return GuidanceSpace(region, region.volume_m3, region.discretisation_error_m3, near, far, half_angle, power)


def _bounds(sees: Detectability, mouth_x: float, needed: int) -> tuple[Array, Array] | None:
    """A box that holds the region, from rays in all forward directions; None if none of them meets it."""
    directions = _hemisphere(_DIRECTIONS)
    rays = (directions[None] * _RANGES_M[:, None, None]).reshape(-1, 3) + sees.sight.target_m
    hit = rays[sees.seen(rays, needed)]
    if len(hit) == 0:
        return None
    step = float(_RANGES_M[1] / _RANGES_M[0]) - 1.0
    # One step of range and one of direction beyond what was hit.
    reach = np.linalg.norm(hit - sees.sight.target_m, axis=1)
    margin = reach * (step + math.sqrt(2.0 * math.pi / _DIRECTIONS) * 0.5)
    low, high = (hit - margin[:, None]).min(axis=0), (hit + margin[:, None]).max(axis=0)
    low[0] = mouth_x
    high[0] = mouth_x + float(reach.max()) * (1.0 + step)
    return low, high


def _hemisphere(count: int) -> Array:
    """(count, 3) directions spread evenly over x > 0 (Fibonacci lattice), the same solid angle to each."""
    index = np.arange(count) + 0.5
    x = 1.0 - index / count
    phi = index * math.pi * (3.0 - math.sqrt(5.0))
    side = np.sqrt(1.0 - x**2)
    return np.column_stack([x, side * np.cos(phi), side * np.sin(phi)])
