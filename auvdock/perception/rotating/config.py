"""Settings of the rotating beacon's perception."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.core.errors import ConfigError

__all__ = ["ForwardBeaconCfg"]


@dataclass(frozen=True)
class ForwardBeaconCfg:
    """When a light is the rotating beacon, and how well it is known; all values are ours."""

    min_turns: int = 3
    """Coherent passes that make a light the beacon."""
    coherence_deg: float = 4.0
    """Greatest change of azimuth between passes that is not the vehicle's own motion, and greatest deviation of a pass
    from a steady change."""
    nearest_m: float = 8.0
    """Range at which own motion may change the azimuth before the range is known."""
    amplitude_ratio: float = 2.5
    """Greatest ratio of brightness between passes."""
    modulation: float = 0.3
    """Least brightness of a pass above the steady light around it, over that light."""
    noise_ratio: float = 4.0
    """The same over the scatter of the steady light."""
    max_widening: float = 4.5
    """A pass wider than so many beams is none."""
    min_frames: int = 2
    """Frames in which a pass must be seen."""
    max_sigma_deg: float = 3.0
    """Greatest standard deviation of a pass's peak."""
    max_misfit: float = 0.08
    """Greatest share of a pass's squared brightness that its profile leaves unexplained: a flash has another form."""
    window_deg: float = 60.0
    """Beam angle on either side of a peak that belongs to the pass."""
    settle_deg: float = 36.0
    """Beam angle past the brightest frame after which a pass is judged."""
    gate_deg: float = 1.2
    """A light within this angle of a candidate's direction is the candidate."""
    gate_rise_deg_s: float = 1.0
    """Rise of that with the time since it was last seen: parallax of the vehicle's own motion."""
    max_gate_deg: float = 4.0
    """Limit of that."""
    merge_deg: float = 0.7
    """Detections closer than this are one light: a halo's parts, or the far lamp under the beacon."""
    flash_deg: float = 3.0
    """Likewise for lights that were seen in few frames so far."""
    glare_deg: float = 4.0
    """Detections this close to a light `glare_ratio` times as bright are parts of its halo."""
    glare_ratio: float = 5.0
    """See `glare_deg`."""
    max_candidates: int = 24
    """Lights that are followed at once."""
    flux_share: float = 0.04
    """Standard deviation of a flux over itself, beside the noise: saturation, other lights, what the profile leaves."""
    flux_floor: float = 0.01
    """The same over the brightest flux of the pass."""
    clock_sigma_s: float = 0.0006
    """Standard deviation of the vehicle's clock against the station's, as `BeaconClockCfg` has it by default."""
    bearing_sigma_rad: float = 0.003
    """Standard deviation of a bearing from turn to turn: compass noise that gyroscopes leave, the spot's centre."""
    fusion_turns: int = 40
    """Passes that the place of the beacon rests on."""
    inverse_range_per_m: float = 0.045
    """Mean of 1 / range before parallax tells, with `inverse_range_sigma_per_m` as its standard deviation."""
    inverse_range_sigma_per_m: float = 0.03
    """See `inverse_range_per_m`."""
    range_share: float = 0.3
    """A range is reported once its standard deviation is below this share of it."""

    def __post_init__(self) -> None:
        """Refuse thresholds without meaning."""
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(name, value, "a value above 0")
        if self.min_turns < 2:
            raise ConfigError("min_turns", self.min_turns, "2 or more: one flash is no rotation")
        if not self.settle_deg <= self.window_deg < 120.0:
            raise ConfigError("window_deg", self.window_deg, "settle_deg or more and below 120")
