"""The rotating beacon of paper B as data: lamp, rate, time base, and the clock by which the vehicle reads it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from auvdock.core.beacons import WavelengthNm
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive, PositiveShare, above, below, between

__all__ = ["BeaconClockCfg", "RotatingBeaconCfg"]


@dataclass(frozen=True)
class RotatingBeaconCfg(Checked):
    """A narrow beam that turns about the vertical, counter-clockwise seen from above.

    At station time t its axis points along azimuth A(t) = initial + 360° s t in the station frame, counted
    counter-clockwise from the approach axis x (paper B, section 4.1; s in revolutions per second).
    """

    position_m: tuple[float, float, float] = (-0.3, 0.0, 1.6)
    """In the station frame."""
    rate_rev_s: Annotated[float, between(0.01, 10.0)] = 0.5
    """Paper B: 0.5 rev/s."""
    initial_azimuth_deg: float = 0.0
    """Azimuth of the beam at station time 0."""
    elevation_deg: Annotated[float, above(-90.0), below(90.0)] = 0.0
    """Elevation of the beam's axis."""
    wavelength_nm: WavelengthNm = 450.0
    """Paper B: 450 nm."""
    power_w: Positive = 30.0
    """Paper B: 30 W."""
    efficiency: PositiveShare = 0.35
    """Radiant flux over electrical power, as for the other lamps."""
    divergence_deg: Annotated[float, between(0.5, 120.0)] = 10.0
    """Full angle of the beam at half of the peak intensity (paper B: 10°)."""

    def azimuth_rad(self, station_time_s: float) -> float:
        """Azimuth of the beam's axis at a station time, in (-π, π]."""
        turned = math.radians(self.initial_azimuth_deg) + math.tau * ((self.rate_rev_s * station_time_s) % 1.0)
        return math.remainder(turned, math.tau)


@dataclass(frozen=True)
class BeaconClockCfg(Checked):
    """Error of the vehicle's clock against the station's, as left over after synchronising them.

    Vehicle time = station time + offset + drift × station time + jitter, the jitter drawn anew for each reading.
    """

    offset_s: float = 0.0
    """Constant part."""
    offset_std_s: NotNegative = 0.0005
    """Standard deviation of a further constant part, drawn once an episode (network time over an acoustic or wet-mate
    link before departure: some 0.5 ms)."""
    drift_ppm: NotNegative = 1.0
    """Standard deviation of the rate error, drawn once an episode (temperature-compensated crystal: 1 ppm)."""
    jitter_s: NotNegative = 0.0002
    """Standard deviation of each time stamp (trigger and exposure of a machine-vision camera)."""
