"""Lights spread over the sensor as spots, compiled: core and halo as functions of the distance from the centre."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import LEAST_EXPONENT
from auvdock.numeric.records import Record, Records
from auvdock.optics.arrival import Arrival, Lamp

__all__ = ["BLURS", "RADII", "Spot", "SpreadLaw", "halo_profiles", "profiles", "spread"]

RADII = 32
"""Radii at which profiles are tabulated."""
BLURS = 12
"""Variances of the blur at which halos are tabulated."""


@dataclass(frozen=True)
class SpreadLaw(Record):
    """What core and halo become on one camera's sensor in one water."""

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
    blurs_per_log: float
    """Tabulated blurs, from `lens_px2` upwards, per unit of the logarithm of the core's variance."""


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
        halo: (blurs, h, k) halo of unit light per pixel at the tabulated radii, by the core's variance and b r.

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
def halo_profiles(arrivals: Records[Arrival], law: Records[SpreadLaw], halo: Array) -> Array:
    """(n, k) halos of unit light per pixel at the tabulated radii, of lights (n,)."""
    profile = np.empty((len(arrivals), RADII))
    for i in range(len(arrivals)):
        _put_halo(profile[i], arrivals[i], 1.0, _variance(arrivals[i], law[0]), law[0], halo)
    return profile


@compiled
def _put_profile(profile: Array, arrival: Arrival, law: SpreadLaw, halo: Array) -> float:
    """Put a light's profile (k,) there; σ of its core."""
    sigma2 = _variance(arrival, law)
    _put_halo(profile, arrival, arrival.halo_w_m2, sigma2, law, halo)
    peak, radius = arrival.core_w_m2 / (2.0 * math.pi * sigma2), law.radius_px
    for k in range(RADII):
        exponent = -0.5 * (radius[k] * radius[k]) / sigma2
        if exponent <= LEAST_EXPONENT:
            break
        profile[k] += peak * math.exp(exponent)
    return math.sqrt(sigma2)


@compiled
def _put_halo(profile: Array, arrival: Arrival, light: float, sigma2: float, law: SpreadLaw, halo: Array) -> None:
    """Put the halo of so much light there (k,), blurred as a core of variance `sigma2` is."""
    place = min(math.log(sigma2 / law.lens_px2) * law.blurs_per_log, BLURS - 1.0)
    blur, row = min(int(place), BLURS - 2), arrival.halo_row
    wider, higher = place - blur, arrival.halo_weight
    at_00, at_01 = (1.0 - wider) * (1.0 - higher) * light, (1.0 - wider) * higher * light
    at_10, at_11 = wider * (1.0 - higher) * light, wider * higher * light
    sharp, wide = halo[blur], halo[blur + 1]
    for k in range(RADII):
        profile[k] = at_00 * sharp[row, k] + at_01 * sharp[row + 1, k]
        profile[k] += at_10 * wide[row, k] + at_11 * wide[row + 1, k]


@compiled
def _variance(arrival: Arrival, law: SpreadLaw) -> float:
    """Of the core, px²."""
    return law.lens_px2 + law.face_px2_m2 / (arrival.range_m * arrival.range_m)
