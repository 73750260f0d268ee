"""Settings of the rotating beacon's perception."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, Positive, above, at_least, below

__all__ = ["ForwardBeaconCfg"]


@dataclass(frozen=True)
class ForwardBeaconCfg(Checked):
    """When a light is the rotating beacon, and how well it is known; all values are ours."""

    min_turns: Annotated[int, at_least(2, "one flash is no rotation")] = 3
    """Coherent passes that make a light the beacon."""
    coherence_deg: Positive = 4.0
    """Greatest change of azimuth between passes that is not the vehicle's own motion, and greatest deviation of a pass
    from a steady change."""
    nearest_m: Positive = 8.0
    """Range at which own motion may change the azimuth before the range is known."""
    amplitude_ratio: Positive = 2.5
    """Greatest ratio of brightness between passes."""
    modulation: Positive = 0.3
    """Least brightness of a pass above the steady light around it, over that light."""
    noise_ratio: Positive = 4.0
    """The same over the scatter of the steady light."""
    max_widening: Positive = 4.5
    """A pass wider than so many beams is none."""
    min_frames: Count = 2
    """Frames in which a pass must be seen."""
    max_sigma_deg: Positive = 3.0
    """Greatest standard deviation of a pass's peak."""
    max_misfit: Positive = 0.08
    """Greatest share of a pass's squared brightness that its profile leaves unexplained: a flash has another form."""
    window_deg: Annotated[float, above(0.0), below(120.0)] = 60.0
    """Beam angle on either side of a peak that belongs to the pass."""
    settle_deg: Positive = 36.0
    """Beam angle past the brightest frame after which a pass is judged."""
    gate_deg: Positive = 1.2
    """A light within this angle of a candidate's direction is the candidate."""
    gate_rise_deg_s: Positive = 1.0
    """Rise of that with the time since it was last seen: parallax of the vehicle's own motion."""
    max_gate_deg: Positive = 4.0
    """Limit of that."""
    merge_deg: Positive = 0.7
    """Detections closer than this are one light: a halo's parts, or the far lamp under the beacon."""
    flash_deg: Positive = 3.0
    """Likewise for lights that were seen in few frames so far."""
    glare_deg: Positive = 4.0
    """Detections this close to a light `glare_ratio` times as bright are parts of its halo."""
    glare_ratio: Positive = 5.0
    """See `glare_deg`."""
    max_candidates: Count = 24
    """Lights that are followed at once."""
    flux_share: Positive = 0.04
    """Standard deviation of a flux over itself, beside the noise: saturation, other lights, what the profile leaves."""
    flux_floor: Positive = 0.01
    """The same over the brightest flux of the pass."""
    clock_sigma_s: Positive = 0.0006
    """Standard deviation of the vehicle's clock against the station's, as `BeaconClockCfg` has it by default."""
    bearing_sigma_rad: Positive = 0.003
    """Standard deviation of a bearing from turn to turn: compass noise that gyroscopes leave, the spot's centre."""
    fusion_turns: Count = 40
    """Passes that the place of the beacon rests on."""
    inverse_range_per_m: Positive = 0.045
    """Mean of 1 / range before parallax tells, with `inverse_range_sigma_per_m` as its standard deviation."""
    inverse_range_sigma_per_m: Positive = 0.03
    """See `inverse_range_per_m`."""
    range_share: Positive = 0.3
    """A range is reported once its standard deviation is below this share of it."""

    def __post_init__(self) -> None:
        """Refuse to judge a pass later than its window ends."""
        if self.settle_deg > self.window_deg:
            raise ConfigError("window_deg", self.window_deg, "settle_deg or more and below 120")
