"""What each lamp sends into a camera and where on the sensor it falls, compiled: the first half of light's way.

Nuisances change what arrives (`optics.view`). In the second half it spreads over the sensor (`optics.spread`), and the
lights meet (`optics.meeting`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.lens import CX, CY, FX, FY, K1, K2, K3, pixel_of, radial_factor
from auvdock.numeric.records import Record, Records

__all__ = [
    "Arrival",
    "HaloPlaces",
    "Lamp",
    "Projection",
    "Rim",
    "arrive",
    "arrive_everywhere",
    "locate",
    "place_in_halo",
]

_NEAREST_M2 = 1e-4


@dataclass(frozen=True)
class Lamp(Record):
    """A lamp in one water, in the station frame."""

    place_m: Annotated[Array, 3]
    axis: Annotated[Array, 3]
    """Unit direction of the beam."""
    minus_profile: float
    """-ln 2 / θ_h² in 1/rad²: factor of θ² in the exponent of the beam's profile (`light.beam_profile`)."""
    absorption_per_m: float
    """a at the lamp's wavelength."""
    scattering_per_m: float
    """b at the lamp's wavelength."""
    peak_w_sr: float
    """Radiant intensity on the axis."""
    flux_w: float
    """Radiant flux."""
    electrons_per_j: Annotated[Array, 3]
    """Photo-electrons of the red, green and blue channel per joule of this light on a pixel."""
    halo_row: int
    """First row of its wavelength in the water's halo (`optics.halo`)."""
    recessed: bool
    """It sits inside the funnel and is seen through the mouth only."""


@dataclass(frozen=True)
class HaloPlaces(Record):
    """Where in a block of the halo's table a scattering depth is; rows are even in ln(1 + b r / bend)."""

    bend: float
    """b r beyond which the rows are even in its logarithm, below which in b r itself."""
    per_log: float
    """Rows per unit of that logarithm."""
    last: float
    """Last row; beyond it is held."""


@dataclass(frozen=True)
class Rim(Record):
    """The funnel's rim: a circle across the x axis of the station frame."""

    x_m: float
    y_m: float
    z_m: float
    """Of its centre."""
    radius2_m2: float


@dataclass(frozen=True)
class Projection(Record):
    """Where on the sensor a ray falls, and which rays fall on it (`lens.Lens`)."""

    brown: Annotated[Array, 9]
    """Focal lengths, principal point and distortion: `numeric.lens`."""
    tangential: bool
    """The distortion has tangential terms."""
    max_tangent2: float
    """Squared tangent to the optical axis beyond which the distortion polynomial folds back."""
    middle_px: Annotated[Array, 2]
    """Middle of the image."""
    reach_px: Annotated[Array, 2]
    """Offset from there within which a pixel counts as on the sensor."""


@dataclass
class Arrival(Record):
    """The light of one lamp at the camera; nuisances change it in place."""

    ray_camera: Annotated[Array, 3]
    """Unit direction to the lamp in the camera frame."""
    range_m: float
    scattering_depth: float
    """b r."""
    core_w_m2: float
    """Irradiance of the unscattered light, normal to the ray: I f(θ) e^{-(a+b) r} / r²."""
    halo_w_m2: float
    """Irradiance of the scattered light within 90°: I f(θ) e^{-a r} (1 - e^{-b r}) w / r², w `HaloTable.whole`."""
    halo_row: int
    """Row of the halo's table below its b r."""
    halo_weight: float
    """Weight of the row above."""
    pixel: Annotated[Array, 2]
    """Position on the sensor; means something where `inside` or near it."""
    inside: bool
    """The lamp's centre falls on the sensor."""


_ARRIVAL = Arrival.dtype()


@compiled
def arrive(
    T_station_camera: Array,
    lamps: Records[Lamp],
    rim: Records[Rim],
    projection: Records[Projection],
    places: Records[HaloPlaces],
    whole: Array,
) -> Records[Arrival]:
    """The light of lamps (n,) at a camera pose (4, 4).

    Args:
        T_station_camera: the pose.
        lamps: (n,).
        rim: one row.
        projection: one row.
        places: one row, of the halo's table.
        whole: (h,) all of the halo over 1 - e^{-b r}, by the table's rows.
    """
    arrivals: Records[Arrival] = np.empty(len(lamps), dtype=_ARRIVAL)  # type: ignore[assignment]  # of records
    _fill(arrivals, T_station_camera, lamps, rim[0], projection[0], places[0], whole)
    return arrivals


@compiled
def arrive_everywhere(
    T_station_camera: Array,
    lamps: Records[Lamp],
    rim: Records[Rim],
    projection: Records[Projection],
    places: Records[HaloPlaces],
    whole: Array,
) -> Records[Arrival]:
    """(m n,) the light of lamps (n,) at camera poses (m, 4, 4), pose by pose: `arrive` for planners."""
    count = len(lamps)
    arrivals: Records[Arrival] = np.empty(len(T_station_camera) * count, dtype=_ARRIVAL)  # type: ignore[assignment]  # of records
    for k in range(len(T_station_camera)):
        one = arrivals[k * count : (k + 1) * count]
        _fill(one, T_station_camera[k], lamps, rim[0], projection[0], places[0], whole)
    return arrivals


@compiled
def place_in_halo(br: Array, places: Records[HaloPlaces]) -> tuple[IntArray, Array]:
    """Row (n,) of a block of the halo's table below each b r (n,) and the weight (n,) of the row above."""
    row, weight = np.empty(len(br), dtype=np.int64), np.empty(len(br))
    for i in range(len(br)):
        row[i], weight[i] = _place(br[i], places[0])
    return row, weight


@compiled
def locate(rays: Array, projection: Records[Projection]) -> tuple[Array, BoolArray]:
    """Pixels (n, 2) of rays (n, 3) in the camera frame, and whether each lies on the sensor (n,)."""
    pixels, inside = np.empty((len(rays), 2)), np.empty(len(rays), dtype=np.bool_)
    for i in range(len(rays)):
        pixels[i, 0], pixels[i, 1], inside[i] = _locate(rays[i, 0], rays[i, 1], rays[i, 2], projection[0])
    return pixels, inside


@compiled
def _fill(
    arrivals: Records[Arrival],
    T_station_camera: Array,
    lamps: Records[Lamp],
    rim: Rim,
    projection: Projection,
    places: HaloPlaces,
    whole: Array,
) -> None:
    offset = np.empty(3)
    for i in range(len(lamps)):
        lamp, arrival = lamps[i], arrivals[i]
        r2 = along = 0.0
        for k in range(3):
            offset[k] = lamp.place_m[k] - T_station_camera[k, 3]
            r2 += offset[k] * offset[k]
            along -= offset[k] * lamp.axis[k]
        r2 = max(r2, _NEAREST_M2)
        r = math.sqrt(r2)
        angle = math.acos(min(max(along / r, -1.0), 1.0))
        total = lamp.peak_w_sr * math.exp(lamp.minus_profile * angle * angle - lamp.absorption_per_m * r) / r2
        if lamp.recessed and _is_hidden(lamp, T_station_camera, rim):
            total = 0.0
        arrival.range_m, arrival.scattering_depth = r, lamp.scattering_per_m * r
        arrival.core_w_m2 = total * math.exp(-arrival.scattering_depth)
        row, weight = _place(arrival.scattering_depth, places)
        row += lamp.halo_row
        arrival.halo_row, arrival.halo_weight = row, weight
        arrival.halo_w_m2 = (total - arrival.core_w_m2) * (whole[row] + weight * (whole[row + 1] - whole[row]))
        ray = arrival.ray_camera
        for k in range(3):
            ray[k] = 0.0
            for axis in range(3):
                ray[k] += offset[axis] / r * T_station_camera[axis, k]
        arrival.pixel[0], arrival.pixel[1], arrival.inside = _locate(ray[0], ray[1], ray[2], projection)


@compiled
def _place(br: float, places: HaloPlaces) -> tuple[int, float]:
    place = min(math.log(1.0 + br / places.bend) * places.per_log, places.last)
    row = min(int(place), int(places.last) - 1)
    return row, place - row


@compiled
def _is_hidden(lamp: Lamp, T_station_camera: Array, rim: Rim) -> bool:
    """Whether the line from a lamp inside the funnel to the camera crosses the rim's plane outside the rim."""
    ahead, setback = T_station_camera[0, 3] - rim.x_m, rim.x_m - lamp.place_m[0]
    if ahead <= 0.0:
        return False
    share = setback / (setback + ahead)
    across = (lamp.place_m[1] - rim.y_m) * (1.0 - share) + (T_station_camera[1, 3] - rim.y_m) * share
    up = (lamp.place_m[2] - rim.z_m) * (1.0 - share) + (T_station_camera[2, 3] - rim.z_m) * share
    return across * across + up * up > rim.radius2_m2


@compiled
def _locate(right: float, down: float, ahead: float, projection: Projection) -> tuple[float, float, bool]:
    """Pixel u, v of a ray, and whether it lies on the sensor."""
    brown, middle, reach = projection.brown, projection.middle_px, projection.reach_px
    depth = max(ahead, 1e-9)
    x, y = right / depth, down / depth
    r2 = x * x + y * y
    seen = r2 <= projection.max_tangent2 and ahead > 0.0
    if projection.tangential:
        u, v = pixel_of(x, y, brown) if seen else (brown[CX], brown[CY])
    else:
        # Without tangential terms there is less to compute, and rays just off the sensor keep their direction.
        stretch = radial_factor(min(r2, projection.max_tangent2), brown[K1], brown[K2], brown[K3])
        u, v = brown[FX] * stretch * x + brown[CX], brown[FY] * stretch * y + brown[CY]
    return u, v, seen and abs(u - middle[0]) < reach[0] and abs(v - middle[1]) < reach[1]
