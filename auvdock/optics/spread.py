"""Lights spread over the sensor as spots, compiled: core and halo as functions of the distance from the centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import LEAST_EXPONENT
from auvdock.numeric.records import Record, Records
from auvdock.optics.arrival import Arrival, Lamp

__all__ = ["HaloPlaces", "Ring", "Spot", "Spread", "SpreadLaw", "place_in_halo", "profiles", "spread"]


@dataclass(frozen=True)
class HaloPlaces(Record):
    """Where in the halo's table a scattering depth is; the rows are even in its logarithm."""

    log_first: float
    """Logarithm of the first row's b r."""
    per_log: float
    """Rows per unit of ln b r."""
    least: float
    greatest: float
    """b r that the table holds."""


@dataclass(frozen=True)
class SpreadLaw(Record):
    """What core and halo become on one camera's sensor in one water."""

    halo: HaloPlaces
    lens_px2: float
    """Variance of the core by the lens' point spread function."""
    face_px2_m2: float
    """Variance of the core by the lamp's face at 1 m."""
    aperture_m2: float
    """Area of the entrance pupil times the lens' transmission."""
    first_px2: float
    """Square of the first tabulated radius."""
    per_log_px2: float
    """Tabulated radii per unit of ln r²."""


@dataclass(frozen=True)
class Ring(Record):
    """A radius at which profiles are tabulated."""

    radius_px: float
    area_px2: float
    """Area of the ring that it stands for."""


@dataclass
class Spot(Record):
    """A light on the sensor, by itself."""

    lamp: int
    """Index among the scene's lamps."""
    pixel: Annotated[Array, 2]
    core_w_m2: float
    """Irradiance of the unscattered light."""
    halo_w_m2: float
    """Irradiance of the forward-scattered light."""
    sigma_px: float
    """Standard deviation of the core."""
    channel: Annotated[Array, 3]
    """Electrons per second for 1 W/m² on a pixel: red, green, blue."""


class Spread(NamedTuple):
    """Lights as spots.

    Attributes:
        rows: (m,) the lights.
        profile: (m, k) irradiance per pixel at the radii of the rings, W/m².
    """

    rows: Records[Spot]
    profile: Array


_SPOT = Spot.dtype()


@compiled
def spread(
    index: IntArray,
    arrivals: Records[Arrival],
    lamps: Records[Lamp],
    law: Records[SpreadLaw],
    rings: Records[Ring],
    halo: Array,
) -> Spread:
    """Lights `index` (m,) of n as spots.

    Args:
        index: which lights.
        arrivals: (n,) light at the camera.
        lamps: (n,) where it comes from.
        law: one row.
        rings: (k,) radii.
        halo: (h, k) halo of unit light per pixel at the rings, by b r.
    """
    rows: Records[Spot] = np.empty(len(index), dtype=_SPOT)  # type: ignore[assignment]  # of records
    profile = np.empty((len(index), len(rings)))
    for i in range(len(index)):
        light = index[i]
        arrival, row = arrivals[light], rows[i]
        row.lamp, row.core_w_m2, row.halo_w_m2 = light, arrival.core_w_m2, arrival.halo_w_m2
        for axis in range(2):
            row.pixel[axis] = arrival.pixel[axis]
        for c in range(3):
            row.channel[c] = lamps[light].electrons_per_j[c] * law[0].aperture_m2
        row.sigma_px = _put_profile(profile[i], arrival, law[0], rings, halo)
    return Spread(rows, profile)


@compiled
def profiles(arrivals: Records[Arrival], law: Records[SpreadLaw], rings: Records[Ring], halo: Array) -> Array:
    """(n, k) profiles of lights (n,), 0 for those that are not on the sensor: `spread` for planners."""
    profile = np.zeros((len(arrivals), len(rings)))
    for i in range(len(arrivals)):
        if arrivals[i].inside:
            _put_profile(profile[i], arrivals[i], law[0], rings, halo)
    return profile


@compiled
def _put_profile(profile: Array, arrival: Arrival, law: SpreadLaw, rings: Records[Ring], halo: Array) -> float:
    """Put a light's profile (k,) there; σ of its core."""
    row, weight = _place(arrival.scattering_depth, law.halo)
    sigma2 = law.lens_px2 + law.face_px2_m2 / (arrival.range_m * arrival.range_m)
    peak = arrival.core_w_m2 / (2.0 * math.pi * sigma2)
    below, above = halo[row], halo[row + 1]
    for k in range(len(rings)):
        profile[k] = (below[k] + weight * (above[k] - below[k])) * arrival.halo_w_m2
    for k in range(len(rings)):
        exponent = -0.5 * (rings[k].radius_px * rings[k].radius_px) / sigma2
        if exponent <= LEAST_EXPONENT:
            break
        profile[k] += peak * math.exp(exponent)
    return math.sqrt(sigma2)


@compiled
def place_in_halo(br: Array, places: Records[HaloPlaces]) -> tuple[IntArray, Array]:
    """Row (n,) of the halo's table below each b r (n,) and the weight (n,) of the row above: linear in ln b r."""
    row, weight = np.empty(len(br), dtype=np.int64), np.empty(len(br))
    for i in range(len(br)):
        row[i], weight[i] = _place(br[i], places[0])
    return row, weight


@compiled
def _place(br: float, places: HaloPlaces) -> tuple[int, float]:
    place = (math.log(min(max(br, places.least), places.greatest)) - places.log_first) * places.per_log
    row = int(place)
    return row, place - row
