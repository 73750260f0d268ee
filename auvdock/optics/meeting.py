"""Lights beside each other on the sensor, compiled: how each stands out from the others and what is behind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.optics.spread import Spot, SpreadLaw

__all__ = [
    "Candidate",
    "CodeScale",
    "codes",
    "level_at",
    "meet",
    "noise_dn",
    "saturate",
    "squared_distances",
]


@dataclass(frozen=True)
class CodeScale(Record):
    """From electrons to codes at one gain; the equations are those of `optics.sensor`."""

    dn_per_e: float
    """Codes per electron of the linear encoding; 0 for the root's."""
    read_e: float
    """Read noise in electrons."""
    dn_per_root: float
    """Codes per √electron of the root's encoding."""
    root_noise_dn: float
    """Standard deviation of a code of the root's encoding, the same at every level."""
    saturated_e: float
    """Electrons at which a sample counts as saturated."""


@dataclass
class Candidate(Record):
    """A light as a detector meets it."""

    pixel: Annotated[Array, 2]
    contrast_dn: float
    """Code at the centre above the code of its surroundings, in the light's brightest channel."""
    surround_dn: float
    """Code of those surroundings."""
    noise_dn: float
    """Standard deviation of the code at the centre, quantisation included."""
    radius_px: float
    """Radius of the saturated disc, 0 without one."""
    width_px: float
    """Width of the spot."""
    flux: float
    """Weight of the light in a merged centre: electrons of its own at the centre."""
    red: bool
    """Red is its brightest channel: class `RED`, else `BLUE`."""
    light_e_s: float
    """What a detector measures as flux, photo-electrons per second; known beside a rotating beacon only."""
    light_noise_e_s: float
    """Its standard deviation by shot and read noise."""


_CANDIDATE = Candidate.dtype()


@compiled
def meet(
    rows: Records[Spot],
    profile: Array,
    law: Records[SpreadLaw],
    scale: Records[CodeScale],
    behind_e_s: Array,
    exposure_s: float,
) -> tuple[Records[Candidate], Array, float]:
    """The lights among each other: at each one's centre its own light, that of the others and what is behind.

    Args:
        rows: (m,) the lights as spots.
        profile: (m, k) irradiance per pixel at the tabulated radii, W/m².
        law: one row.
        scale: one row, from electrons to codes.
        behind_e_s: (3,) electrons per second and pixel behind the lights: red, green, blue.
        exposure_s: exposure time.

    Returns:
        The lights (m,) as a detector meets them; squared distances (m, m) between them, px²; and how many samples are
        saturated, as an area over all channels in px², overlap not counted.
    """
    lights: Records[Candidate] = np.zeros(len(rows), dtype=_CANDIDATE)  # type: ignore[assignment]  # of records
    distance2 = squared_distances(rows)
    level = level_at(profile, distance2, law)
    total, per_level = 0.0, 2.5 / (scale[0].saturated_e / exposure_s)
    for i in range(len(rows)):
        light, channel = lights[i], rows[i].channel
        best, greatest = 0, 0.0
        for c in range(3):
            if channel[c] * exposure_s > channel[best] * exposure_s:
                best = c
            area = _area_px2(profile[i], channel[c] * per_level, law[0])
            total += area
            greatest = max(greatest, area)
        around, own = 0.0, level[i, i] * (channel[best] * exposure_s)
        for j in range(len(rows)):
            around += level[i, j] * (rows[j].channel[best] * exposure_s)
        around = around - own + behind_e_s[best] * exposure_s
        for axis in range(2):
            light.pixel[axis] = rows[i].pixel[axis]
        light.surround_dn = min(_code(around, scale[0]), 255.0)
        light.contrast_dn = min(_code(own + around, scale[0]), 255.0) - light.surround_dn
        light.noise_dn = _noise_dn(own + around, scale[0])
        light.radius_px, light.width_px = math.sqrt(greatest / math.pi), rows[i].sigma_px
        light.flux, light.red = own, best == 0
    return lights, distance2, total


@compiled
def level_at(profile: Array, distance2_px2: Array, law: Records[SpreadLaw]) -> Array:
    """(m, m) irradiance per pixel at squared distances (m, m) from lights with profiles (m, k) along the second axis.

    Taken at the nearest tabulated radius; the radii are 22 % apart. Distances are the same both ways.
    """
    value = np.empty(distance2_px2.shape)
    first2, per_log2 = law[0].radius_px[0] * law[0].radius_px[0], law[0].per_log_px2
    last = profile.shape[1] - 1
    for i in range(len(distance2_px2)):
        for j in range(i, len(profile)):
            place = math.log(max(distance2_px2[i, j], first2) / first2) * per_log2
            nearest = min(int(place + 0.5), last)
            value[i, j], value[j, i] = profile[j, nearest], profile[i, nearest]
    return value


@compiled
def squared_distances(lights: Records[Spot] | Records[Candidate]) -> Array:
    """(m, m) squared distances between the pixels of lights (m,)."""
    distance2 = np.empty((len(lights), len(lights)))
    for i in range(len(lights)):
        for j in range(i, len(lights)):
            one, other = lights[i].pixel, lights[j].pixel
            x, y = one[0] - other[0], one[1] - other[1]
            distance2[i, j] = distance2[j, i] = x * x + y * y
    return distance2


@compiled
def saturate(rows: Records[Spot], profile: Array, law: Records[SpreadLaw], level_e_s: float) -> Array:
    """(m, 3) area in px² of spots (m,) with profiles (m, k) above a level in electrons per second, per channel."""
    area = np.empty((len(rows), 3))
    for i in range(len(rows)):
        for c in range(3):
            area[i, c] = _area_px2(profile[i], rows[i].channel[c] * (2.5 / level_e_s), law[0])
    return area


@compiled
def codes(electrons: Array, scale: Records[CodeScale]) -> Array:
    """Unrounded, unclipped codes (n,) of electrons (n,)."""
    code = np.empty(len(electrons))
    for i in range(len(electrons)):
        code[i] = _code(electrons[i], scale[0])
    return code


@compiled
def noise_dn(electrons: Array, scale: Records[CodeScale]) -> Array:
    """Standard deviation of the code (n,) at electrons (n,), quantisation included."""
    noise = np.empty(len(electrons))
    for i in range(len(electrons)):
        noise[i] = _noise_dn(electrons[i], scale[0])
    return noise


@compiled
def _area_px2(profile: Array, per_w: float, law: SpreadLaw) -> float:
    """Area above a level 2.5 / `per_w`: of each ring the part between 0 and 1 by which it is above."""
    area, ring_px2 = 0.0, law.ring_px2
    for k in range(len(profile)):
        above = profile[k] * per_w - 2.0
        if above > 0.0:
            area += min(above, 1.0) * ring_px2[k]
    return area


@compiled
def _code(electrons: float, scale: CodeScale) -> float:
    if scale.dn_per_e > 0.0:
        return electrons * scale.dn_per_e
    return (math.sqrt(electrons + scale.read_e * scale.read_e) - scale.read_e) * scale.dn_per_root


@compiled
def _noise_dn(electrons: float, scale: CodeScale) -> float:
    if scale.dn_per_e > 0.0:
        return math.sqrt((electrons + scale.read_e * scale.read_e) * scale.dn_per_e**2 + 1.0 / 12.0)
    return scale.root_noise_dn
