"""Settings of the simulated camera: optics, sensor, auto-exposure and what is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative, Positive, Share, above, at_least, at_most, below, between

__all__ = ["ExposureCfg", "ImagingCfg"]


@dataclass(frozen=True)
class ExposureCfg(Checked):
    """Auto-exposure: a law on the share of saturated samples in the frames before; see `optics.exposure`."""

    automatic: bool = True
    """False holds the exposure at `initial_s` and the gain at 1."""
    saturated_share: Annotated[float, above(0.0), below(0.5)] = 0.00015
    """Share of samples (pixels × channels) that is to be saturated: the lights' cores, and little of their halos."""
    dead_band: Annotated[float, at_least(0.0), below(1.0)] = 0.3
    """Relative distance from the wanted share within which the exposure is left alone."""
    max_step: Annotated[float, above(1.0), at_most(4.0)] = 1.3
    """Greatest factor per frame."""
    min_s: Positive = 1e-6
    """Shortest exposure time."""
    max_s: float = 0.016
    """Longest exposure time; half of a 30 Hz frame."""
    max_gain: Annotated[float, between(1.0, 1000.0, "which is 60 dB")] = 16.0
    """Greatest analogue gain, used once the exposure is at its longest."""
    initial_s: Positive = 0.001
    """Exposure before the first frame; with `automatic` the camera has settled when the first frame is taken."""

    def __post_init__(self) -> None:
        """Refuse exposure times without range."""
        if self.min_s > self.max_s:
            raise ConfigError("min_s", self.min_s, "at most max_s")


@dataclass(frozen=True)
class ImagingCfg(Checked):
    """The camera as an instrument. Values are per image pixel, whatever the resolution."""

    sensor_width_m: Positive = 0.0056
    """Width of the sensor: 1/2.8 inch; with the intrinsics it gives focal length and aperture."""
    f_number: Annotated[float, between(0.1, 1000.0)] = 2.8
    """Focal length over aperture diameter."""
    lens_transmission: Share = 0.85
    """Lens and port window."""
    lens_sigma_px: Positive = 0.8
    """Standard deviation of the lens' point spread function, a Gaussian."""
    lamp_radius_m: NotNegative = 0.02
    """Radius of a lamp's emitting face: what a lamp is wide at close range."""
    lamp_spill: Share = 0.1
    """Share of a lamp's flux that leaves its mount and nearby water in all directions and lights the station."""
    full_well_e: Annotated[float, between(1.0, 1e7)] = 40000.0
    """Electrons at which a pixel saturates at gain 1."""
    read_noise_e: Annotated[float, between(0.0, 1000.0)] = 6.0
    """Standard deviation of the read noise in electrons."""
    encoding: Literal["sqrt", "linear"] = "sqrt"
    """"sqrt" (near the usual gamma of 2.2, and shot noise is the same at every level) or "linear"."""
    noise: bool = True
    """Shot and read noise."""
    surfaces: bool = True
    """Draw station and floor; needs OpenGL as soon as one of them can be seen through the water."""
    exposure: ExposureCfg = ExposureCfg()
