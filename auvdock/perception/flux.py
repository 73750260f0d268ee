"""How much light a spot holds: codes made linear, surroundings taken off, exposure and gain divided out."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.contracts import Frame
from auvdock.core.response import SATURATED_CODE

__all__ = ["spot_flux"]

_RADIUS_RAD = 0.012
"""Radius of the measured disc (ours): the peak of the halo and what noise needs, but not the neighbours."""
_MIN_RADIUS_PX = 4.0
_EDGES = np.array([0.0, 0.12, 0.2, 0.3, 0.42, 0.56, 0.76, 1.0, 1.4, 2.0, 2.8, 4.0])
"""Edges of the rings over the radius of the disc; the first `_DISC` are the disc, `_AROUND` its surroundings."""
_DISC = 7
_AROUND = 8
_FIT_RINGS = 3


def spot_flux(frame: Frame, centre_px: Array) -> Array:
    """Light (n,) of the spots at `centre_px` (n, 2) in photo-electrons per second of the brightest channel.

    Flux = Σ over rings of area × (mean - mean of the surroundings) / exposure time, over a disc of 12 mrad radius, with
    the ring from 1.4 to 2 radii as surroundings. A saturated core does not count as light: where rings hold saturated
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
    radius = max(_RADIUS_RAD * focal_px, _MIN_RADIUS_PX)
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
    patch = frame.image[top:bottom, left:right]
    channel = int(patch.sum(axis=(0, 1), dtype=np.int64).argmax())
    codes = patch[:, :, channel]
    saturated = codes >= SATURATED_CODE
    if not wide and saturated.any():
        return _above(frame, u, v, radius, table, True)
    distance = np.hypot(np.arange(left, right)[None, :] - u, np.arange(top, bottom)[:, None] - v) / radius
    ring = np.searchsorted(_EDGES[: last + 1], distance.ravel(), side="right") - 1
    count = np.bincount(ring, minlength=last + 1)[:last]
    mean = np.bincount(ring, table[codes].ravel(), minlength=last + 1)[:last] / np.maximum(count, 1)
    shown = count > 0
    if not shown[_AROUND] and not wide:
        return 0.0
    if wide:
        burnt = np.bincount(ring[saturated.ravel()], minlength=last + 1)[:last] > 0
        background = float(np.median(table[frame.image[::16, ::16, channel]]))
        mean = _mended(mean, shown, burnt, background)
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
