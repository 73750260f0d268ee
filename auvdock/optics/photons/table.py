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
from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.optics.photons.making import ABSORPTION, ANGLE_RAD, RADIUS, HaloGrid
from auvdock.optics.photons.mixture import shares_of
from auvdock.optics.photons.wells import wells_within
from auvdock.optics.water import WELLS, WaterCfg

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
        rows = self._curve(br, absorption)
        self._check_angles(angle_rad)
        slope = (rows[1] - rows[0]) / (self.log_angle[1] - self.log_angle[0])
        at = np.log(np.maximum(angle_rad, 1e-30))
        inner = np.minimum(at - self.log_angle[0], 0.0)
        return np.exp(self._angular(rows)(np.maximum(at, self.log_angle[0])) + slope * inner)

    def radiance(self, br: float, absorption: float, angle_rad: Array) -> Array:
        """(j,) halo per steradian at angles (j,) above 0 off the lamp: the derivative of `within`."""
        rows = self._curve(br, absorption)
        curve = self._angular(rows)
        at = np.log(angle_rad)
        slope = np.where(
            at < self.log_angle[0],
            (rows[1] - rows[0]) / (self.log_angle[1] - self.log_angle[0]),
            curve.derivative()(np.maximum(at, self.log_angle[0])),
        )
        ring = 2.0 * math.pi * np.sin(angle_rad) * angle_rad
        return self.within(br, absorption, angle_rad) * slope / ring

    def standard_error(self, br: float, absorption: float, angle_rad: Array) -> Array:
        """(j,) standard error of `within` relative to it, for the number of photons; that of the nearest rows."""
        self._curve(br, absorption)
        self._check_angles(angle_rad)
        i = int(np.argmin(np.abs(self.log_br - math.log(br))))
        j = int(np.argmin(np.abs(self.log_absorption - math.log(absorption))))
        return np.interp(np.log(np.maximum(angle_rad, 1e-30)), self.log_angle, self.error[i, j])

    def _curve(self, br: float, absorption: float) -> Array:
        """Logarithm of the halo (m,) at the table's angles."""
        low = math.exp(self.log_absorption[0])
        if not low * (1 - 1e-9) <= absorption < math.inf:
            raise ConfigError("halo.absorption_over_scattering", absorption, f"a finite a / b of at least {low:g}")
        if not 0.0 < br <= _FARTHEST:
            raise ConfigError("halo.scattering_depth", br, f"b r above 0 and up to {_FARTHEST:g}")
        table_br = np.exp(self.log_br)
        i, u = _neighbours(self.log_br, math.log(min(max(br, table_br[0]), table_br[-1])))
        j, v = self._absorption_neighbours(math.log(absorption))
        rows = np.einsum("i,j,ijm->m", u, v, self.log_within[i : i + 4, j : j + 4])
        if br < table_br[0]:  # halo over b r, of which the logarithm is straight where all is scattered once
            first, second = np.einsum("j,ijm->im", v, self.log_within[:2, j : j + 4])
            slope = (second - first - math.log(table_br[1] / table_br[0])) / (table_br[1] - table_br[0])
            rows = rows + slope * (br - table_br[0]) + math.log(br / table_br[0])
        elif br > table_br[-1]:
            before, last = np.einsum("j,ijm->im", v, self.log_within[-2:, j : j + 4])
            slope = (last - before) / (table_br[-1] - table_br[-2])
            # Further in, radiance is even and its fall with b r the same, but the photons are too few to tell it.
            even = int(np.searchsorted(self.log_angle, math.log(_EVEN_RAD)))
            slope[:even] = slope[even]
            rows = rows + slope * (br - table_br[-1])
        # Rounding and noise must not take light away from a wider cone.
        return np.maximum.accumulate(rows)

    def _absorption_neighbours(self, at: float) -> tuple[int, Array]:
        """Four neighbours over log a / b; beyond the last, weights of the straight line through the last two."""
        last, before = self.log_absorption[-1], self.log_absorption[-2]
        if at <= last:
            return _neighbours(self.log_absorption, at)
        t = (at - last) / (last - before)
        return len(self.log_absorption) - 4, np.array([0.0, 0.0, -t, 1.0 + t])

    def _angular(self, rows: Array) -> PchipInterpolator:
        return PchipInterpolator(self.log_angle, rows)

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
    within = np.log(wells_within(theta0_rad, RADIUS, ANGLE_RAD))
    table = np.repeat(within[:, None, :], len(ABSORPTION), axis=1)
    return PhotonHalo(WELLS, 0, np.log(RADIUS), np.log(ABSORPTION), np.log(ANGLE_RAD), table, np.zeros_like(table))


def _neighbours(even: Array, at: float) -> tuple[int, Array]:
    """First of four neighbours on an even grid and their weights (4,) in the cubic through them."""
    place = (at - even[0]) / (even[1] - even[0])
    first = min(max(int(place) - 1, 0), len(even) - 4)
    t = place - first
    weights = [
        -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0,
        t * (t - 2.0) * (t - 3.0) / 2.0,
        -t * (t - 1.0) * (t - 3.0) / 2.0,
        t * (t - 1.0) * (t - 2.0) / 6.0,
    ]
    return first, np.array(weights)
