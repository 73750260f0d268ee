"""A halo as a camera resolves it: blurred by the lens and by the lamp's face.

About a lamp the halo rises towards the middle as a power of the angle of up to -2, far within a pixel. So its light is
folded with the core's own Gaussian: a ring of radius t that holds unit light becomes, at the radius ρ,

    e^{-(ρ - t)² / 2σ²} I0e(ρ t / σ²) / (2π σ²),

I0e the exponentially scaled Bessel function. Beyond 8 σ from the middle the halo is flat enough to stay as it is: less
than 2 % are missing.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.special import i0e

from auvdock.core.arrays import Array, BoolArray
from auvdock.optics.halo import HALO_ANGLE_RAD, HaloTable

__all__ = ["blurred_halo"]

_PARTS = 4
_FAR_SIGMA = 8.0


def blurred_halo(halo: HaloTable, radii_px: Array, rad_per_px: float, variances_px2: Array) -> Array:
    """(levels, rows, k) halo of unit light per pixel at radii (k,), for each of some variances (levels,)."""
    smear, far = _operator(tuple(radii_px.tolist()), rad_per_px, tuple(variances_px2.tolist()))
    rings = np.diff(halo.encircled_rows(HALO_ANGLE_RAD), axis=1, prepend=0.0)
    levels, k = far.shape
    near = (rings @ smear).reshape(len(rings), levels, k).swapaxes(0, 1)
    sharp = halo.density_rows(radii_px * rad_per_px) * rad_per_px**2
    return np.where(far[:, None, :], sharp, near)


@lru_cache(maxsize=16)
def _operator(
    radii_px: tuple[float, ...], rad_per_px: float, variances_px2: tuple[float, ...]
) -> tuple[Array, BoolArray]:
    """What a halo's rings (n,) become at each level and radius (n, levels × k), and where it is left as it is."""
    radii, variances = np.array(radii_px), np.array(variances_px2)[:, None]
    edge2 = np.concatenate([[0.0], (HALO_ANGLE_RAD / rad_per_px) ** 2])
    far = radii > _FAR_SIGMA * np.sqrt(variances)
    smear = np.zeros((len(HALO_ANGLE_RAD), *far.shape))
    for part in (np.arange(_PARTS) + 0.5) / _PARTS:
        t = np.sqrt(edge2[:-1] + part * np.diff(edge2))[:, None, None]
        exponent = np.maximum(-0.5 * (radii - t) ** 2 / variances, -700.0)
        smear += np.exp(exponent) * i0e(radii * t / variances) / (2.0 * math.pi * variances * _PARTS)
    return smear.reshape(len(smear), -1), far
