"""Waters as measured: a and b of the Jerlov types, and of Petzold's stations, from the tables of the package `jerlov`.

Jerlov IB to 5C are Williamson & Hollins (2022), the one set in which a and b were measured. For I, IA, 7C and 9C they
had too few campaigns: these are Solonenko & Mobley (2015), who inverted Jerlov's K_d.

Petzold (1972) measured c and the volume scattering function in green, at 530 nm: b is the function's integral, a is
c - b. In blue and red nobody measured these waters. There b is that of Williamson & Hollins' types with the same b at
530 nm, between pure sea water (Morel 1974) and 5C, and beyond in 5C's proportions; what a has beyond pure water
changes over the wavelength as what K_d has beyond pure sea water does in Austin & Petzold's (1986) model. Both choices
are ours.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

import jerlov
import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.optics.bands import BANDS_NM
from auvdock.optics.photons.mixture import mixture_name

__all__ = ["MeasuredWater", "measured_names", "measured_water", "water_of_turbidity"]

_MEASURED, _INVERTED = "williamson2022", "solonenko2015"
_STATIONS = {"clear": "AUTEC 8", "coastal": "HAOCE 11", "harbour": "NUC 2200"}
_GREEN_NM = 530.0
_SLOPE_FROM_PER_M = np.array([0.06, 0.10])
"""K_d at 530 nm between which the slope of Austin and Petzold's model is taken: it is linear, and holds there."""


@dataclass(frozen=True)
class MeasuredWater:
    """What was measured of a water, in the bands of `BANDS_NM`."""

    name: str
    """Of the preset."""
    source: str
    """Authors, station, and what of it is not as printed."""
    absorption_per_m: tuple[float, float, float]
    """a."""
    scattering_per_m: tuple[float, float, float]
    """b."""
    phase_function: str | None = None
    """As in `load_phase`; None where it was not measured."""


def measured_names() -> tuple[str, ...]:
    """Jerlov "I" to "9C", then "petzold_clear", "petzold_coastal" and "petzold_harbour"."""
    return (*jerlov.get_source(_INVERTED).water_types, *(f"petzold_{name}" for name in _STATIONS))


@lru_cache(maxsize=32)
def measured_water(name: str) -> MeasuredWater:
    """A measured water by its name, one of `measured_names`."""
    if name.startswith("petzold_"):
        return _station(name.removeprefix("petzold_"))
    measured = name in jerlov.get_source(_MEASURED).water_types
    source = jerlov.get_source(_MEASURED if measured else _INVERTED)
    absorption, scattering = _jerlov_type(name, source.key)
    how = "a and b measured" if measured else "a and b inverted from Jerlov's K_d"
    return MeasuredWater(f"Jerlov {name}", f"{source.citation}: {how}", _bands(absorption), _bands(scattering))


def water_of_turbidity(turbidity_per_m: float) -> MeasuredWater:
    """The water with a beam attenuation c at 530 nm on the way over Petzold's: clear ocean, coastal ocean, harbour.

    Between two stations it is the mixture of both waters: a, b and the volume scattering function are linear in c, so
    the phase function is (b1 p1 + b2 p2) / (b1 + b2) with each station's part of b at 530 nm.

    Raises:
        ConfigError: less than the clear water's c, or more than the harbour's.
    """
    waters = [measured_water(f"petzold_{name}") for name in _STATIONS]
    c = [jerlov.petzold_scattering(station).c for station in _STATIONS.values()]
    if not c[0] <= turbidity_per_m <= c[-1]:
        raise ConfigError(
            "turbidity_per_m",
            turbidity_per_m,
            f"c at {_GREEN_NM:g} nm of {c[0]:g} 1/m, Petzold's clear ocean, to {c[-1]:g} 1/m, his harbour",
        )
    i = max(int(np.searchsorted(c, turbidity_per_m)) - 1, 0)
    t = (turbidity_per_m - c[i]) / (c[i + 1] - c[i])
    if t in (0.0, 1.0):
        return waters[i + int(t)]
    first, second = waters[i], waters[i + 1]
    absorption = (1.0 - t) * np.array(first.absorption_per_m) + t * np.array(second.absorption_per_m)
    b1, b2 = (1.0 - t) * np.array(first.scattering_per_m), t * np.array(second.scattering_per_m)
    green = BANDS_NM.index(_GREEN_NM)
    share = float(b2[green] / (b1[green] + b2[green]))
    return MeasuredWater(
        f"Petzold at {turbidity_per_m:g} 1/m",
        f"Petzold (1972): the mixture of {first.name} and {second.name} with this c at {_GREEN_NM:g} nm; see those",
        _bands(absorption),
        _bands(b1 + b2),
        mixture_name({str(first.phase_function): 1.0 - share, str(second.phase_function): share}),
    )


def _jerlov_type(name: str, source: str) -> tuple[Array, Array]:
    """A and b (3,) per band."""
    water = jerlov.water(name, source)
    with warnings.catch_warnings():
        # The package doubts the particles that Solonenko & Mobley print beside b of I and IA, not b itself.
        warnings.simplefilter("ignore", jerlov.ProvenanceWarning)
        return np.asarray(water.a(BANDS_NM)), np.asarray(water.b(BANDS_NM))


def _station(name: str) -> MeasuredWater:
    station = jerlov.petzold_scattering(_STATIONS[name])
    return MeasuredWater(
        f"Petzold {name}",
        f"Petzold (1972), SIO Ref. 72-78, station {station.station}, {station.locale}: c, b and the phase function at "
        f"{station.wavelength_nm:g} nm measured, a = c - b; b in the other bands as in Williamson & Hollins' (2022) "
        "types, a by Austin & Petzold (1986): ours",
        _bands(_absorption_from_green(station.a)),
        _bands(_scattering_from_green(station.b)),
        f"petzold-{name}",
    )


def _absorption_from_green(a_green: float) -> Array:
    """(3,) a per band from a at 530 nm: a_w(λ) + (a - a_w) M(λ) / M(530 nm)."""
    pure = np.array([float(jerlov.pure_water_absorption(nm)) for nm in BANDS_NM])
    ends = np.asarray(jerlov.kd_spectrum(_SLOPE_FROM_PER_M, _GREEN_NM, BANDS_NM))
    slope = (ends[1] - ends[0]) / (_SLOPE_FROM_PER_M[1] - _SLOPE_FROM_PER_M[0])
    return pure + (a_green - pure[BANDS_NM.index(_GREEN_NM)]) * slope


def _scattering_from_green(b_green: float) -> Array:
    """(3,) b per band from b at 530 nm."""
    pure = np.asarray(jerlov.pure_water_scattering(BANDS_NM))
    types = jerlov.get_source(_MEASURED).water_types
    known = np.array([pure, *(_jerlov_type(name, _MEASURED)[1] for name in types)])
    at = known[:, BANDS_NM.index(_GREEN_NM)]
    return np.array([np.interp(b_green, at, band) for band in known.T]) * max(b_green / at[-1], 1.0)


def _bands(values: Array) -> tuple[float, float, float]:
    blue, green, red = values.tolist()
    return blue, green, red
