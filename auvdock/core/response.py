"""How a camera's codes stand for light: what its data sheet (EMVA 1288) tells the vehicle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["CameraResponse"]


@dataclass(frozen=True)
class CameraResponse:
    """Encoding of photo-electrons e in eight bits.

    "sqrt": code = 255 (√(e + σ_r²) - σ_r) / (√(F / gain + σ_r²) - σ_r); "linear": code = 255 e gain / F, with full well
    F and read noise σ_r.
    """

    encoding: str = "sqrt"
    """"sqrt" or "linear"."""
    full_well_e: float = 40000.0
    """Electrons at which a pixel saturates at gain 1."""
    read_noise_e: float = 6.0
    """Standard deviation of the read noise in electrons."""

    def electrons(self, gain: float) -> Array:
        """(256,) photo-electrons that each code stands for at an analogue gain."""
        return _electrons(self, gain)


@lru_cache(maxsize=64)
def _electrons(response: CameraResponse, gain: float) -> Array:
    codes = np.arange(256.0)
    full_e, read_e = response.full_well_e / gain, response.read_noise_e
    if response.encoding == "linear":
        table = codes * (full_e / 255.0)
    else:
        root = math.sqrt(full_e + read_e**2) - read_e
        table = (codes / 255.0 * root + read_e) ** 2 - read_e**2
    table.setflags(write=False)
    return table
