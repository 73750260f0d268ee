"""Lights spread over the sensor as spots, compiled: core and halo as functions of the distance from the centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import LEAST_EXPONENT
from auvdock.numeric.records import Record, Records
from auvdock.optics.arrival import Arrival, Lamp

__all__ = ["RADII", "HaloPlaces", "Spot", "SpreadLaw", "place_in_halo", "profiles", "spread"]

RADII = 32
"""Radii at which profiles are tabulated."""


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
    radius_px: Annotated[Array, RADII]
    """Where profiles are tabulated."""
    ring_px2: Annotated[Array, RADII]
    """Area of the ring that each radius stands for."""
    per_log_px2: float
    """Tabulated radii per unit of ln r²."""


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


_SPOT = Spot.dtype()


@compiled
def spread(
    arrivals: Records[Arrival], shown: BoolArray, lamps: Records[Lamp], law: Records[SpreadLaw], halo: Array
) -> tuple[Records[Spot], Array]:
    """Those m of n lights that are shown, as spots.

    Args:
        arrivals: (n,) light at the camera.
        shown: (n,) which lights.
        lamps: (n,) where it comes from.
        law: one row.
        halo: (h, k) halo of unit light per pixel at the tabulated radii, by b r.

    Returns:
        The lights (m,), and their profiles (m, k): irradiance per pixel at those radii, W/m².
    """
    count = 0
    for light in range(len(shown)):
        count += shown[light]
    rows: Records[Spot] = np.empty(count, dtype=_SPOT)  # type: ignore[assignment]  # of records
    profile = np.empty((count, RADII))
    i = -1
    for light in range(len(shown)):
        if not shown[light]:
            continue
        i += 1
        arrival, row = arrivals[light], rows[i]
        row.lamp, row.core_w_m2, row.halo_w_m2 = light, arrival.core_w_m2, arrival.halo_w_m2
        for axis in range(2):
            row.pixel[axis] = arrival.pixel[axis]
        for c in range(3):
            row.channel[c] = lamps[light].electrons_per_j[c] * law[0].aperture_m2
        row.sigma_px = _put_profile(profile[i], arrival, law[0], halo)
    return rows, profile


@compiled
def profiles(arrivals: Records[Arrival], law: Records[SpreadLaw], halo: Array) -> Array:
    """(n, k) profiles of lights (n,), 0 for those that are not on the sensor: `spread` for planners."""
    profile = np.zeros((len(arrivals), RADII))
    for i in range(len(arrivals)):
        if arrivals[i].inside:
            _put_profile(profile[i], arrivals[i], law[0], halo)
    return profile


@compiled
def _put_profile(profile: Array, arrival: Arrival, law: SpreadLaw, halo: Array) -> float:
    """Put a light's profile (k,) there; σ of its core."""
    row, weight = _place(arrival.scattering_depth, law.halo)
    sigma2 = law.lens_px2 + law.face_px2_m2 / (arrival.range_m * arrival.range_m)
    peak = arrival.core_w_m2 / (2.0 * math.pi * sigma2)
    below, above, light, radius = halo[row], halo[row + 1], arrival.halo_w_m2, law.radius_px
    for k in range(RADII):
        profile[k] = (below[k] + weight * (above[k] - below[k])) * light
    for k in range(RADII):
        exponent = -0.5 * (radius[k] * radius[k]) / sigma2
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
