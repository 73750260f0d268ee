"""A docking station as data: its lights, its geometry and what counts as docked."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.assets import asset
from auvdock.core.beacons import BeaconCfg, BeaconLayout, ring_layout
from auvdock.core.checks import check_above, check_range
from auvdock.core.errors import ConfigError
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.strict import load_toml

__all__ = ["ConicalStationCfg", "FunnelCfg", "LatchCfg", "conical_layout", "load_conical_station"]

_MOST_LIGHTS = 64
"""On the rim: from metres away, more are one bright ring, and every frame works on each of them."""


@dataclass(frozen=True)
class FunnelCfg:
    """The funnel and the receiving tube behind it; x of the station frame, mouth at x = 0, tube at negative x."""

    mouth_radius_m: float = 1.0
    """Paper A: a mouth of 2 m diameter."""
    length_m: float = 1.2
    """From the mouth to the throat at x = -length."""
    tube_radius_m: float = 0.15
    """Inner radius of throat and tube."""
    tube_length_m: float = 1.5
    """From the throat to the end stop."""
    friction: float = 0.1
    """Sliding friction, polymer lining on painted hull in water."""

    def __post_init__(self) -> None:
        """Refuse what is not a funnel."""
        for name in ("mouth_radius_m", "length_m", "tube_radius_m", "tube_length_m"):
            check_above(name, getattr(self, name), 0.0, "a length above 0 m")
        if self.tube_radius_m >= self.mouth_radius_m:
            raise ConfigError("tube_radius_m", self.tube_radius_m, "less than mouth_radius_m")
        check_range("friction", self.friction, 0.0, math.inf, "0 or more")


@dataclass(frozen=True)
class LatchCfg:
    """When the latch closes, and with that what "docked" means. The one place where success is defined.

    The latch closes when the nose is at least `depth_m` past the throat inside the tube, the hull's axis within
    `max_angle_deg` of the tube's, and the speed along the tube at most `max_speed_m_s`; it then holds the vehicle.
    An episode is a success if the latch has closed and held for `hold_s`, and the nose passed the throat at no more
    than `max_entry_speed_m_s` and `max_angle_deg`. The peak contact force on the way is reported, not judged.
    """

    depth_m: float = 0.5
    max_angle_deg: float = 10.0
    max_speed_m_s: float = 1.0
    max_entry_speed_m_s: float = 1.0
    hold_s: float = 0.5

    def __post_init__(self) -> None:
        """Refuse a latch that never closes or has held before it has closed."""
        check_range("depth_m", self.depth_m, 0.0, math.inf, "a depth of 0 m or more")
        check_above("max_angle_deg", self.max_angle_deg, 0.0, "an angle above 0 and up to 90 degrees", 90.0)
        for name in ("max_speed_m_s", "max_entry_speed_m_s"):
            check_above(name, getattr(self, name), 0.0, "a speed above 0 m/s")
        check_range("hold_s", self.hold_s, 0.0, math.inf, "a time of 0 s or more")


@dataclass(frozen=True)
class ConicalStationCfg:
    """The conical station of paper A: funnel, tube, latch and three kinds of light."""

    funnel: FunnelCfg = FunnelCfg()
    latch: LatchCfg = LatchCfg()
    depth_m: float = 8.0
    """Depth of the mouth's centre."""
    floor_below_m: float = 4.0
    """Distance from the mouth's centre to the floor."""
    array_count: int = 6
    """Lights on the mouth's rim."""
    array_beam_angle_deg: float = 45.0
    """Full angle (paper A, table 5)."""
    array_tilt_deg: float = 6.0
    """Inward tilt (paper A, table 5: +6 is best)."""
    array_power_w: float = 10.0
    """Electrical (paper A's table 2 is lost; paper B, figure 4, tests 10 W)."""
    beacons: tuple[BeaconCfg, ...] = ()
    """The station's other lights, or all of them when array_count is 0."""
    rotating: RotatingBeaconCfg | None = None
    """Paper B's rotating beacon, if the station carries one; no part of `layout`, whose lights stand still."""

    def __post_init__(self) -> None:
        """Refuse a station that reaches out of the water or into the ground, or whose latch lies beyond the tube."""
        funnel = self.funnel
        remedy = f"at most the tube's length, {funnel.tube_length_m:g} m"
        check_range("latch.depth_m", self.latch.depth_m, 0.0, funnel.tube_length_m, remedy)
        lamps = [beacon.position_m[2] for beacon in self.beacons]
        lamps += [self.rotating.position_m[2]] if self.rotating is not None else []
        above_m, below_m = max([funnel.mouth_radius_m, *lamps]), max([funnel.mouth_radius_m, *(-z for z in lamps)])
        remedy = f"more than {above_m:g} m, so high does the station reach above its mouth's centre"
        check_above("depth_m", self.depth_m, above_m, remedy)
        remedy = f"more than {below_m:g} m, so far does the station reach below its mouth's centre"
        check_above("floor_below_m", self.floor_below_m, below_m, remedy)
        check_range("array_count", self.array_count, 0, _MOST_LIGHTS, f"a number of 0 to {_MOST_LIGHTS} lights")
        check_range("array_beam_angle_deg", self.array_beam_angle_deg, 0.5, 360.0, "a full angle of 0.5 to 360 degrees")
        check_range("array_tilt_deg", self.array_tilt_deg, -90.0, 90.0, "a tilt of -90 to 90 degrees")
        check_above("array_power_w", self.array_power_w, 0.0, "a power above 0 W")

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
