"""Waters as data: absorption and scattering per band, and the shape of forward scattering."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from auvdock.assets import asset, asset_names
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import between
from auvdock.core.strict import load_toml, names_file
from auvdock.optics.bands import BANDS_NM, interpolate_bands
from auvdock.optics.measured_waters import MeasuredWater, measured_names, measured_water, water_of_turbidity
from auvdock.optics.photons.mixture import shares_of
from auvdock.optics.photons.phase import FOURNIER_FORAND, load_phase

__all__ = ["WELLS", "WaterCfg", "load_water", "water_names", "water_of", "with_attenuation"]

WELLS = "wells"
"""Name of Wells' (1973) model among the phase functions: kept for comparison with the halo by photons."""

_DEFAULT_PHASE = f"{FOURNIER_FORAND}0.018"
"""Phase function where none was measured; it has the backscattering of Petzold's (1972) average particle."""

_GREATEST_PER_M = 100.0
"""Of absorption and scattering: no light is left after 10 cm; the muddiest estuaries have some 50 1/m."""

_RATIO_DIGITS = 0.001
"""By how much a backscatter ratio may differ from its phase function's: as printed, it has two or three digits."""

_PerM = Annotated[float, between(0.0, _GREATEST_PER_M)]


@dataclass(frozen=True)
class WaterCfg(Checked):
    """Inherent optical properties of a homogeneous water in the bands 450, 530 and 620 nm."""

    name: str
    """Name of the preset."""
    source: str
    """Where the figures come from and which of them are interpolated."""
    absorption_per_m: tuple[_PerM, _PerM, _PerM]
    """Absorption coefficient a in 1/m per band."""
    scattering_per_m: tuple[_PerM, _PerM, _PerM]
    """Scattering coefficient b in 1/m per band."""
    scattering_angle_rad: Annotated[float, between(0.001, 0.5)] = 0.05
    """θ0 of Wells (1973), 0.02 to 0.1: one scattering event deflects by less than 1.7 θ0 half of the time. Only the
    phase function "wells" has it."""
    phase_function: str | None = None
    """How scattering is spread over angles: one of the phase functions with a table of the halo, such as
    "fournier-forand-0.018" or "petzold-harbour"; a mixture by shares of b, "0.3*petzold-clear+0.7*petzold-coastal"; or
    "wells". By default Fournier and Forand's with the backscatter ratio."""
    backscatter_ratio: Annotated[float, between(0.0, 0.5)] | None = None
    """Backward over total scattering, b_b / b: by default that of the phase function, or 0.018 (Petzold 1972, average
    particle)."""

    def __post_init__(self) -> None:
        """Refuse a phase function without a table of the halo, and a backscatter ratio that is not its own."""
        known = asset_names("halos", ".npz")
        if self.phase_function is None:
            if self.phase not in known:
                ratios = ", ".join(x.removeprefix(FOURNIER_FORAND) for x in known if x.startswith(FOURNIER_FORAND))
                remedy = f"{ratios}, of which a table of the halo ships, or none and a phase_function"
                raise ConfigError("backscatter_ratio", self.backscatter_ratio, remedy)
            return
        remedy = f"one of {', '.join(known)}, a mixture such as 0.3*petzold-clear+0.7*petzold-coastal, or {WELLS}"
        try:
            parts = shares_of(self.phase)
        except ConfigError as error:
            raise ConfigError("phase_function", self.phase, remedy) from error
        if self.phase != WELLS and not set(parts) <= set(known):
            raise ConfigError("phase_function", self.phase, remedy)
        if self.backscatter_ratio is not None and abs(self.backscatter_ratio - self._own_ratio) > _RATIO_DIGITS:
            raise ConfigError(
                "backscatter_ratio",
                self.backscatter_ratio,
                f"{self._own_ratio:.3f}, that of the phase function {self.phase!r}, or leave it out",
            )

    @property
    def phase(self) -> str:
        """Name of the phase function, as `load_phase` takes it, or "wells"."""
        if self.phase_function is not None:
            return self.phase_function
        return _DEFAULT_PHASE if self.backscatter_ratio is None else f"{FOURNIER_FORAND}{self.backscatter_ratio:.3f}"

    @property
    def _own_ratio(self) -> float:
        """b_b / b of the phase function; Wells' has no backscattering of its own and takes the default's."""
        return load_phase(_DEFAULT_PHASE if self.phase == WELLS else self.phase).backscatter_ratio

    @property
    def absorption(self) -> Array:
        """(3,) a per band, 1/m."""
        return np.array(self.absorption_per_m)

    @property
    def scattering(self) -> Array:
        """(3,) b per band, 1/m."""
        return np.array(self.scattering_per_m)

    @property
    def attenuation(self) -> Array:
        """(3,) c = a + b per band, 1/m."""
        return self.absorption + self.scattering

    @property
    def backscattering(self) -> Array:
        """(3,) b_b per band, 1/m."""
        return self.scattering * self._own_ratio

    @property
    def diffuse_attenuation(self) -> Array:
        """(3,) K_d of downwelling daylight, 1/m: √(a² + 0.256 a b) (Kirk 1984, equation 7, light from the zenith)."""
        return np.sqrt(self.absorption**2 + 0.256 * self.absorption * self.scattering)

    def absorption_at(self, wavelength_nm: float) -> float:
        """Absorption in 1/m at a wavelength, linear between the bands."""
        return interpolate_bands(self.absorption, wavelength_nm)

    def scattering_at(self, wavelength_nm: float) -> float:
        """Scattering in 1/m at a wavelength, linear between the bands."""
        return interpolate_bands(self.scattering, wavelength_nm)


def water_names() -> tuple[str, ...]:
    """Presets: the waters as measured (`measured_names`), then "clear", "lake" and "pool"."""
    return (*measured_names(), *asset_names("waters"))


def load_water(water: str | WaterCfg) -> WaterCfg:
    """A water: as it is given, of a TOML file ("my_lake.toml", written as the presets are), or a preset by name.

    Presets are Jerlov "I" to "9C", "petzold_clear", "petzold_coastal", "petzold_harbour", "clear", "pool" and "lake".

    Raises:
        ConfigError: no such preset, or a file that does not fit.
    """
    if isinstance(water, WaterCfg):
        return water
    if names_file(water):
        return load_toml(WaterCfg, Path(water))
    if water in measured_names():
        return _as_cfg(measured_water(water))
    if water not in asset_names("waters"):
        raise ConfigError("water", water, f"one of {', '.join(water_names())}, or a TOML file of yours")
    return load_toml(WaterCfg, asset("waters", water))


def water_of(
    water: str | WaterCfg, attenuation_per_m: float | None = None, turbidity_per_m: float | None = None
) -> WaterCfg:
    """The water of a world by its settings.

    Args:
        water: as `load_water` takes it.
        attenuation_per_m: c at 450 nm in its place, by more or less scattering (`with_attenuation`).
        turbidity_per_m: c at 530 nm of a water between Petzold's, in place of `water` (`water_of_turbidity`).

    Raises:
        ConfigError: a water that does not exist, a value that no such water has, or both turbidities.
    """
    if turbidity_per_m is not None:
        if attenuation_per_m is not None:
            remedy = "either it, which moves a and b as measured, or attenuation_per_m, which moves b alone"
            raise ConfigError("turbidity_per_m", turbidity_per_m, remedy)
        return _as_cfg(water_of_turbidity(turbidity_per_m))
    found = load_water(water)
    return found if attenuation_per_m is None else with_attenuation(found, attenuation_per_m)


def with_attenuation(water: WaterCfg, c_450: float) -> WaterCfg:
    """The same water more or less turbid: b is scaled in all bands so that c(450 nm) = a + b is as given.

    Turbidity moves scattering and leaves absorption alone. A water without scattering gets b ∝ 1/λ.

    Raises:
        ConfigError: below the water's absorption at 450 nm, or more in some band than any water has.
    """
    a_450, b_450 = water.absorption_per_m[0], water.scattering_per_m[0]
    b_new = c_450 - a_450
    if b_450 > 0.0:
        blue, green, red = (b * b_new / b_450 for b in water.scattering_per_m)
    else:
        blue, green, red = (b_new * BANDS_NM[0] / nm for nm in BANDS_NM)
    if not (b_new >= 0.0 and max(blue, green, red) <= _GREATEST_PER_M):
        raise ConfigError(
            "attenuation_per_m",
            c_450,
            f"a finite attenuation of at least {a_450:g} 1/m, the absorption of {water.name!r} at 450 nm, and of less "
            f"than {_GREATEST_PER_M:g} 1/m",
        )
    return dataclasses.replace(water, scattering_per_m=(blue, green, red))


def _as_cfg(measured: MeasuredWater) -> WaterCfg:
    return WaterCfg(
        measured.name,
        measured.source,
        measured.absorption_per_m,
        measured.scattering_per_m,
        phase_function=measured.phase_function,
    )
