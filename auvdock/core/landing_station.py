"""The landing station of paper C as data: five lights and an AprilTag on a platform, guides, latch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from auvdock.assets import asset
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import AcuteDeg, NotNegative, Positive, PositiveShare, between
from auvdock.core.strict import load_toml

__all__ = ["GuideCfg", "LandingLatchCfg", "LandingStationCfg", "TagCfg", "load_landing_station"]


@dataclass(frozen=True)
class TagCfg(Checked):
    """An AprilTag of family 36h11, lying face up with its upper edge towards the head of the station."""

    tag_id: Annotated[int, between(0, 586, "family 36h11 has 587 tags")] = 0
    """Number within the family, 0 to 586."""
    size_m: Annotated[float, between(0.02, 2.0)] = 0.2
    """Edge of the black square, without the white margin."""
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre in the station frame."""
    reflectance: PositiveShare = 0.9
    """Of the white cells; the black ones have a tenth of it."""


@dataclass(frozen=True)
class GuideCfg(Checked):
    """The V-shaped guides at head and tail: pairs of plates that open upwards and catch the hull or keel."""

    x_m: tuple[float, float] = (0.35, -0.35)
    """Where head and tail guide stand along the centre line."""
    thickness_m: Positive = 0.08
    """Extent of each guide along the centre line."""
    opening_half_angle_deg: Annotated[float, between(15.0, 75.0)] = 45.0
    """Angle of each plate from the vertical."""
    mouth_half_width_m: Positive = 0.25
    """Half of the V's width at its top."""
    seat_radius_m: Positive = 0.0955
    """Radius of the round that comes to rest in the V: the hull's, or that of the vehicle's docking keel."""
    seat_height_m: Positive = 0.3
    """Height of that round's centre above the platform once seated."""
    friction: NotNegative = 0.15
    """Sliding friction, polymer lining on painted hull in water."""

    def __post_init__(self) -> None:
        """Refuse a mouth that is no wider than what comes to rest in it."""
        if self.mouth_half_width_m <= self.seat_radius_m:
            raise ConfigError("mouth_half_width_m", self.mouth_half_width_m, "more than seat_radius_m")

    @property
    def top_m(self) -> float:
        """Height of the V's upper edges above the platform."""
        angle = math.radians(self.opening_half_angle_deg)
        return self.seat_height_m - self.seat_radius_m / math.sin(angle) + self.mouth_half_width_m / math.tan(angle)


@dataclass(frozen=True)
class LandingLatchCfg(Checked):
    """When the active latch closes on the platform, and with that what "docked" means for a landing.

    A touch of the guides wakes the arm. It reaches the vehicle when its seat (the centre of the round that rests in the
    guides) is within the following of its place, and the vehicle is slow; it then pulls it tight. An episode is a
    success if the latch has closed and held for `hold_s`, and the touchdown was no faster than `max_touchdown_m_s`.
    """

    along_m: Positive = 0.06
    """Along the centre line (paper C steers to within 20 mm)."""
    across_m: Positive = 0.04
    """Across it."""
    height_m: Positive = 0.03
    """Above the seat."""
    max_heading_deg: AcuteDeg = 5.0
    """Between hull and centre line (paper C steers to within 3°)."""
    max_tilt_deg: AcuteDeg = 10.0
    """Roll or pitch."""
    max_speed_m_s: Positive = 0.1
    """Speed over ground at which the arm can close."""
    max_touchdown_m_s: Positive = 0.3
    """Vertical speed at the first contact with the station."""
    hold_s: NotNegative = 0.5


@dataclass(frozen=True)
class LandingStationCfg(Checked):
    """A platform on the floor. Station frame: origin in the platform's centre, x to its head, y to port, z up."""

    tag: TagCfg = TagCfg()
    guide: GuideCfg = GuideCfg()
    latch: LandingLatchCfg = LandingLatchCfg()
    depth_m: Positive = 10.0
    """Depth of the platform's upper face."""
    length_m: Positive = 1.8
    """Platform along x."""
    width_m: Positive = 1.0
    """Platform along y."""
    height_m: Positive = 0.25
    """Of the platform above the floor."""
    beacons: tuple[BeaconCfg, ...] = ()
    """The lights, role "array", with their beams upwards."""

    def __post_init__(self) -> None:
        """Refuse a station that reaches out of the water, or a light below the floor."""
        lamps = [beacon.position_m[2] for beacon in self.beacons]
        top_m = max([self.guide.top_m, self.tag.position_m[2], *lamps])
        if self.depth_m <= top_m:
            remedy = f"more than {top_m:g} m, so high does the station reach above its platform"
            raise ConfigError("depth_m", self.depth_m, remedy)
        low_m = -min([0.0, *lamps])
        if self.height_m < low_m:
            remedy = f"{low_m:g} m or more, so far does a light lie below the platform's upper face"
            raise ConfigError("height_m", self.height_m, remedy)

    @property
    def floor_below_m(self) -> float:
        """Distance from the station frame's origin to the floor."""
        return self.height_m

    @property
    def inside_m(self) -> float:
        """How far inside the station the latch closes: not at all, the origin is where the way ends."""
        return 0.0

    @property
    def layout(self) -> BeaconLayout:
        """All lights."""
        return BeaconLayout(self.beacons)


def load_landing_station(name: str = "landing") -> LandingStationCfg:
    """A landing station preset by name.

    Raises:
        ConfigError: no such preset, or a file that does not fit.
    """
    return load_toml(LandingStationCfg, asset("stations", name))
