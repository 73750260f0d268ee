"""The lights of one frame on their way to the detector, compiled: received, located, spread, met, told apart.

Each step serves by itself, through the class that knows its constants; `see` makes them all at once, which from Python
takes three times as long.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import LEAST_EXPONENT
from auvdock.numeric.lens import radial_factor

__all__ = [
    "areas",
    "at_distance",
    "close",
    "codes",
    "contrast",
    "crowded",
    "located",
    "met",
    "noise_dn",
    "received",
    "rows_of",
    "see",
    "spread",
    "squared_distances",
    "veiled",
]

_NEAREST_M2 = 1e-4
_VEILED_DN = 50.0


@compiled
def received(T_station_camera: Array, lamps: Array, behind: Array, rim: Array) -> tuple[Array, Array]:
    """Rays in the camera frame (n, 3), and range, scattering depth, core and halo (4, n).

    Args:
        T_station_camera: (4, 4).
        lamps: (n, 10) position, axis, factor of θ² in the beam's exponent, absorption, scattering, peak intensity.
        behind: (k, 4) lamps inside the funnel: index, setback, y and z from the rim's centre.
        rim: (4,) x of its plane, y and z of its centre, square of its radius.
    """
    count, offset = len(lamps), np.empty(3)
    ray, parts, total = np.empty((count, 3)), np.empty((4, count)), np.empty(count)
    for i in range(count):
        r2 = along = 0.0
        for k in range(3):
            offset[k] = lamps[i, k] - T_station_camera[k, 3]
            r2 += offset[k] * offset[k]
            along -= offset[k] * lamps[i, 3 + k]
        r2 = max(r2, _NEAREST_M2)
        r = math.sqrt(r2)
        angle = math.acos(min(max(along / r, -1.0), 1.0))
        total[i] = lamps[i, 9] * math.exp(lamps[i, 6] * angle * angle - lamps[i, 7] * r) / r2
        parts[0, i], parts[1, i] = r, lamps[i, 8] * r
        for k in range(3):
            ray[i, k] = 0.0
            for axis in range(3):
                ray[i, k] += offset[axis] / r * T_station_camera[axis, k]
    ahead = T_station_camera[0, 3] - rim[0]
    if ahead > 0.0:
        to_y, to_z = T_station_camera[1, 3] - rim[1], T_station_camera[2, 3] - rim[2]
        for k in range(len(behind)):
            share = behind[k, 1] / (behind[k, 1] + ahead)
            across, up = behind[k, 2] * (1.0 - share) + to_y * share, behind[k, 3] * (1.0 - share) + to_z * share
            if across * across + up * up > rim[3]:
                total[int(behind[k, 0])] = 0.0
    for i in range(count):
        parts[2, i] = total[i] * math.exp(-parts[1, i])
        parts[3, i] = total[i] - parts[2, i]
    return ray, parts


@compiled
def located(rays: Array, lens: Array) -> tuple[Array, BoolArray]:
    """Pixels (n, 2) of rays (n, 3) through a lens without tangential distortion, and whether they lie on the sensor.

    Args:
        rays: in the camera frame.
        lens: (12,) `Lens.numbers`.
    """
    pixels, inside = np.empty((len(rays), 2)), np.empty(len(rays), dtype=np.bool_)
    for i in range(len(rays)):
        depth = max(rays[i, 2], 1e-9)
        x, y = rays[i, 0] / depth, rays[i, 1] / depth
        r2 = x * x + y * y
        seen = r2 <= lens[0] and rays[i, 2] > 0.0
        r2 = min(r2, lens[0])
        stretch = radial_factor(r2, lens[3], lens[4], lens[5])
        pixels[i, 0], pixels[i, 1] = lens[6] * stretch * x + lens[8], lens[7] * stretch * y + lens[9]
        inside[i] = seen and abs(pixels[i, 0] - lens[10]) < lens[1] and abs(pixels[i, 1] - lens[11]) < lens[2]
    return pixels, inside


@compiled
def rows_of(br: Array, halo: Array) -> tuple[IntArray, Array]:
    """Row (n,) of the halo's table below each b r (n,) and the weight (n,) of the row above: linear in log b r.

    Args:
        br: scattering depths.
        halo: (4,) log b r of the first row, rows per unit of log b r, least and greatest b r.
    """
    row, weight = np.empty(len(br), dtype=np.int64), np.empty(len(br))
    for i in range(len(br)):
        place = (math.log(min(max(br[i], halo[2]), halo[3])) - halo[0]) * halo[1]
        row[i] = int(place)
        weight[i] = place - row[i]
    return row, weight


@compiled
def spread(
    index: IntArray,
    range_m: Array,
    depth: Array,
    core: Array,
    halo: Array,
    rows: Array,
    table: Array,
    minus_half_r2: Array,
    widths: Array,
    channel: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Lights as spots on the sensor.

    Args:
        index: (m,) which of n lights.
        range_m: (n,) distances.
        depth: (n,) scattering depths b r.
        core: (n,) irradiance of the unscattered light in W/m².
        halo: (n,) irradiance of the scattered light in W/m².
        rows: (h, k) halo of unit light per pixel at the tabulated radii, by b r.
        table: (4,) where in it which b r is, see `rows_of`.
        minus_half_r2: (k,) −½ of the radii's squares in px², the radii rising.
        widths: (2,) variance of the core in px² by the lens, and by the lamp's face at 1 m.
        channel: (n, 3) electrons per second for 1 W/m² on a pixel.

    Returns:
        Of the m lights core, halo and widths (m,), profiles (m, k) in W/m² per pixel, and channels (m, 3).
    """
    count = len(index)
    cores, halos, sigma, depths = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    channels, profile = np.empty((count, 3)), np.empty((count, len(minus_half_r2)))
    for i in range(count):
        light = index[i]
        cores[i], halos[i], depths[i] = core[light], halo[light], depth[light]
        for c in range(3):
            channels[i, c] = channel[light, c]
    row, weight = rows_of(depths, table)
    for i in range(count):
        distance_m = range_m[index[i]]
        sigma2 = widths[0] + widths[1] / (distance_m * distance_m)
        sigma[i] = math.sqrt(sigma2)
        peak = cores[i] / (2.0 * math.pi * sigma2)
        below, above = rows[row[i]], rows[row[i] + 1]
        for k in range(len(minus_half_r2)):
            profile[i, k] = (below[k] + weight[i] * (above[k] - below[k])) * halos[i]
        for k in range(len(minus_half_r2)):
            exponent = minus_half_r2[k] / sigma2
            if exponent <= LEAST_EXPONENT:
                break
            profile[i, k] += peak * math.exp(exponent)
    return cores, halos, sigma, profile, channels


@compiled
def areas(profile: Array, channel: Array, level_e_s: float, ring_px2: Array) -> Array:
    """(m, 3) area in px² of each spot above a level: of each ring the part between 0 and 1 by which it is above.

    Args:
        profile: (m, k) irradiance per pixel at the rings, W/m².
        channel: (m, 3) electrons per second for 1 W/m² on a pixel.
        level_e_s: electrons per second.
        ring_px2: (k,) areas of the rings.
    """
    area, scale = np.zeros((len(profile), 3)), 2.5 / level_e_s
    for i in range(len(profile)):
        for c in range(3):
            per_w = channel[i, c] * scale
            for k in range(len(ring_px2)):
                area[i, c] += min(max(profile[i, k] * per_w - 2.0, 0.0), 1.0) * ring_px2[k]
    return area


@compiled
def at_distance(profile: Array, distance2_px2: Array, spacing: Array) -> Array:
    """(m, m) irradiance per pixel at squared distances (m, m) from lights along the second axis.

    `spacing` (2,) is the square of the first tabulated radius and the number of radii per unit of ln r².
    """
    value = np.empty((len(distance2_px2), len(profile)))
    first2, per_log2 = spacing[0], spacing[1]
    last = profile.shape[1] - 1
    for i in range(len(distance2_px2)):
        for j in range(len(profile)):
            place = math.log(max(distance2_px2[i, j], first2) / first2) * per_log2
            value[i, j] = profile[j, min(int(place + 0.5), last)]
    return value


@compiled
def squared_distances(pixels: Array) -> Array:
    """(m, m) squared distances between points (m, 2)."""
    distance2 = np.empty((len(pixels), len(pixels)))
    for i in range(len(pixels)):
        for j in range(len(pixels)):
            x, y = pixels[i, 0] - pixels[j, 0], pixels[i, 1] - pixels[j, 1]
            distance2[i, j] = x * x + y * y
    return distance2


@compiled
def met(
    profile: Array, channel: Array, pixels: Array, ring_px2: Array, spacing: Array, exposure_s: float, level_e: float
) -> tuple[IntArray, Array, Array, Array, float, Array]:
    """Lights beside each other on the sensor, in the channel in which each is brightest.

    Args:
        profile: (m, k) irradiance per pixel at the tabulated radii, W/m².
        channel: (m, 3) electrons per second for 1 W/m² on a pixel.
        pixels: (m, 2) places.
        ring_px2: (k,) areas of the rings.
        spacing: (2,) see `at_distance`.
        exposure_s: exposure time.
        level_e: electrons at which a sample is saturated.

    Returns:
        That channel (m,), electrons of its own light and of all others' at its centre (m,), radius of its saturated
        disc (m,), saturated area of all in px², squared distances (m, m).
    """
    count = len(profile)
    place, own, around = np.empty(count, dtype=np.int64), np.empty(count), np.empty(count)
    radius, distance2 = np.empty(count), squared_distances(pixels)
    saturated = areas(profile, channel, level_e / exposure_s, ring_px2)
    level = at_distance(profile, distance2, spacing)
    total = 0.0
    for i in range(count):
        best = 0
        for c in range(1, 3):
            if channel[i, c] * exposure_s > channel[i, best] * exposure_s:
                best = c
        place[i] = best
        around[i] = 0.0
        for j in range(count):
            around[i] += level[i, j] * (channel[j, best] * exposure_s)
        own[i] = level[i, i] * (channel[i, best] * exposure_s)
        around[i] -= own[i]
        greatest = 0.0
        for c in range(3):
            total += saturated[i, c]
            greatest = max(greatest, saturated[i, c])
        radius[i] = math.sqrt(greatest / math.pi)
    return place, own, around, radius, total, distance2


@compiled
def codes(electrons: Array, scale: Array) -> Array:
    """Unrounded, unclipped codes (n,) of electrons (n,); `scale` (5,) is `SensorScale.numbers`."""
    code = np.empty(len(electrons))
    for i in range(len(electrons)):
        if scale[0] > 0.0:
            code[i] = electrons[i] * scale[0]
        else:
            code[i] = (math.sqrt(electrons[i] + scale[1]) - scale[2]) * scale[3]
    return code


@compiled
def noise_dn(electrons: Array, scale: Array) -> Array:
    """Standard deviation of the code (n,) at electrons (n,), quantisation included."""
    noise = np.empty(len(electrons))
    for i in range(len(electrons)):
        noise[i] = scale[4]
        if scale[0] > 0.0:
            noise[i] = math.sqrt((electrons[i] + scale[1]) * scale[0] ** 2 + 1.0 / 12.0)
    return noise


@compiled
def contrast(own: Array, around: Array, scale: Array) -> tuple[Array, Array, Array]:
    """Code of lights (m,) above that of their surroundings, the latter, and the noise of the former; clipped at 255."""
    bright = np.empty(len(own))
    for i in range(len(own)):
        bright[i] = own[i] + around[i]
    noise = noise_dn(bright, scale)
    bright, surround = codes(bright, scale), codes(around, scale)
    for i in range(len(own)):
        surround[i] = min(surround[i], 255.0)
        bright[i] = min(bright[i], 255.0) - surround[i]
    return bright, surround, noise


@compiled
def veiled(levels: Array) -> int:
    """How many of the lights `levels` (6, m) have surroundings that outshine their contrast by 50 codes or more."""
    count = 0
    for i in range(levels.shape[1]):
        if levels[1, i] > levels[0, i] + _VEILED_DN:
            count += 1
    return count


@compiled
def close(distance2: Array, radius: Array, model: Array) -> BoolArray:
    """Which lights (m, m) are too close to be told apart; `model` is `DetectionModelCfg.numbers`."""
    near = np.empty(distance2.shape, dtype=np.bool_)
    for i in range(len(radius)):
        for j in range(len(radius)):
            limit = model[10] + model[11] * (radius[i] + radius[j])
            near[i, j] = distance2[i, j] < limit * limit
    return near


@compiled
def crowded(levels: Array, distance2: Array, model: Array) -> tuple[int, bool]:
    """How many of the lights `levels` (6, m) are veiled, and whether any two are too close to be told apart."""
    near = close(distance2, levels[3], model)
    for i in range(len(near)):
        for j in range(i):
            if near[i, j]:
                return veiled(levels), True
    return veiled(levels), False


@compiled
def see(
    T_station_camera: Array,
    lamps: Array,
    behind: Array,
    rim: Array,
    lens: Array,
    rows: Array,
    table: Array,
    minus_half_r2: Array,
    widths: Array,
    ring_px2: Array,
    spacing: Array,
    channel: Array,
    scale: Array,
    exposure_s: float,
    saturated_e: float,
    model: Array,
) -> tuple[Array, Array, BoolArray, Array, float, int, bool]:
    """All of the above for a frame in which nothing but lamps, water and lens plays a part.

    Args:
        T_station_camera: (4, 4).
        lamps: (n, 10), see `received`, as are the next two.
        behind: (k, 4).
        rim: (4,).
        lens: (12,) `Lens.numbers`.
        rows: (h, k), see `spread`, as are the next three.
        table: (4,).
        minus_half_r2: (k,).
        widths: (2,).
        ring_px2: (k,) areas of the rings.
        spacing: (2,) see `at_distance`.
        channel: (n, 3) electrons per second for 1 W/m² on a pixel.
        scale: (5,) `SensorScale.numbers`.
        exposure_s: exposure time.
        saturated_e: electrons at which a sample is saturated.
        model: (12,) `DetectionModelCfg.numbers`.

    Returns:
        Of the lights on the sensor pixels (m, 2); contrast, surroundings, noise, radius, width and electrons (6, m);
        whether they are red (m,); squared distances (m, m); saturated area in px², number of the veiled, and whether
        any two are too close to be told apart.
    """
    ray, parts = received(T_station_camera, lamps, behind, rim)
    place, inside = located(ray, lens)
    index, count = np.empty(len(lamps), dtype=np.int64), 0
    for i in range(len(lamps)):
        if inside[i]:
            index[count] = i
            count += 1
    index = index[:count]
    pixels = np.empty((count, 2))
    for k in range(count):
        pixels[k, 0], pixels[k, 1] = place[index[k], 0], place[index[k], 1]
    _, _, sigma, profile, channels = spread(
        index, parts[0], parts[1], parts[2], parts[3], rows, table, minus_half_r2, widths, channel
    )
    best, own, around, radius, area, distance2 = met(
        profile, channels, pixels, ring_px2, spacing, exposure_s, saturated_e
    )
    contrast_dn, surround, noise = contrast(own, around, scale)
    levels, red = np.empty((6, count)), np.empty(count, dtype=np.bool_)
    for k in range(count):
        levels[0, k], levels[1, k], levels[2, k] = contrast_dn[k], surround[k], noise[k]
        levels[3, k], levels[4, k], levels[5, k] = radius[k], sigma[k], own[k]
        red[k] = best[k] == 0
    hidden, near = crowded(levels, distance2, model)
    return pixels, levels, red, distance2, area, hidden, near
