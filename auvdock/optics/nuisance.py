"""Nuisances as named levels, each with its own stream of random numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeVar, get_args

import numpy as np

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError

__all__ = [
    "LEVELS",
    "PARTS",
    "DaylightLevel",
    "FlickerLevel",
    "InterferenceLevel",
    "Level",
    "NuisanceCfg",
    "ReflectionLevel",
    "SnowLevel",
    "nuisance_preset",
    "nuisance_streams",
]

Level = Literal["none", "mild", "moderate", "severe"]
"""How hard a part makes the scene."""
LEVELS: tuple[Level, ...] = get_args(Level)
"""Names of the levels of each part."""


@dataclass(frozen=True)
class FlickerLevel:
    """Scintillation by turbulence and particles, and lamps that drop out."""

    log_std_at_10_m: float = 0.0
    """Standard deviation of ln(intensity) over 10 m; it grows with the root of range."""
    correlation_s: float = 0.1
    """Time constant of the scintillation (first-order Gauss–Markov)."""
    dropouts_per_s: float = 0.0
    """Rate at which each lamp goes dark."""
    dropout_s: float = 0.1
    """Mean length of a dropout."""


@dataclass(frozen=True)
class SnowLevel:
    """Marine snow: flakes lit by the station's lamps, and flakes that pass close before the lens."""

    flakes_per_m3: float = 0.0
    """Number density of flakes that are drawn singly."""
    diameter_m: float = 0.002
    """Typical diameter."""
    occlusions_per_s: float = 0.0
    """Rate at which something passes before a lamp."""
    occlusion_s: float = 0.15
    """Mean time that it takes."""
    occlusion_transmission: float = 0.1
    """Share of the lamp's light that still arrives."""


@dataclass(frozen=True)
class InterferenceLevel:
    """Lamps that belong to nobody: divers, other vehicles, harbour lights."""

    count: int = 0
    """Number of lamps, at fixed places about the station for an episode."""
    power_w: float = 5.0
    """Electrical power of each; same efficiency as the beacons, beams of 90° that face the approach."""


@dataclass(frozen=True)
class ReflectionLevel:
    """Mirror images of the lamps in the sea surface."""

    share: float = 0.0
    """Share of the surface that mirrors coherently; Fresnel's reflectance comes on top."""
    slope_rad: float = 0.05
    """Standard deviation of the image's jitter by waves."""


@dataclass(frozen=True)
class DaylightLevel:
    """Daylight just below the surface."""

    irradiance_w_m2: float = 0.0
    """Downwelling irradiance per band (450, 530, 620 nm; each about 80 nm wide)."""


_FLICKER = {
    "none": FlickerLevel(),
    "mild": FlickerLevel(log_std_at_10_m=0.08),
    "moderate": FlickerLevel(log_std_at_10_m=0.2, dropouts_per_s=0.05),
    "severe": FlickerLevel(log_std_at_10_m=0.4, dropouts_per_s=0.3),
}
_SNOW = {
    "none": SnowLevel(),
    "mild": SnowLevel(flakes_per_m3=2.0, occlusions_per_s=0.02),
    "moderate": SnowLevel(flakes_per_m3=10.0, occlusions_per_s=0.1),
    "severe": SnowLevel(flakes_per_m3=40.0, occlusions_per_s=0.4),
}
_INTERFERENCE = {
    "none": InterferenceLevel(),
    "mild": InterferenceLevel(count=1, power_w=3.0),
    "moderate": InterferenceLevel(count=2, power_w=5.0),
    "severe": InterferenceLevel(count=4, power_w=10.0),
}
_REFLECTION = {
    "none": ReflectionLevel(),
    "mild": ReflectionLevel(share=0.2, slope_rad=0.04),
    "moderate": ReflectionLevel(share=0.5, slope_rad=0.02),
    "severe": ReflectionLevel(share=0.9, slope_rad=0.005),
}
_DAYLIGHT = {
    "none": DaylightLevel(),
    "mild": DaylightLevel(irradiance_w_m2=0.3),
    "moderate": DaylightLevel(irradiance_w_m2=10.0),
    "severe": DaylightLevel(irradiance_w_m2=100.0),
}
_TABLES: Mapping[str, Mapping[str, object]] = {
    "flicker": _FLICKER,
    "marine_snow": _SNOW,
    "interfering_lights": _INTERFERENCE,
    "surface_reflection": _REFLECTION,
    "daylight": _DAYLIGHT,
}

PARTS = tuple(_TABLES)
"""Names of the parts, in the fixed order of their random streams."""

L = TypeVar("L")


@dataclass(frozen=True)
class NuisanceCfg(Checked):
    """What makes a scene hard, part by part; each is "none", "mild", "moderate" or "severe"."""

    flicker: Level = "none"
    """Scintillation and dropouts of the lamps."""
    marine_snow: Level = "none"
    """Flakes and passing occlusions."""
    interfering_lights: Level = "none"
    """Lamps that are not the station's."""
    surface_reflection: Level = "none"
    """The lamps' mirror images in the sea surface."""
    daylight: Level = "none"
    """Night, dusk, overcast, noon."""

    @property
    def flicker_level(self) -> FlickerLevel:
        """Figures of the level."""
        return _FLICKER[self.flicker]

    @property
    def snow_level(self) -> SnowLevel:
        """Figures of the level."""
        return _SNOW[self.marine_snow]

    @property
    def interference_level(self) -> InterferenceLevel:
        """Figures of the level."""
        return _INTERFERENCE[self.interfering_lights]

    @property
    def reflection_level(self) -> ReflectionLevel:
        """Figures of the level."""
        return _REFLECTION[self.surface_reflection]

    @property
    def daylight_level(self) -> DaylightLevel:
        """Figures of the level."""
        return _DAYLIGHT[self.daylight]


def nuisance_preset(name: str) -> NuisanceCfg:
    """All parts at one level.

    Raises:
        ConfigError: no such level.
    """
    if name not in LEVELS:
        raise ConfigError("nuisance", name, f"one of {', '.join(LEVELS)}")
    return dataclasses.replace(NuisanceCfg(), **dict.fromkeys(PARTS, name))


def nuisance_streams(rng: np.random.Generator) -> tuple[np.random.Generator, dict[str, np.random.Generator]]:
    """A stream for the sensor and one per part of `PARTS`.

    All are spawned whatever the levels, so that changing one part leaves the draws of all others as they were.
    """
    sensor, *parts = rng.spawn(1 + len(PARTS))
    return sensor, dict(zip(PARTS, parts, strict=True))
