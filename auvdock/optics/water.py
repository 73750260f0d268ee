"""Waters as data: absorption and scattering per band, and the shape of forward scattering."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from auvdock.assets import asset
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import between
from auvdock.core.strict import load_toml, names_file
from auvdock.optics.bands import BANDS_NM, interpolate_bands

__all__ = ["WaterCfg", "load_water", "with_attenuation"]

_GREATEST_PER_M = 100.0
"""Of absorption and scattering: no light is left after 10 cm; the muddiest estuaries have some 50 1/m."""

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
    """θ0 of Wells (1973), 0.02 to 0.1: one scattering event deflects by less than 1.7 θ0 half of the time."""
    backscatter_ratio: Annotated[float, between(0.0, 0.5)] = 0.018
    """Backward over total scattering, b_b / b (Petzold 1972, average particle)."""

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
        return self.scattering * self.backscatter_ratio

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


def load_water(water: str | WaterCfg) -> WaterCfg:
    """A water: as it is given, of a TOML file ("my_lake.toml", written as the presets are), or a preset by name.

    Presets are Jerlov "I" to "9C", "clear", "pool" and "lake".

    Raises:
        ConfigError: no such preset, or a file that does not fit.
    """
    if isinstance(water, WaterCfg):
        return water
    if names_file(water):
        return load_toml(WaterCfg, Path(water))
    try:
        return load_toml(WaterCfg, asset("waters", water))
    except ConfigError as error:
        raise ConfigError(error.field, error.value, f"{error.remedy}, or a TOML file of yours") from error


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
