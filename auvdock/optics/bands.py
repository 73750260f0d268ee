"""Wavelength bands, and how the camera's three channels respond to them."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["BANDS_NM", "RESPONSE", "channel_response", "electrons_per_joule", "interpolate_bands"]

BANDS_NM = (450.0, 530.0, 620.0)
"""Blue, green and red band centres in nm, at which waters are tabulated."""

RESPONSE = np.array(
    [
        [0.02, 0.06, 0.50],
        [0.10, 0.55, 0.08],
        [0.50, 0.15, 0.02],
    ]
)
"""(3, 3) quantum efficiency of the red, green and blue channel (rows) in the bands of `BANDS_NM` (columns).

Read off the spectral response of common back-illuminated colour CMOS sensors to one figure: about one half in the
channel's own band and a few percent of leakage in the others. A scene quantity per band becomes electrons per channel
by this matrix; between the bands it is interpolated linearly (`channel_response`)."""

_PLANCK_J_S = 6.62607015e-34
_LIGHT_SPEED_M_S = 2.99792458e8


def interpolate_bands(values: Array, wavelength_nm: float) -> float:
    """Piecewise linear interpolation of a quantity (3,) given at `BANDS_NM`, constant beyond the outer bands."""
    return float(np.interp(wavelength_nm, BANDS_NM, values))


def channel_response(wavelength_nm: float) -> Array:
    """(3,) quantum efficiency of the red, green and blue channel at a wavelength."""
    return np.array([interpolate_bands(row, wavelength_nm) for row in RESPONSE])


def electrons_per_joule(wavelength_nm: float) -> Array:
    """(3,) photo-electrons per joule of light on the pixel: efficiency × λ / (h c), for red, green and blue."""
    photons_per_joule = wavelength_nm * 1e-9 / (_PLANCK_J_S * _LIGHT_SPEED_M_S)
    return channel_response(wavelength_nm) * photons_per_joule
