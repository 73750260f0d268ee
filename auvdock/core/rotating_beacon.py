"""The rotating beacon of paper B as data: lamp, rate, time base, and the clock by which the vehicle reads it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.checks import check_above, check_finite
from auvdock.core.errors import ConfigError

__all__ = ["BeaconClockCfg", "RotatingBeaconCfg"]


@dataclass(frozen=True)
class RotatingBeaconCfg:
    """A narrow beam that turns about the vertical, counter-clockwise seen from above.

    At station time t its axis points along azimuth A(t) = initial + 360° s t in the station frame, counted
    counter-clockwise from the approach axis x (paper B, section 4.1; s in revolutions per second).
    """

    position_m: tuple[float, float, float] = (-0.3, 0.0, 1.6)
    """In the station frame."""
    rate_rev_s: float = 0.5
    """Paper B: 0.5 rev/s."""
    initial_azimuth_deg: float = 0.0
    """Azimuth of the beam at station time 0."""
    elevation_deg: float = 0.0
    """Elevation of the beam's axis."""
    wavelength_nm: float = 450.0
    """Paper B: 450 nm."""
    power_w: float = 30.0
    """Paper B: 30 W."""
    efficiency: float = 0.35
    """Radiant flux over electrical power, as for the other lamps."""
    divergence_deg: float = 10.0
    """Full angle of the beam at half of the peak intensity (paper B: 10°)."""

    def __post_init__(self) -> None:
        """Refuse what no beacon can be."""
        if not 0.01 <= self.rate_rev_s <= 10.0:
            raise ConfigError("rate_rev_s", self.rate_rev_s, "a rate of 0.01 to 10 revolutions a second")
        if not 0.5 <= self.divergence_deg <= 120.0:
            raise ConfigError("divergence_deg", self.divergence_deg, "a full angle of 0.5 to 120 degrees")
        if not 380.0 <= self.wavelength_nm <= 720.0:
            raise ConfigError("wavelength_nm", self.wavelength_nm, "a visible wavelength, 380 to 720 nm")
        check_finite("position_m", self.position_m, "three finite coordinates")
        check_finite("initial_azimuth_deg", (self.initial_azimuth_deg,), "a finite angle")
        check_above("power_w", self.power_w, 0.0, "a power above 0 W")
        if not 0.0 < self.efficiency <= 1.0:
            raise ConfigError("efficiency", self.efficiency, "a fraction above 0 and up to 1")
        if not -90.0 < self.elevation_deg < 90.0:
            raise ConfigError("elevation_deg", self.elevation_deg, "above -90 and below 90 degrees")

    def azimuth_rad(self, station_time_s: float) -> float:
        """Azimuth of the beam's axis at a station time, in (-π, π]."""
        turned = math.radians(self.initial_azimuth_deg) + math.tau * ((self.rate_rev_s * station_time_s) % 1.0)
        return math.remainder(turned, math.tau)


@dataclass(frozen=True)
class BeaconClockCfg:
    """Error of the vehicle's clock against the station's, as left over after synchronising them.

    Vehicle time = station time + offset + drift × station time + jitter, the jitter drawn anew for each reading.
    """

    offset_s: float = 0.0
    """Constant part."""
    offset_std_s: float = 0.0005
    """Standard deviation of a further constant part, drawn once an episode (network time over an acoustic or wet-mate
    link before departure: some 0.5 ms)."""
    drift_ppm: float = 1.0
    """Standard deviation of the rate error, drawn once an episode (temperature-compensated crystal: 1 ppm)."""
    jitter_s: float = 0.0002
    """Standard deviation of each time stamp (trigger and exposure of a machine-vision camera)."""

    def __post_init__(self) -> None:
        """Refuse negative deviations."""
        if not math.isfinite(self.offset_s):
            raise ConfigError("offset_s", self.offset_s, "a finite time")
        for name in ("offset_std_s", "drift_ppm", "jitter_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ConfigError(name, getattr(self, name), "0 or more")
