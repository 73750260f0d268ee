"""The landing station of paper C as data: five lights and an AprilTag on a platform, guides, latch."""

from __future__ import annotations

import math
from dataclasses import dataclass

from auvdock.assets import asset
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.core.checks import check_above, check_finite, check_range
from auvdock.core.errors import ConfigError
from auvdock.core.strict import load_toml

__all__ = ["GuideCfg", "LandingLatchCfg", "LandingStationCfg", "TagCfg", "load_landing_station"]


@dataclass(frozen=True)
class TagCfg:
    """An AprilTag of family 36h11, lying face up with its upper edge towards the head of the station."""

    tag_id: int = 0
    """Number within the family, 0 to 586."""
    size_m: float = 0.2
    """Edge of the black square, without the white margin."""
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre in the station frame."""
    reflectance: float = 0.9
    """Of the white cells; the black ones have a tenth of it."""

    def __post_init__(self) -> None:
        """Refuse what the family does not have."""
        if not 0 <= self.tag_id <= 586:
            raise ConfigError("tag_id", self.tag_id, "a number of 0 to 586, family 36h11 has 587 tags")
        if not 0.02 <= self.size_m <= 2.0:
            raise ConfigError("size_m", self.size_m, "an edge of 0.02 to 2 m")
        check_finite("position_m", self.position_m, "three finite coordinates")
        if not 0.0 < self.reflectance <= 1.0:
            raise ConfigError("reflectance", self.reflectance, "a fraction above 0 and up to 1")


@dataclass(frozen=True)
class GuideCfg:
    """The V-shaped guides at head and tail: pairs of plates that open upwards and catch the hull or keel."""

    x_m: tuple[float, float] = (0.35, -0.35)
    """Where head and tail guide stand along the centre line."""
    thickness_m: float = 0.08
    """Extent of each guide along the centre line."""
    opening_half_angle_deg: float = 45.0
    """Angle of each plate from the vertical."""
    mouth_half_width_m: float = 0.25
    """Half of the V's width at its top."""
    seat_radius_m: float = 0.0955
    """Radius of the round that comes to rest in the V: the hull's, or that of the vehicle's docking keel."""
    seat_height_m: float = 0.3
    """Height of that round's centre above the platform once seated."""
    friction: float = 0.15
    """Sliding friction, polymer lining on painted hull in water."""

    def __post_init__(self) -> None:
        """Refuse what is no guide."""
        for name in ("thickness_m", "mouth_half_width_m", "seat_radius_m", "seat_height_m"):
            check_above(name, getattr(self, name), 0.0, "a length above 0 m")
        check_finite("x_m", self.x_m, "two finite coordinates")
        if not 15.0 <= self.opening_half_angle_deg <= 75.0:
            raise ConfigError(
                "opening_half_angle_deg",
                self.opening_half_angle_deg,
                "an angle of 15 to 75 degrees",
            )
        if self.mouth_half_width_m <= self.seat_radius_m:
            raise ConfigError("mouth_half_width_m", self.mouth_half_width_m, "more than seat_radius_m")
        check_range("friction", self.friction, 0.0, math.inf, "0 or more")

    @property
    def top_m(self) -> float:
        """Height of the V's upper edges above the platform."""
        angle = math.radians(self.opening_half_angle_deg)
        return self.seat_height_m - self.seat_radius_m / math.sin(angle) + self.mouth_half_width_m / math.tan(angle)


@dataclass(frozen=True)
class LandingLatchCfg:
    """When the active latch closes on the platform, and with that what "docked" means for a landing.

    A touch of the guides wakes the arm. It reaches the vehicle when its seat (the centre of the round that rests in the
    guides) is within the following of its place, and the vehicle is slow; it then pulls it tight. An episode is a
    success if the latch has closed and held for `hold_s`, and the touchdown was no faster than `max_touchdown_m_s`.
    """

    along_m: float = 0.06
    """Along the centre line (paper C steers to within 20 mm)."""
    across_m: float = 0.04
    """Across it."""
    height_m: float = 0.03
    """Above the seat."""
    max_heading_deg: float = 5.0
    """Between hull and centre line (paper C steers to within 3°)."""
    max_tilt_deg: float = 10.0
    """Roll or pitch."""
    max_speed_m_s: float = 0.1
    """Speed over ground at which the arm can close."""
    max_touchdown_m_s: float = 0.3
    """Vertical speed at the first contact with the station."""
    hold_s: float = 0.5

    def __post_init__(self) -> None:
        """Refuse an arm that never closes or has held before it has closed."""
        for name in ("along_m", "across_m", "height_m"):
            check_above(name, getattr(self, name), 0.0, "a length above 0 m")
        for name in ("max_heading_deg", "max_tilt_deg"):
            check_above(name, getattr(self, name), 0.0, "an angle above 0 and up to 90 degrees", 90.0)
        for name in ("max_speed_m_s", "max_touchdown_m_s"):
            check_above(name, getattr(self, name), 0.0, "a speed above 0 m/s")
        check_range("hold_s", self.hold_s, 0.0, math.inf, "a time of 0 s or more")


@dataclass(frozen=True)
class LandingStationCfg:
    """A platform on the floor. Station frame: origin in the platform's centre, x to its head, y to port, z up."""

    tag: TagCfg = TagCfg()
    guide: GuideCfg = GuideCfg()
    latch: LandingLatchCfg = LandingLatchCfg()
    depth_m: float = 10.0
    """Depth of the platform's upper face."""
    length_m: float = 1.8
    """Platform along x."""
    width_m: float = 1.0
    """Platform along y."""
    height_m: float = 0.25
    """Of the platform above the floor."""
    beacons: tuple[BeaconCfg, ...] = ()
    """The lights, role "array", with their beams upwards."""

    def __post_init__(self) -> None:
        """Refuse what is no platform."""
        for name in ("depth_m", "length_m", "width_m", "height_m"):
            check_above(name, getattr(self, name), 0.0, "a length above 0 m")
        lamps = [beacon.position_m[2] for beacon in self.beacons]
        top_m = max([self.guide.top_m, self.tag.position_m[2], *lamps])
        remedy = f"more than {top_m:g} m, so high does the station reach above its platform"
        check_above("depth_m", self.depth_m, top_m, remedy)
        low_m = -min([0.0, *lamps])
        remedy = f"{low_m:g} m or more, so far does a light lie below the platform's upper face"
        check_range("height_m", self.height_m, low_m, math.inf, remedy)

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
