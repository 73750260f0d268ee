"""The halo: small-angle scattering point spread function of Wells (1973).

Whoever asks how much scattered light arrives, and from where, asks `halo_of`: renderer, `beacons` fidelity, rotating
beacon and planners. Only that it holds 1 - e^{-b r} of what absorption leaves is known to `optics.arrival` as well.

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

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.records import Records
from auvdock.optics.spread import HaloPlaces, place_in_halo
from auvdock.optics.water import WaterCfg

__all__ = ["HaloTable", "halo_of", "halo_table", "wells_transfer"]

_ROWS = 72
_MIN_BR, _MAX_BR = 1e-3, 40.0
_BINS_PER_UNIT, _BINS = 64, 4096
_ANGLES = 192
_MIN_T, _MAX_T = 1e-3, 200.0


def wells_transfer(br: float, frequency_cycles_rad: Array, theta0_rad: float) -> Array:
    """Halo's optical transfer function without absorption: e^{-b r} (e^{b r F(ψ)} - 1) (Wells 1973)."""
    k = 2.0 * math.pi * theta0_rad * np.maximum(frequency_cycles_rad, 1e-12)
    return math.exp(-br) * np.expm1(br * -np.expm1(-k) / k)


class HaloTable:
    """Halo of unit light (without absorption) over b r and angle, for one θ0.

    The whole halo holds 1 - e^{-b r}. Beyond b r = 40 the table is held constant in shape.

    Attributes:
        places: where in the table which b r is, one row.
    """

    def __init__(self, theta0_rad: float) -> None:
        """Scale the universal table to an angle."""
        self.theta0_rad = theta0_rad
        log_br, self._log_t, self._log_density, self._encircled = _universal()
        places = HaloPlaces(log_br[0], 1.0 / (log_br[1] - log_br[0]), _MIN_BR, 0.999 * _MAX_BR)
        self.places: Records[HaloPlaces] = places.packed()

    def density_rows(self, angle_rad: Array) -> Array:
        """(rows, m) halo per steradian at fixed angles (m,), one row per tabulated b r; see `row_of`."""
        t = np.log(np.clip(angle_rad / self.theta0_rad, _MIN_T, _MAX_T))
        rows = np.exp(np.array([np.interp(t, self._log_t, row) for row in self._log_density]))
        return rows / self.theta0_rad**2

    def encircled_rows(self, angle_rad: Array) -> Array:
        """(rows, m) halo within a cone of half angle (m,), one row per tabulated b r."""
        t = np.log(np.clip(angle_rad / self.theta0_rad, _MIN_T, _MAX_T))
        return np.array([np.interp(t, self._log_t, row) for row in self._encircled])

    def scattered(self, br: Array) -> Array:
        """(n,) the whole halo at b r (n,): 1 - e^{-b r}."""
        return -np.expm1(-br)

    def transfer(self, br: float, frequency_cycles_rad: Array) -> tuple[Array, Array]:
        """Optical transfer function (m,) at frequencies (m,), and its derivative by the frequency."""
        k = 2.0 * math.pi * self.theta0_rad * frequency_cycles_rad
        mean = -np.expm1(-k) / k
        slope = (
            2.0 * math.pi * self.theta0_rad * br * np.exp(br * (mean - 1.0)) * (k * np.exp(-k) + np.expm1(-k)) / k**2
        )
        return wells_transfer(br, frequency_cycles_rad, self.theta0_rad), slope

    def row_of(self, br: Array) -> tuple[IntArray, Array]:
        """Row (n,) below each b r (n,) and the weight (n,) of the row above: linear in log b r."""
        return place_in_halo(br, self.places)

    def density(self, br: float, angle_rad: Array) -> Array:
        """(m,) halo per steradian at angles (m,) for one b r."""
        return self._one(self.density_rows(angle_rad), br)

    def encircled(self, br: float, angle_rad: Array) -> Array:
        """(m,) halo within half angles (m,) for one b r."""
        return self._one(self.encircled_rows(angle_rad), br)

    def _one(self, rows: Array, br: float) -> Array:
        row, weight = self.row_of(np.array([br]))
        blend = rows[row[0]] * (1.0 - weight[0]) + rows[row[0] + 1] * weight[0]
        # Rows hold the halo per scattered energy, which itself is known exactly.
        return blend * -math.expm1(-br)


def halo_of(water: WaterCfg) -> HaloTable:
    """The halo in a water."""
    return halo_table(water.scattering_angle_rad)


@lru_cache(maxsize=16)
def halo_table(theta0_rad: float) -> HaloTable:
    """The table for one θ0, made once."""
    return HaloTable(theta0_rad)


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
