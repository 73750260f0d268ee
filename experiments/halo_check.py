"""The halo's table, and Wells' model, against photons sent out afresh; and one water at one range."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.errors import ConfigError
from auvdock.optics.photons.making import left_after, ring_radiance
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.table import load_halo, photon_halo_of
from auvdock.optics.photons.walk import Tally, shoot
from auvdock.optics.water import WaterCfg
from auvdock.optics.wells import wells_halo

__all__ = ["CHECKED_A_B", "CHECKED_BR", "HALF_ANGLES_DEG", "PHASES", "HaloCase", "HaloCheck", "check_halo", "halo_case"]

PHASES = ("fournier-forand-0.018", "petzold-coastal", "petzold-harbour")
"""Phase functions of the check."""
CHECKED_BR = (0.5, 1.0, 2.0, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0)
"""b r of the check; none is one of the table's own, so that reading between those is checked too."""
CHECKED_A_B = (0.05, 0.1, 0.2, 0.5, 1.0)
"""a / b of the check."""
HALF_ANGLES_DEG = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0)
"""Half angles of all readings."""
WELLS_RAD = (0.02, 0.03, 0.05)
"""θ0 of the pool, of clear water, of all others."""

_EDGES_DEG = (0.2, 0.5, 1.0, 2.0, 5.0, *np.arange(10.0, 41.0, 2.5).tolist(), 90.0)
_BATCHES = 10


@dataclass(frozen=True, eq=False)
class HaloCheck:
    """Halo of one phase function within `HALF_ANGLES_DEG`, over what arrives by inverse square alone and e^{-a r}.

    Arrays are (b r, a / b, half angle).
    """

    phase: str
    """Name of the phase function."""
    photons: int
    """Photons sent out."""
    fresh: Array
    """What they say, single scattering included."""
    error: Array
    """Standard error of that, relative to it."""
    table: Array
    """What the table says."""
    table_error: Array
    """Standard error of that, relative to it."""
    wells: Array
    """(θ0, b r, half angle) what Wells' function says, which knows no a / b."""

    @property
    def judged(self) -> BoolArray:
        """Where three standard errors of the photons are 10 % or less."""
        return self.error <= 0.1 / 3.0

    @property
    def ratio(self) -> Array:
        """Table over photons."""
        return self.table / self.fresh


def check_halo(name: str, photons: int, seed: int, told: Callable[[], object]) -> HaloCheck:
    """Send photons through a phase function and read its table at the same places.

    Args:
        name: of the phase function.
        photons: how many, in ten batches of the same size.
        seed: other than the table's, which is 0.
        told: called after each batch.
    """
    phase, angle = load_phase(name), np.radians(_EDGES_DEG)
    angle[-1] = math.pi / 2.0
    batches: list[Array] = []
    for rng in np.random.default_rng([seed, 1]).spawn(_BATCHES):
        batches.append(_within(shoot(phase, photons // _BATCHES, np.array(CHECKED_BR), angle, rng)))
        told()
    wanted = [_EDGES_DEG.index(degrees) for degrees in HALF_ANGLES_DEG]
    stack = np.array(batches)[..., wanted]
    fresh = stack.mean(axis=0)
    with np.errstate(invalid="ignore"):
        error = stack.std(axis=0, ddof=1) / math.sqrt(_BATCHES) / fresh
    halo, read = load_halo(name), np.radians(HALF_ANGLES_DEG)
    table = [[halo.within(br, x, read) for x in CHECKED_A_B] for br in CHECKED_BR]
    table_error = [[halo.standard_error(br, x, read) for x in CHECKED_A_B] for br in CHECKED_BR]
    wells = [wells_halo(theta0).encircled(np.array(CHECKED_BR), read) for theta0 in WELLS_RAD]
    return HaloCheck(
        name,
        photons // _BATCHES * _BATCHES,
        fresh,
        np.nan_to_num(error, nan=np.inf),
        np.array(table),
        np.array(table_error),
        np.array(wells),
    )


def _within(tally: Tally) -> Array:
    """(n, k, m) halo within the tally's angles for `CHECKED_A_B`."""
    facing, solid = ring_radiance(tally.angle_rad)
    counts = (tally.once + tally.more).astype(float)
    crossed = np.einsum("nme,ke->nkm", counts, left_after(np.array(CHECKED_A_B)), optimize=True)
    return np.cumsum(crossed / tally.photons * (solid / facing), axis=-1)


@dataclass(frozen=True, eq=False)
class HaloCase:
    """One water at one range and wavelength: all over what would arrive by inverse square alone without water."""

    phase: str
    """Name of the phase function."""
    absorption_per_m: float
    """a."""
    scattering_per_m: float
    """b."""
    scattering_depth: float
    """b r."""
    core: float
    """Light that was not scattered, e^{-(a + b) r}."""
    halo: Array
    """(8,) scattered light within `HALF_ANGLES_DEG`, by the table."""
    error: Array
    """(8,) its standard error, relative to it."""
    wells: Array
    """(8,) the same by Wells' function."""


def halo_case(water: WaterCfg, range_m: float, wavelength_nm: float) -> HaloCase:
    """What arrives of an isotropic lamp.

    Args:
        water: any.
        range_m: distance to the lamp, above 0.
        wavelength_nm: of the lamp; a and b are linear between the bands.

    Raises:
        ConfigError: a range or a wavelength that makes no sense, or beyond the table.
    """
    if not (math.isfinite(range_m) and range_m > 0.0):
        raise ConfigError("range", range_m, "a finite distance above 0 m")
    if not 400.0 <= wavelength_nm <= 700.0:
        raise ConfigError("wavelength_nm", wavelength_nm, "visible light, 400 to 700 nm")
    a, b = water.absorption_at(wavelength_nm), water.scattering_at(wavelength_nm)
    if b <= 0.0:
        raise ConfigError("attenuation", a + b, "more than the water's absorption: what does not scatter has no halo")
    angle, left = np.radians(HALF_ANGLES_DEG), math.exp(-a * range_m)
    halo = photon_halo_of(water)
    return HaloCase(
        phase=halo.phase,
        absorption_per_m=a,
        scattering_per_m=b,
        scattering_depth=b * range_m,
        core=left * math.exp(-b * range_m),
        halo=left * halo.within(b * range_m, a / b, angle),
        error=halo.standard_error(b * range_m, a / b, angle),
        wells=left * wells_halo(water.scattering_angle_rad).encircled(np.array([b * range_m]), angle)[0],
    )
