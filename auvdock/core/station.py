"""A docking station as data: its lights, its geometry and what counts as docked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.assets import asset
from auvdock.core.beacons import BeaconCfg, BeaconLayout, BeamAngle, ring_layout
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import AcuteDeg, NotNegative, Positive, between
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.strict import load_toml

__all__ = ["ConicalStationCfg", "FunnelCfg", "LatchCfg", "conical_layout", "load_conical_station"]

_MOST_LIGHTS = 64
"""On the rim: from metres away, more are one bright ring, and every frame works on each of them."""


@dataclass(frozen=True)
class FunnelCfg(Checked):
    """The funnel and the receiving tube behind it; x of the station frame, mouth at x = 0, tube at negative x."""

    mouth_radius_m: Positive = 1.0
    """Paper A: a mouth of 2 m diameter."""
    length_m: Positive = 1.2
    """From the mouth to the throat at x = -length."""
    tube_radius_m: Positive = 0.15
    """Inner radius of throat and tube."""
    tube_length_m: Positive = 1.5
    """From the throat to the end stop."""
    friction: NotNegative = 0.1
    """Sliding friction, polymer lining on painted hull in water."""

    def __post_init__(self) -> None:
        """Refuse what is not a funnel."""
        if self.tube_radius_m >= self.mouth_radius_m:
            raise ConfigError("tube_radius_m", self.tube_radius_m, "less than mouth_radius_m")


@dataclass(frozen=True)
class LatchCfg(Checked):
    """When the latch closes, and with that what "docked" means. The one place where success is defined.

    The latch closes when the nose is at least `depth_m` past the throat inside the tube, the hull's axis within
    `max_angle_deg` of the tube's, and the speed along the tube at most `max_speed_m_s`; it then holds the vehicle.
    An episode is a success if the latch has closed and held for `hold_s`, and the nose passed the throat at no more
    than `max_entry_speed_m_s` and `max_angle_deg`. The peak contact force on the way is reported, not judged.
    """

    depth_m: NotNegative = 0.5
    max_angle_deg: AcuteDeg = 10.0
    max_speed_m_s: Positive = 1.0
    max_entry_speed_m_s: Positive = 1.0
    hold_s: NotNegative = 0.5


@dataclass(frozen=True)
class ConicalStationCfg(Checked):
    """The conical station of paper A: funnel, tube, latch and three kinds of light."""

    funnel: FunnelCfg = FunnelCfg()
    latch: LatchCfg = LatchCfg()
    depth_m: float = 8.0
    """Depth of the mouth's centre."""
    floor_below_m: float = 4.0
    """Distance from the mouth's centre to the floor."""
    array_count: Annotated[int, between(0, _MOST_LIGHTS)] = 6
    """Lights on the mouth's rim."""
    array_beam_angle_deg: BeamAngle = 45.0
    """Full angle (paper A, table 5)."""
    array_tilt_deg: Annotated[float, between(-90.0, 90.0)] = 6.0
    """Inward tilt (paper A, table 5: +6 is best)."""
    array_power_w: Positive = 10.0
    """Electrical (paper A's table 2 is lost; paper B, figure 4, tests 10 W)."""
    beacons: tuple[BeaconCfg, ...] = ()
    """The station's other lights, or all of them when array_count is 0."""
    rotating: RotatingBeaconCfg | None = None
    """Paper B's rotating beacon, if the station carries one; no part of `layout`, whose lights stand still."""

    def __post_init__(self) -> None:
        """Refuse a station that reaches out of the water or into the ground, or whose latch lies beyond the tube."""
        funnel = self.funnel
        if self.latch.depth_m > funnel.tube_length_m:
            remedy = f"at most the tube's length, {funnel.tube_length_m:g} m"
            raise ConfigError("latch.depth_m", self.latch.depth_m, remedy)
        lamps = [beacon.position_m[2] for beacon in self.beacons]
        lamps += [self.rotating.position_m[2]] if self.rotating is not None else []
        above_m, below_m = max([funnel.mouth_radius_m, *lamps]), max([funnel.mouth_radius_m, *(-z for z in lamps)])
        if self.depth_m <= above_m:
            remedy = f"more than {above_m:g} m, so high does the station reach above its mouth's centre"
            raise ConfigError("depth_m", self.depth_m, remedy)
        if self.floor_below_m <= below_m:
            remedy = f"more than {below_m:g} m, so far does the station reach below its mouth's centre"
            raise ConfigError("floor_below_m", self.floor_below_m, remedy)

    @property
    def inside_m(self) -> float:
        """How far the nose is inside the mouth where the latch can close."""
        return self.funnel.length_m + self.latch.depth_m

    @property
    def layout(self) -> BeaconLayout:
        """All lights, the array first."""
        return conical_layout(self)


def conical_layout(cfg: ConicalStationCfg) -> BeaconLayout:
    """The lights of a conical station: `array_count` on the mouth's rim, then those listed."""
    ring = ring_layout(
        cfg.array_count,
        cfg.funnel.mouth_radius_m,
        inward_tilt_deg=cfg.array_tilt_deg,
        beam_angle_deg=cfg.array_beam_angle_deg,
        power_w=cfg.array_power_w,
    )
    return BeaconLayout(ring + cfg.beacons)


def load_conical_station(name: str = "conical") -> ConicalStationCfg:
    """A conical station preset by name.

    Raises:
        ConfigError: no such preset, or a file that does not fit.
    """
    return load_toml(ConicalStationCfg, asset("stations", name))
