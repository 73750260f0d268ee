"""What lamps throw on surfaces, along the rays of a grid: the loops of `optics.surfaces` and `optics.lamp`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from auvdock.numeric.compiled import compiled

__all__ = ["add_beamed", "add_spilled"]

_LOG2_E = np.float32(1.4426950408889634)
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
_LEAST = np.float32(-60.0)
_ONE, _HALF = np.float32(1.0), np.float32(0.5)
_C3, _C4, _C5 = np.float32(0.16666665), np.float32(0.041665796), np.float32(0.0083334519)
_C6, _C7 = np.float32(0.0013981999), np.float32(0.00019875691)


@compiled
def add_spilled(
    light: NDArray[np.float32],
    rays: NDArray[np.float32],
    distance: NDArray[np.float32],
    lamps: NDArray[np.float32],
    absorption_per_m: NDArray[np.float32],
    spill_w_sr: NDArray[np.float32],
    least_m2: np.float32,
) -> None:
    """Add to light (3, n), per band, what lamps send in all directions: S e^{-a d} / d².

    Args:
        light: on the points at `distance` (n,) along unit `rays` (3, n).
        rays: of the grid.
        distance: in metres.
        lamps: (m, 3) places of the lamps, in the frame of the rays.
        absorption_per_m: (m,) a of each.
        spill_w_sr: (m, 3) S of each, per band.
        least_m2: least d².
    """
    weight = np.empty(len(distance), dtype=np.float32)
    for lamp in range(len(lamps)):
        x, y, z = lamps[lamp]
        loss = -absorption_per_m[lamp]
        for i in range(len(distance)):
            s = distance[i]
            dx, dy, dz = s * rays[0, i] - x, s * rays[1, i] - y, s * rays[2, i] - z
            d2 = max(dx * dx + dy * dy + dz * dz, least_m2)
            weight[i] = _exp(loss * np.sqrt(d2)) / d2
        for band in range(3):
            strength, out = spill_w_sr[lamp, band], light[band]
            if strength > 0.0:
                for i in range(len(distance)):
                    out[i] += weight[i] * strength


@compiled
def add_beamed(
    light: NDArray[np.float32],
    rays: NDArray[np.float32],
    distance: NDArray[np.float32],
    lamps: NDArray[np.float32],
    loss_per_m: NDArray[np.float32],
    peak_w_sr: NDArray[np.float32],
    narrow: np.float32,
    least_m2: np.float32,
) -> None:
    """Add to light (3, n), per band, what lamps that shine along z throw: I f(θ) cos θ e^{-k d} / d².

    f = e^{-narrow (1 - cos θ) (1 + (1 - cos θ) / 6)}: a Gaussian of θ² = 2 (1 - cos θ) (1 + (1 - cos θ) / 6), which is
    1 % low at 70°.

    Args:
        light: on the points at `distance` (n,) along unit `rays` (3, n); it is taken to face along the axis.
        rays: of the grid, in the frame of the lamps.
        distance: in metres.
        lamps: (m, 3) places of the lamps.
        loss_per_m: (3,) k per band.
        peak_w_sr: (3,) I per band.
        narrow: twice the Gaussian's factor.
        least_m2: least d².
    """
    sixth = np.float32(1.0 / 6.0)
    for lamp in range(len(lamps)):
        x, y, z = lamps[lamp]
        for i in range(len(distance)):
            s = distance[i]
            dx, dy, dz = s * rays[0, i] - x, s * rays[1, i] - y, s * rays[2, i] - z
            d2 = max(dx * dx + dy * dy + dz * dz, least_m2)
            d = np.sqrt(d2)
            cosine = min(max(dz / d, np.float32(0.0)), _ONE)
            versed = _ONE - cosine
            profile = -narrow * versed * (_ONE + versed * sixth)
            weight = cosine / d2
            for band in range(3):
                light[band, i] += peak_w_sr[band] * weight * _exp(profile - loss_per_m[band] * d)


@compiled
def _exp(x: np.float32) -> np.float32:
    """e^x for x up to 80, within 2e-7 of it, and e^-60 below -60: 2^n times a polynomial (Cephes, Moshier 1989).

    Without a branch, so that loops over it become vector instructions, which calls of a library's e^x do not; and
    products of a few of its values stay clear of the slow denormal numbers.
    """
    x = max(x, _LEAST)
    n = np.floor(x * _LOG2_E + _HALF)
    x = x - n * _LN2_HIGH - n * _LN2_LOW
    tail = ((((_C7 * x + _C6) * x + _C5) * x + _C4) * x + _C3) * x + _HALF
    bits = (np.int32(n) + np.int32(127)) << np.int32(23)
    return (tail * x * x + x + _ONE) * np.int32(bits).view(np.float32)
