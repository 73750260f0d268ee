"""How much light a spot holds: codes made linear, surroundings taken off, exposure and gain divided out."""

from __future__ import annotations

import math
from typing import NamedTuple

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


class _Box(NamedTuple):
    """Part of an image in px, upper bounds excluded."""

    left: int
    top: int
    right: int
    bottom: int


class _Rings(NamedTuple):
    """What rings about a place hold, and last of all what lies beyond them (k + 1,).

    Attributes:
        pixels: how many.
        electrons: their electrons.
        burnt: those of them that are saturated.
    """

    pixels: Array
    electrons: Array
    burnt: Array


def spot_flux(frame: Frame, centre_px: Array, disc_rad: float = DISC_RAD) -> Array:
    """Light (n,) of the spots at `centre_px` (n, 2) in photo-electrons per second of the brightest channel.

    Flux = Σ over rings of area × (mean - mean of the surroundings) / exposure time, over a disc of `disc_rad`, with the
    ring from 1.4 to 2 radii as surroundings. A saturated core does not count as light: where rings hold saturated
    pixels their mean above the image's background (its median) is extrapolated inwards from the next three rings as an
    exponential of the radius. In halos by photons, b r from 3.5 to 16, that keeps the flux within a quarter up to twice
    the exposure at which the middle saturates, and up to half is lost at four times, as long as the disc's rim is
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
    box = _Box(left, top, min(round(u) + reach + 1, width), min(round(v) + reach + 1, height))
    if box.right - left < 2 or box.bottom - top < 2:
        return 0.0
    channel = int(_channel_sums(frame.image, box).argmax())
    rings = _measure_rings(frame.image, box, channel, u, v, _EDGES[: last + 1] * radius, table)
    if not wide and rings.burnt.any():
        return _above(frame, u, v, radius, table, True)
    mean = rings.electrons[:last] / np.maximum(rings.pixels[:last], 1.0)
    shown = rings.pixels[:last] > 0.0
    if not shown[_AROUND] and not wide:
        return 0.0
    if wide:
        background = float(np.median(table[frame.image[::16, ::16, channel]]))
        mean = _extrapolate(mean, shown, rings.burnt[:last] > 0.0, background)
    elif not shown.all():
        mean = np.interp(_MIDDLE[:last], _MIDDLE[:last][shown], mean[shown])
    areas = math.pi * radius**2 * np.diff(_EDGES[: _DISC + 1] ** 2)
    return max(float(((mean[:_DISC] - mean[_AROUND]) * areas).sum()), 0.0)


_MIDDLE = 0.5 * (_EDGES[1:] + _EDGES[:-1])


def _extrapolate(mean: Array, shown: BoolArray, burnt: BoolArray, background: float) -> Array:
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
    means = np.interp(_MIDDLE, _MIDDLE[good], mean[good])
    inner = slice(0, int(fit[0]))
    means[inner] = floor + light[0] * np.exp(slope * (_MIDDLE[inner] - _MIDDLE[fit[0]]))
    return means


@compiled
def _channel_sums(image: Image, box: _Box) -> IntArray:
    """(3,) sums of the codes in a box."""
    sums = np.zeros(3, dtype=np.int64)
    for y in range(box.top, box.bottom):
        for x in range(box.left, box.right):
            for channel in range(3):
                sums[channel] += image[y, x, channel]
    return sums


@compiled
def _measure_rings(image: Image, box: _Box, channel: int, u: float, v: float, edges_px: Array, table: Array) -> _Rings:
    """Rings about (u, v) between radii `edges_px` (k + 1,), the first 0, and what of a box lies beyond the last."""
    last = len(edges_px) - 1
    rings = _Rings(np.zeros(last + 1), np.zeros(last + 1), np.zeros(last + 1))
    edges2 = edges_px * edges_px
    for y in range(box.top, box.bottom):
        for x in range(box.left, box.right):
            distance2 = (x - u) * (x - u) + (y - v) * (y - v)
            ring = 0
            while ring < last and distance2 >= edges2[ring + 1]:
                ring += 1
            code = image[y, x, channel]
            rings.pixels[ring] += 1.0
            rings.electrons[ring] += table[code]
            if code >= SATURATED_CODE:
                rings.burnt[ring] += 1.0
    return rings
