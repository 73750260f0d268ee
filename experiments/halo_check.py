"""The halo's table, and Wells' model, against photons sent out afresh; and one water at one range."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.errors import ConfigError
from auvdock.optics.photons.beam import arriving
from auvdock.optics.photons.beam_walk import ARRIVAL_DEG, LEFT_DEG, BeamTally, shoot_beams
from auvdock.optics.photons.making import BATCHES
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.table import load_halo, photon_halo_of
from auvdock.optics.water import WaterCfg
from auvdock.optics.wells import wells_halo

__all__ = [
    "CHECKED_A_B",
    "CHECKED_BR",
    "HALF_ANGLES_DEG",
    "PHASES",
    "READ",
    "WELLS_RAD",
    "HaloCase",
    "HaloCheck",
    "check_halo",
    "halo_case",
    "mean_and_error",
    "send_batches",
    "send_photons",
]

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

READ = [ARRIVAL_DEG.index(degrees) for degrees in HALF_ANGLES_DEG]
"""Where the half angles stand among the photons' bins."""


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


def send_photons(name: str, photons: int, seed: int, told: Callable[[], object]) -> list[BeamTally]:
    """Photons through a phase function at `CHECKED_BR` and `CHECKED_A_B`, in ten batches of the same size.

    Args:
        name: of the phase function.
        photons: how many.
        seed: of their own stream, which is no table's.
        told: called after each batch.
    """
    return send_batches(name, photons, seed, (np.array(CHECKED_BR), np.array(CHECKED_A_B)), told)


def send_batches(
    name: str, photons: int, seed: int, at: tuple[Array, Array], told: Callable[[], object]
) -> list[BeamTally]:
    """As `send_photons`, at b r (n,) and a / b (k,)."""
    br, absorption = at
    phase, outer = load_phase(name), max(60.0, 1.5 * float(br.max()))
    batches: list[BeamTally] = []
    for rng in np.random.default_rng([seed, 1]).spawn(BATCHES):
        batches.append(shoot_beams(phase, photons // BATCHES, br, absorption, rng, outer))
        told()
    return batches


def mean_and_error(batches: Sequence[Array]) -> tuple[Array, Array]:
    """Mean of batches and its standard error relative to it, infinite where the mean is 0."""
    mean = np.mean(batches, axis=0)
    with np.errstate(invalid="ignore"):
        error = np.std(batches, axis=0, ddof=1) / math.sqrt(len(batches)) / mean
    return mean, np.nan_to_num(error, nan=np.inf)


def check_halo(name: str, batches: Sequence[BeamTally]) -> HaloCheck:
    """Hold the table of a phase function and Wells' function to photons at the same places.

    Args:
        name: of the phase function.
        batches: of `send_photons`.
    """
    alike = np.ones((len(LEFT_DEG), 1))
    fresh, error = mean_and_error([arriving(tally, alike)[:, :, 0, READ] for tally in batches])
    halo, read = load_halo(name), np.radians(HALF_ANGLES_DEG)
    table = [[halo.within(br, x, read) for x in CHECKED_A_B] for br in CHECKED_BR]
    table_error = [[halo.standard_error(br, x, read) for x in CHECKED_A_B] for br in CHECKED_BR]
    wells = [wells_halo(theta0).encircled(np.array(CHECKED_BR), read) for theta0 in WELLS_RAD]
    photons = sum(tally.photons for tally in batches)
    return HaloCheck(name, photons, fresh, error, np.array(table), np.array(table_error), np.array(wells))


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
