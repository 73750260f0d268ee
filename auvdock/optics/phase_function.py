"""Scattering by angle: Fournier and Forand's phase function."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["fournier_forand"]

_INDEX, _SLOPE = 1.10, 3.5835
"""Refractive index and Junge slope with which it has Petzold's average backscattering (Mobley et al. 2002)."""


@compiled
def fournier_forand(angle_rad: Array, index: float = _INDEX, slope: float = _SLOPE) -> Array:
    """(n,) phase function in 1/sr at scattering angles (n,), ∫ p dω = 1 (Fournier & Forand 1994).

    In the form of Fournier & Jonasz (1999), for particles of one refractive index with a power law of sizes. With n =
    1.10 and μ = 3.5835 its share of backscattering is 0.0183, that of Petzold's (1972) average (Mobley et al. 2002).
    Not defined at 0, where it has a pole that can be integrated.

    Args:
        angle_rad: scattering angles.
        index: refractive index n of the particles relative to water.
        slope: μ of their Junge law of sizes.
    """
    phase, nu = np.empty(len(angle_rad)), (3.0 - slope) / 2.0
    scale = 4.0 / (3.0 * (index - 1.0) ** 2)
    back = scale**nu
    for i in range(len(angle_rad)):
        half2 = math.sin(0.5 * angle_rad[i]) ** 2
        delta = scale * half2
        power = delta**nu
        head = nu * (1.0 - delta) - (1.0 - power) + (delta * (1.0 - power) - nu * (1.0 - delta)) / half2
        head /= 4.0 * math.pi * (1.0 - delta) ** 2 * power
        tail = (1.0 - back) / (16.0 * math.pi * (scale - 1.0) * back) * (3.0 * math.cos(angle_rad[i]) ** 2 - 1.0)
        phase[i] = head + tail
    return phase
