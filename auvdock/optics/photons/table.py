"""The halo by photons, read from a table that ships with auvdock.

A table holds the logarithm of the halo within a cone about an isotropic lamp over the logarithms of b r, of a / b and
of the half angle, with its standard error, for one phase function. Over b r and a / b it is read by cubics through four
neighbours, over the angle by a monotone cubic (Fritsch & Carlson 1980), so more angle never holds less light.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from auvdock.assets import asset, asset_names
from auvdock.core.arrays import Array, IntArray
from auvdock.core.errors import ConfigError
from auvdock.optics.photons.making import ABSORPTION, ANGLE_RAD, RADIUS, HaloGrid
from auvdock.optics.photons.mixture import shares_of
from auvdock.optics.water import WELLS, WaterCfg
from auvdock.optics.wells import wells_halo

__all__ = ["PhotonHalo", "halo_names", "load_halo", "photon_halo_of", "read_halo", "save_halo"]

_FARTHEST = 60.0
"""b r up to which a reading is extrapolated."""
_EVEN_RAD = math.radians(5.0)


@dataclass(frozen=True, eq=False)
class PhotonHalo:
    """Light scattered on its way from an isotropic lamp, by single photons.

    All is over what would arrive by inverse square alone, and over e^{-a r}: times e^{-a r}, plus the unscattered
    e^{-(a + b) r} in the lamp's own direction, it is the light that arrives within the cone.

    Below b r = 0.02 the halo over b r goes on as its first rows do: off by 0.4 % for a / b up to 1, 2 % at 10, 8 % at
    100. Inside 0.02° it is a power law of the angle: off by 2 % at 0.005°. From b r = 40 to 60 its logarithm goes on in
    a straight line, as diffuse light does: off by up to 6 % at 50 and 20 % at 60 within 5° and more. Above a / b = 100
    it goes on in a straight line over the logarithm of a / b: off by 3 % at 1000 and 6 % at 10,000, while e^{-20}
    of the light is left. Beyond b r = 60, below a / b = 0.01 and beyond 90° a reading is refused.
    """

    phase: str
    """Name of the phase function."""
    photons: int
    """Photons behind it."""
    log_br: Array
    """(n,) logarithm of b r, evenly spaced."""
    log_absorption: Array
    """(k,) logarithm of a / b, evenly spaced."""
    log_angle: Array
    """(m,) logarithm of the half angle in rad."""
    log_within: Array
    """(n, k, m) logarithm of the halo."""
    error: Array
    """(n, k, m) its standard error, relative to the halo."""

    def within(self, br: float, absorption: float, angle_rad: Array) -> Array:
        """(j,) halo within half angles (j,) of 0 to π / 2.

        Args:
            br: scattering b r.
            absorption: a / b.
            angle_rad: (j,) half angles.

        Raises:
            ConfigError: beyond the table.
        """
        return self.read(np.array([br]), absorption, angle_rad)[0][0]

    def radiance(self, br: float, absorption: float, angle_rad: Array) -> Array:
        """(j,) halo per steradian at angles (j,) above 0 off the lamp: the derivative of `within`."""
        return self.read(np.array([br]), absorption, angle_rad)[1][0]

    def read(self, br: Array, absorption: float, angle_rad: Array) -> tuple[Array, Array]:
        """(n, j) `within` and (n, j) `radiance` at many b r (n,)."""
        rows = self._curves(br, absorption)
        self._check_angles(angle_rad)
        curves = PchipInterpolator(self.log_angle, rows, axis=1)
        angle = np.maximum(angle_rad, 1e-30)
        at = np.log(angle)
        inside, held = at < self.log_angle[0], np.maximum(at, self.log_angle[0])
        power = (rows[:, 1:2] - rows[:, :1]) / (self.log_angle[1] - self.log_angle[0])
        within = np.exp(curves(held) + power * np.minimum(at - self.log_angle[0], 0.0))
        slope = np.where(inside, power, curves(held, 1))
        return within, within * slope / (2.0 * math.pi * np.sin(angle) * angle)

    def standard_error(self, br: float, absorption: float, angle_rad: Array) -> Array:
        """(j,) standard error of `within` relative to it, for the number of photons; that of the nearest rows."""
        self._check_depth(np.array([br]), absorption)
        self._check_angles(angle_rad)
        i = int(np.argmin(np.abs(self.log_br - math.log(br))))
        j = int(np.argmin(np.abs(self.log_absorption - math.log(absorption))))
        return np.interp(np.log(np.maximum(angle_rad, 1e-30)), self.log_angle, self.error[i, j])

    def _check_depth(self, br: Array, absorption: float) -> None:
        low = math.exp(self.log_absorption[0])
        if not low * (1 - 1e-9) <= absorption < math.inf:
            raise ConfigError("halo.absorption_over_scattering", absorption, f"a finite a / b of at least {low:g}")
        for value in br.tolist():
            if not 0.0 < value <= _FARTHEST:
                raise ConfigError("halo.scattering_depth", value, f"b r above 0 and up to {_FARTHEST:g}")

    def _curves(self, br: Array, absorption: float) -> Array:
        """Logarithm of the halo (n, m) at the table's angles, for b r (n,)."""
        self._check_depth(br, absorption)
        table_br = np.exp(self.log_br)
        j, v = self._absorption_neighbours(math.log(absorption))
        table = np.einsum("j,ijm->im", v, self.log_within[:, j : j + 4])
        i, u = _neighbours(self.log_br, np.log(np.clip(br, table_br[0], table_br[-1])))
        rows = np.einsum("ni,nim->nm", u, table[i[:, None] + np.arange(4)])
        # Below: halo over b r, of which the logarithm is straight where all is scattered once.
        first = (table[1] - table[0] - math.log(table_br[1] / table_br[0])) / (table_br[1] - table_br[0])
        below = np.minimum(br, table_br[0])[:, None]
        rows += first * (below - table_br[0]) + np.log(below / table_br[0])
        # Beyond: further in, radiance is even and its fall with b r the same, but the photons are too few to tell it.
        last = (table[-1] - table[-2]) / (table_br[-1] - table_br[-2])
        even = int(np.searchsorted(self.log_angle, math.log(_EVEN_RAD)))
        last[:even] = last[even]
        rows += last * np.maximum(br - table_br[-1], 0.0)[:, None]
        # Rounding and noise must not take light away from a wider cone.
        return np.maximum.accumulate(rows, axis=1)

    def _absorption_neighbours(self, at: float) -> tuple[int, Array]:
        """Four neighbours over log a / b; beyond the last, weights of the straight line through the last two."""
        last, before = self.log_absorption[-1], self.log_absorption[-2]
        if at <= last:
            first, weights = _neighbours(self.log_absorption, np.array([at]))
            return int(first[0]), weights[0]
        t = (at - last) / (last - before)
        return len(self.log_absorption) - 4, np.array([0.0, 0.0, -t, 1.0 + t])

    def _check_angles(self, angle_rad: Array) -> None:
        if not (np.all(angle_rad >= 0.0) and np.all(angle_rad <= math.pi / 2.0 + 1e-12)):
            raise ConfigError("halo.angle_rad", angle_rad, "half angles of 0 to π / 2")


def halo_names() -> tuple[str, ...]:
    """Phase functions whose halo ships with auvdock."""
    return asset_names("halos", ".npz")


@lru_cache(maxsize=8)
def load_halo(name: str) -> PhotonHalo:
    """The halo of a phase function, as it ships; of a mixture, from those of its parts.

    Its logarithm is taken to be linear in the shares of b. For halves of Petzold's clear and coastal function that is
    off by up to 5 % to b r = 7, 7 % to 14 and 14 % at 20; of the coastal and harbour one, 3 %, 5 % and 8 % (rms over
    a / b 0.05 to 1 and 0.2° to 40°: 2.9 % and 1.5 %).

    Raises:
        ConfigError: none of that name, or a mixture of which a part has none.
    """
    shares = shares_of(name)
    if len(shares) == 1:
        return read_halo(asset("halos", name, ".npz"))
    return _mixed(name, shares)


def photon_halo_of(water: WaterCfg) -> PhotonHalo:
    """The halo in a water: of its phase function, or Wells' model if it names that."""
    return _wells(water.scattering_angle_rad) if water.phase == WELLS else load_halo(water.phase)


def save_halo(grid: HaloGrid, path: Path) -> None:
    """Write a table: four bytes a value, two for its error.

    Raises:
        ConfigError: a file that cannot be written.
    """
    try:
        np.savez_compressed(
            path,
            phase=grid.phase,
            photons=grid.photons,
            scattering_depth=RADIUS,
            absorption_over_scattering=ABSORPTION,
            angle_rad=ANGLE_RAD,
            log_within=grid.log_within.astype(np.float32),
            standard_error=grid.error.astype(np.float16),
        )
    except OSError as error:
        raise ConfigError("make_table", str(path), f"a file that can be written ({error.strerror})") from error


def read_halo(path: Path | Traversable) -> PhotonHalo:
    """A table as `save_halo` wrote it."""
    with path.open("rb") as file, np.load(file) as data:
        return PhotonHalo(
            phase=str(data["phase"]),
            photons=int(data["photons"]),
            log_br=np.log(data["scattering_depth"]),
            log_absorption=np.log(data["absorption_over_scattering"]),
            log_angle=np.log(data["angle_rad"]),
            log_within=data["log_within"].astype(float),
            error=data["standard_error"].astype(float),
        )


def _mixed(name: str, shares: Mapping[str, float]) -> PhotonHalo:
    parts = [load_halo(part) for part in shares]
    weights = np.array(list(shares.values()))
    return PhotonHalo(
        phase=name,
        photons=min(part.photons for part in parts),
        log_br=parts[0].log_br,
        log_absorption=parts[0].log_absorption,
        log_angle=parts[0].log_angle,
        log_within=np.einsum("p,pijk->ijk", weights, [part.log_within for part in parts]),
        error=np.sqrt(np.einsum("p,pijk->ijk", weights**2, [part.error**2 for part in parts])),
    )


@lru_cache(maxsize=8)
def _wells(theta0_rad: float) -> PhotonHalo:
    within = np.log(wells_halo(theta0_rad).encircled(RADIUS, ANGLE_RAD))
    table = np.repeat(within[:, None, :], len(ABSORPTION), axis=1)
    return PhotonHalo(WELLS, 0, np.log(RADIUS), np.log(ABSORPTION), np.log(ANGLE_RAD), table, np.zeros_like(table))


def _neighbours(even: Array, at: Array) -> tuple[IntArray, Array]:
    """First of four neighbours (n,) on an even grid and their weights (n, 4) in the cubics through them."""
    place = (at - even[0]) / (even[1] - even[0])
    first = np.clip(place.astype(np.int64) - 1, 0, len(even) - 4)
    t = place - first
    weights = [
        -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
        t * (t - 2.0) * (t - 3.0) / 2.0,
        -t * (t - 1.0) * (t - 3.0) / 2.0,
        t * (t - 1.0) * (t - 2.0) / 6.0,
    ]
    return first, np.stack(weights, axis=1)
