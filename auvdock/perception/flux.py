"""How much light a spot holds: codes made linear, surroundings taken off, exposure and gain divided out."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, BoolArray, Image, IntArray
from auvdock.core.contracts import Frame
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import SATURATED_CODE

__all__ = ["DISC_RAD", "spot_flux"]

DISC_RAD = 0.012
"""Radius of the measured disc (ours): the peak of the halo and what noise needs, but not the neighbours."""
_MIN_RADIUS_PX = 4.0
_EDGES = np.array([0.0, 0.12, 0.2, 0.3, 0.42, 0.56, 0.76, 1.0, 1.4, 2.0, 2.8, 4.0])
"""Edges of the rings over the radius of the disc; the first `_DISC` are the disc, `_AROUND` its surroundings."""
_DISC = 7
_AROUND = 8
_FIT_RINGS = 3


def spot_flux(frame: Frame, centre_px: Array, disc_rad: float = DISC_RAD) -> Array:
    """Light (n,) of the spots at `centre_px` (n, 2) in photo-electrons per second of the brightest channel.

    Flux = Σ over rings of area × (mean - mean of the surroundings) / exposure time, over a disc of `disc_rad`, with the
    ring from 1.4 to 2 radii as surroundings. A saturated core does not count as light: where rings hold saturated
    pixels their mean above the image's background (its median) is extrapolated inwards from the next three rings as an
    exponential of the radius. That meets Wells' halos at b r from 5 to 16 within a third, as long as the disc's rim is
    unsaturated (ours). So the flux of one light keeps its scale while its core goes in and out of saturation; a light
    that is saturated far beyond the disc gives a lower limit.
    """
    n = len(centre_px)
    flux = np.zeros(n)
    if n == 0:
        return flux
    focal_px = float(frame.camera.matrix[0, 0])
    radius = max(disc_rad * focal_px, _MIN_RADIUS_PX)
    table = frame.response.electrons(frame.gain)
    for k, (u, v) in enumerate(centre_px.tolist()):
        flux[k] = _above(frame, u, v, radius, table, False) / frame.exposure_s
    return flux


def _above(frame: Frame, u: float, v: float, radius: float, table: Array, wide: bool) -> float:
    """Electrons of one disc above its surroundings; looks wider if it is saturated."""
    height, width = frame.image.shape[:2]
    last = len(_EDGES) - 1 if wide else _AROUND + 1
    reach = math.ceil(float(_EDGES[last]) * radius) + 1
    left, top = max(round(u) - reach, 0), max(round(v) - reach, 0)
    right, bottom = min(round(u) + reach + 1, width), min(round(v) + reach + 1, height)
    if right - left < 2 or bottom - top < 2:
        return 0.0
    channel = int(_channel_sums(frame.image, left, top, right, bottom).argmax())
    edges_px = _EDGES[: last + 1] * radius
    count, total, saturated = _rings(frame.image, left, top, right, bottom, channel, u, v, edges_px, table)
    if not wide and saturated.any():
        return _above(frame, u, v, radius, table, True)
    count, total, saturated = count[:last], total[:last], saturated[:last]
    mean = total / np.maximum(count, 1.0)
    shown = count > 0.0
    if not shown[_AROUND] and not wide:
        return 0.0
    if wide:
        background = float(np.median(table[frame.image[::16, ::16, channel]]))
        mean = _mended(mean, shown, saturated > 0.0, background)
    elif not shown.all():
        mean = np.interp(_MIDDLE[:last], _MIDDLE[:last][shown], mean[shown])
    areas = math.pi * radius**2 * np.diff(_EDGES[: _DISC + 1] ** 2)
    return max(float(((mean[:_DISC] - mean[_AROUND]) * areas).sum()), 0.0)


_MIDDLE = 0.5 * (_EDGES[1:] + _EDGES[:-1])


def _mended(mean: Array, shown: BoolArray, burnt: BoolArray, background: float) -> Array:
    """Ring means with the saturated ones extrapolated from outside."""
    first = int(np.flatnonzero(burnt)[-1]) + 1
    good = np.flatnonzero(shown & (np.arange(len(mean)) >= first))
    if len(good) < 2:
        return mean
    fit = good[:_FIT_RINGS]
    floor = min(background, 0.5 * float(mean[fit].min()))
    light = np.maximum(mean[fit] - floor, 1e-3)
    slope = -1.0
    if len(fit) >= 2:
        slope = min(float(np.polyfit(_MIDDLE[fit], np.log(light), 1)[0]), 0.0)
    mended = np.interp(_MIDDLE, _MIDDLE[good], mean[good])
    inner = slice(0, int(fit[0]))
    mended[inner] = floor + light[0] * np.exp(slope * (_MIDDLE[inner] - _MIDDLE[fit[0]]))
    return mended


@compiled
def _channel_sums(image: Image, left: int, top: int, right: int, bottom: int) -> IntArray:
    """(3,) sums of the codes in a box, upper bounds excluded."""
    sums = np.zeros(3, dtype=np.int64)
    for y in range(top, bottom):
        for x in range(left, right):
            for channel in range(3):
                sums[channel] += image[y, x, channel]
    return sums


@compiled
def _rings(
    image: Image,
    left: int,
    top: int,
    right: int,
    bottom: int,
    channel: int,
    u: float,
    v: float,
    edges_px: Array,
    table: Array,
) -> tuple[Array, Array, Array]:
    """Pixels, electrons and saturated pixels (k + 1,) of a box by rings, and of what lies beyond the last.

    The rings lie about (u, v) between radii `edges_px` (k + 1,), the first 0; the box excludes its upper bounds.
    """
    rings = len(edges_px) - 1
    count, total, saturated = np.zeros(rings + 1), np.zeros(rings + 1), np.zeros(rings + 1)
    edges2 = edges_px * edges_px
    for y in range(top, bottom):
        for x in range(left, right):
            distance2 = (x - u) * (x - u) + (y - v) * (y - v)
            ring = 0
            while ring < rings and distance2 >= edges2[ring + 1]:
                ring += 1
            code = image[y, x, channel]
            count[ring] += 1.0
            total[ring] += table[code]
            if code >= SATURATED_CODE:
                saturated[ring] += 1.0
    return count, total, saturated
