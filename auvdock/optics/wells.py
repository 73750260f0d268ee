"""Small-angle scattering as Wells (1973) has it: a model of the halo for comparison with that of single photons.

It knows no absorption and no phase function but its own, θ0 / (2π (β² + θ0²)^{3/2}), and takes angles as plane. All of
the halo together is 1 - e^{-b r} of what absorption leaves. Water whose phase function is "wells" has it.

Wells' optical transfer function of a path r is e^{-(a+b) r} e^{b r F(ψ)} with F = (1 - e^{-k}) / k, k = 2π θ0 ψ and ψ
in cycles per radian. Without its unscattered part it is e^{-a r} × e^{-b r} (e^{b r F} - 1).

F is the mean of e^{-k u} for u uniform on [0, 1], hence e^{-b r} e^{b r F} is the mean of e^{-k S} where S is the sum
of N such u and N is Poisson distributed with mean b r: N is the number of scattering events, u where on the path each
of them happened. And e^{-2π θ0 S ψ} is the transform of s / (2π (θ² + s²)^{3/2}) with s = θ0 S. So the Hankel transform
of Wells' function is a mixture of that kernel over the distribution of S, with no oscillating integral; the single
scattering term (N = 1), which has a cusp 1/θ, is in closed form. As a function of θ / θ0 it depends on b r alone.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["WellsHalo", "wells_halo", "wells_transfer"]

_ROWS = 72
_MIN_BR, _MAX_BR = 1e-3, 40.0
_BINS_PER_UNIT, _BINS = 64, 4096
_ANGLES = 192
_MIN_T, _MAX_T = 1e-3, 200.0


def wells_transfer(br: float, frequency_cycles_rad: Array, theta0_rad: float) -> Array:
    """Halo's optical transfer function without absorption: e^{-b r} (e^{b r F(ψ)} - 1) (Wells 1973)."""
    k = 2.0 * math.pi * theta0_rad * np.maximum(frequency_cycles_rad, 1e-12)
    return math.exp(-br) * np.expm1(br * -np.expm1(-k) / k)


class WellsHalo:
    """Halo of unit light (without absorption) over b r and angle, for one θ0; beyond b r = 40 its shape is held."""

    def __init__(self, theta0_rad: float) -> None:
        """Scale the universal table to an angle."""
        self.theta0_rad = theta0_rad
        self._log_br, self._log_t, self._log_density, self._encircled = _universal()

    def density(self, br: Array, angle_rad: Array) -> Array:
        """(n, m) halo per steradian at b r (n,) and angles (m,)."""
        rows = np.array([np.interp(self._log_of(angle_rad), self._log_t, row) for row in self._log_density])
        return self._between(np.exp(rows), br) / self.theta0_rad**2

    def encircled(self, br: Array, angle_rad: Array) -> Array:
        """(n, m) halo at b r (n,) within half angles (m,)."""
        rows = np.array([np.interp(self._log_of(angle_rad), self._log_t, row) for row in self._encircled])
        return self._between(rows, br)

    def phase(self, angle_rad: Array) -> Array:
        """(m,) phase function in 1/sr at scattering angles (m,)."""
        return self.theta0_rad / (2.0 * math.pi * (angle_rad**2 + self.theta0_rad**2) ** 1.5)

    def _log_of(self, angle_rad: Array) -> Array:
        return np.log(np.clip(angle_rad / self.theta0_rad, _MIN_T, _MAX_T))

    def _between(self, rows: Array, br: Array) -> Array:
        """Linear in log b r between rows, which hold the halo per scattered energy; that itself is known exactly."""
        last = len(self._log_br) - 1
        place = (np.log(np.clip(br, _MIN_BR, _MAX_BR)) - self._log_br[0]) / (self._log_br[1] - self._log_br[0])
        row = np.minimum(place.astype(np.int64), last - 1)
        weight = (place - row)[:, None]
        return (rows[row] * (1.0 - weight) + rows[row + 1] * weight) * -np.expm1(-br)[:, None]


@lru_cache(maxsize=16)
def wells_halo(theta0_rad: float) -> WellsHalo:
    """The halo for one θ0, made once."""
    return WellsHalo(theta0_rad)


@lru_cache(maxsize=1)
def _universal() -> tuple[Array, Array, Array, Array]:
    """(log b r, log θ/θ0, log density θ0² per scattered energy, encircled share) for θ0 = 1."""
    log_br = np.linspace(math.log(_MIN_BR), math.log(_MAX_BR), _ROWS)
    t = np.exp(np.linspace(math.log(_MIN_T), math.log(_MAX_T), _ANGLES))
    br = np.exp(log_br)

    uniform = np.zeros(_BINS)
    uniform[: _BINS_PER_UNIT + 1] = 1.0 / _BINS_PER_UNIT
    uniform[[0, _BINS_PER_UNIT]] /= 2.0
    transform = np.fft.rfft(uniform)
    # Weights of S for N ≥ 2, over the scattered energy 1 - e^{-b r}.
    many = np.array([np.fft.irfft(np.exp(x * (transform - 1.0)) - math.exp(-x) * (1.0 + x * transform)) for x in br])
    scattered = -np.expm1(-br)
    many = np.maximum(many, 0.0) / scattered[:, None]
    single = br * np.exp(-br) / scattered
    s = np.arange(_BINS) / _BINS_PER_UNIT
    s[0] = 0.25 / _BINS_PER_UNIT

    root = np.hypot(t[:, None], s[None, :])
    density = many @ (s / (2.0 * math.pi * root**3)).T
    density += single[:, None] * ((1.0 / t - 1.0 / np.hypot(t, 1.0)) / (2.0 * math.pi))
    encircled = many @ (1.0 - s / root).T
    encircled += single[:, None] * (t + 1.0 - np.hypot(t, 1.0))
    return log_br, np.log(t), np.log(density), encircled
