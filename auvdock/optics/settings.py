"""Settings of the simulated camera: optics, sensor, auto-exposure and what is drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.errors import ConfigError

__all__ = ["ExposureCfg", "ImagingCfg"]


@dataclass(frozen=True)
class ExposureCfg:
    """Auto-exposure: a law on the share of saturated samples in the frames before; see `optics.exposure`."""

    automatic: bool = True
    """False holds the exposure at `initial_s` and the gain at 1."""
    saturated_share: float = 0.00015
    """Share of samples (pixels × channels) that is to be saturated: the lights' cores, and little of their halos."""
    dead_band: float = 0.3
    """Relative distance from the wanted share within which the exposure is left alone."""
    max_step: float = 1.3
    """Greatest factor per frame."""
    min_s: float = 1e-6
    """Shortest exposure time."""
    max_s: float = 0.016
    """Longest exposure time; half of a 30 Hz frame."""
    max_gain: float = 16.0
    """Greatest analogue gain, used once the exposure is at its longest."""
    initial_s: float = 0.001
    """Exposure before the first frame; with `automatic` the camera has settled when the first frame is taken."""

    def __post_init__(self) -> None:
        """Refuse what cannot settle."""
        if not 0.0 < self.saturated_share < 0.5:
            raise ConfigError("saturated_share", self.saturated_share, "a share above 0 and below 0.5")
        if not 0.0 < self.min_s <= self.max_s:
            raise ConfigError("min_s", self.min_s, "a time above 0 s, at most max_s")
        if not self.initial_s > 0.0:
            raise ConfigError("initial_s", self.initial_s, "a time above 0 s")
        if not 1.0 <= self.max_gain <= 1000.0:
            raise ConfigError("max_gain", self.max_gain, "a gain of 1 to 1000, which is 60 dB")
        if not 1.0 < self.max_step <= 4.0:
            raise ConfigError("max_step", self.max_step, "a factor above 1 and up to 4")
        if not 0.0 <= self.dead_band < 1.0:
            raise ConfigError("dead_band", self.dead_band, "a fraction of 0 or more and below 1")


@dataclass(frozen=True)
class ImagingCfg:
    """The camera as an instrument. Values are per image pixel, whatever the resolution."""

    sensor_width_m: float = 0.0056
    """Width of the sensor: 1/2.8 inch; with the intrinsics it gives focal length and aperture."""
    f_number: float = 2.8
    """Focal length over aperture diameter."""
    lens_transmission: float = 0.85
    """Lens and port window."""
    lens_sigma_px: float = 0.8
    """Standard deviation of the lens' point spread function, a Gaussian."""
    lamp_radius_m: float = 0.02
    """Radius of a lamp's emitting face: what a lamp is wide at close range."""
    lamp_spill: float = 0.1
    """Share of a lamp's flux that leaves its mount and nearby water in all directions and lights the station."""
    full_well_e: float = 40000.0
    """Electrons at which a pixel saturates at gain 1."""
    read_noise_e: float = 6.0
    """Standard deviation of the read noise in electrons."""
    encoding: str = "sqrt"
    """"sqrt" (near the usual gamma of 2.2, and shot noise is the same at every level) or "linear"."""
    noise: bool = True
    """Shot and read noise."""
    surfaces: bool = True
    """Draw station and floor; needs OpenGL as soon as one of them can be seen through the water."""
    exposure: ExposureCfg = ExposureCfg()

    def __post_init__(self) -> None:
        """Refuse what no camera can be."""
        if not 1.0 <= self.full_well_e <= 1e7:
            raise ConfigError("full_well_e", self.full_well_e, "1 to 10,000,000 electrons")
        if not 0.0 <= self.read_noise_e <= 1000.0:
            raise ConfigError("read_noise_e", self.read_noise_e, "0 to 1000 electrons")
        if not 0.1 <= self.f_number <= 1000.0:
            raise ConfigError("f_number", self.f_number, "a number of 0.1 to 1000")
        for name in ("sensor_width_m", "lens_sigma_px"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ConfigError(name, getattr(self, name), "a number above 0")
        if not (math.isfinite(self.lamp_radius_m) and self.lamp_radius_m >= 0.0):
            raise ConfigError("lamp_radius_m", self.lamp_radius_m, "0 or more")
        for name in ("lens_transmission", "lamp_spill"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ConfigError(name, getattr(self, name), "a fraction of 0 to 1")
        if self.encoding not in ("sqrt", "linear"):
            raise ConfigError("encoding", self.encoding, "'sqrt' or 'linear'")
