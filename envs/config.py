"""Configuration of a docking world: station, vehicle, water, camera and where an episode starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal, get_args

from auvdock.core.beacons import BeaconCfg
from auvdock.core.camera import CameraCfg
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.limits import NotNegative, Positive, at_least, between
from auvdock.core.rotating_beacon import BeaconClockCfg
from auvdock.core.station import ConicalStationCfg, load_conical_station
from auvdock.envs.latency import LatencyCfg
from auvdock.envs.room import hull_room
from auvdock.optics.imaging import ImagingCfg
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.water import WaterCfg
from auvdock.sim.simulator import SimCfg

__all__ = ["FIDELITIES", "Fidelity", "LimitsCfg", "StartCfg", "WorldCfg", "check_rates", "rotating_world_cfg"]

Fidelity = Literal["pixels", "beacons"]
"""`pixels` renders every frame; `beacons` draws detections from the same radiometry without an image."""
FIDELITIES: tuple[Fidelity, ...] = get_args(Fidelity)


@dataclass(frozen=True)
class StartCfg(Checked):
    """Where an episode starts; each quantity is drawn uniformly.

    Either in a box before the mouth, or in a ring about it (`ring`): at a radius of `min_range_m` to `max_range_m`, at
    an azimuth within ±`azimuth_deg` of the approach axis, headed within ±`heading_deg` of the direction to the station.
    """

    ring: bool = False
    """Start in a ring about the station instead of a box before its mouth."""
    min_range_m: Annotated[float, at_least(2.0)] = 15.0
    """Least distance in front of the mouth; of a ring its inner radius."""
    max_range_m: float = 30.0
    """Greatest distance in front of the mouth; of a ring its outer radius."""
    azimuth_deg: Annotated[float, between(0.0, 180.0)] = 180.0
    """Of a ring: greatest azimuth to either side of the approach axis; 180 is all around."""
    lateral_m: NotNegative = 3.0
    """Greatest distance sideways from the approach axis; unused in a ring."""
    vertical_m: NotNegative = 1.5
    """Greatest depth difference to the mouth's centre."""
    heading_deg: NotNegative = 30.0
    """Greatest heading difference to the approach axis; in a ring, to the direction of the station."""
    random_current_direction: bool = False
    """Draw the current's direction uniformly instead of taking sim.current.direction_deg."""

    def __post_init__(self) -> None:
        """Refuse a ring or box without room."""
        if self.min_range_m > self.max_range_m:
            raise ConfigError("min_range_m", self.min_range_m, "at most max_range_m")


@dataclass(frozen=True)
class LimitsCfg(Checked):
    """What ends an episode without success."""

    max_time_s: Positive = 240.0
    """Simulated time."""
    collision_force_n: Positive = 2000.0
    """A contact harder than this ends the episode as `collision`."""
    surfaced_s: Positive = 5.0
    """Once some of the hull has been out of the water for this long in all, the episode ends as `surfaced`."""
    carried_off_m: Positive = 200.0
    """Once the vehicle is this much further from the station than at the start, the episode ends as `carried_off`."""


@dataclass(frozen=True)
class WorldCfg(Checked):
    """Everything outside the vehicle's head."""

    fidelity: Fidelity = "pixels"
    """"pixels" or "beacons"."""
    water: str | WaterCfg = "clear"
    """Water preset (Jerlov "I" to "9C", "petzold_clear" to "petzold_harbour", "clear", "pool", "lake"), a TOML file of
    one's own, or that file's content."""
    attenuation_per_m: float | None = None
    """Beam attenuation c at 450 nm in 1/m in place of the preset's, by more or less scattering alone."""
    turbidity_per_m: float | None = None
    """Beam attenuation c at 530 nm in 1/m, 0.151 to 1.92, of a water between those that Petzold measured, in place of
    `water`: absorption, scattering and phase function move together. Not with `attenuation_per_m`."""
    detection_model: str | None = None
    """TOML file of a fitted detection model for the beacons fidelity, in place of the detector's own."""
    station: ConicalStationCfg = field(default_factory=load_conical_station)
    sim: SimCfg = SimCfg()
    camera: CameraCfg = CameraCfg()
    imaging: ImagingCfg = ImagingCfg()
    nuisance: NuisanceCfg = NuisanceCfg()
    start: StartCfg = StartCfg()
    limits: LimitsCfg = LimitsCfg()
    control_hz: float = 30.0
    """Commands a second."""
    latency: LatencyCfg = LatencyCfg()
    station_heading: Literal["surveyed", "unknown"] = "surveyed"
    """"surveyed", or "unknown": each episode then draws a datum in ±180° that is added to every compass reading, and
    the station's heading by that compass must be perceived."""
    clock: BeaconClockCfg = BeaconClockCfg()
    """Error of the vehicle's clock against the station's; it matters with a rotating beacon only."""
    frame_drop_share: Annotated[float, between(0.0, 0.95)] = 0.0
    """Share of the camera's frames that are lost at random."""
    extra_lights: tuple[BeaconCfg, ...] = ()
    """Lamps, placed in the station frame, of which the vehicle has not been told."""

    def __post_init__(self) -> None:
        """Refuse rates that do not divide, and lamps and starts that have no place."""
        taken = {light.name for light in self.station.beacons} | {f"B{n}" for n in range(self.station.array_count)}
        for light in self.extra_lights:
            if light.name in taken:
                raise ConfigError("extra_lights", light.name, "a name that no other light has, the station's included")
            taken.add(light.name)
        check_rates(self.sim.physics_hz, self.control_hz, self.camera.rate_hz)
        for index, light in enumerate(self.extra_lights):
            low_m, high_m = -self.station.floor_below_m, self.station.depth_m
            if not low_m <= light.position_m[2] <= high_m:
                remedy = f"a height above the mouth's centre of {low_m:g} m, the floor, to {high_m:g} m, the surface"
                raise ConfigError(f"extra_lights[{index}].position_m", light.position_m[2], remedy)
        self._check_start()

    def _check_start(self) -> None:
        """Refuse starts of which some draw would lie out of the water, in the ground or in the station.

        A start is level, with any heading.
        """
        start, station = self.start, self.station
        with located("sim."):
            room = hull_room(self.sim.vehicle)
        up_m, down_m = station.depth_m - room.above_m, station.floor_below_m - room.below_m
        if up_m <= 0.0:
            raise ConfigError("station.depth_m", station.depth_m, f"more than {room.above_m:g} m for the vehicle")
        if down_m <= 0.0:
            raise ConfigError(
                "station.floor_below_m", station.floor_below_m, f"more than {room.below_m:g} m for the vehicle"
            )
        if start.vertical_m > min(up_m, down_m):
            raise ConfigError(
                "start.vertical_m",
                start.vertical_m,
                f"at most {math.floor(1e3 * min(up_m, down_m)) / 1e3:g} m, so that the whole vehicle starts below the "
                f"surface ({station.depth_m:g} m above the mouth's centre) and above the floor "
                f"({station.floor_below_m:g} m below it)",
            )
        clear_m = room.around_m
        if start.ring:
            funnel = station.funnel
            behind = start.azimuth_deg > 90.0
            length_m = funnel.length_m + funnel.tube_length_m if behind else 0.0
            clear_m += math.hypot(length_m, funnel.mouth_radius_m)
        if start.min_range_m < clear_m:
            remedy = f"{math.ceil(1e3 * clear_m) / 1e3:g} m or more, so that no start touches the station"
            raise ConfigError("start.min_range_m", start.min_range_m, remedy)


def check_rates(physics_hz: float, control_hz: float, camera_hz: float) -> None:
    """Refuse rates of control and camera that do not divide the physics rate.

    Raises:
        ConfigError: one that does not.
    """
    for name, rate in (("control_hz", control_hz), ("camera.rate_hz", camera_hz)):
        steps = physics_hz / rate if rate > 0.0 else 0.0
        if not 1.0 <= steps < 1e6 or abs(steps - round(steps)) > 1e-9:
            raise ConfigError(name, rate, f"a rate that divides the physics rate of {physics_hz:g} Hz")


def rotating_world_cfg() -> WorldCfg:
    """The world of docking by a rotating beacon: paper B's pool, a ring of starts, the station's heading unknown.

    Half a circle at 12 m and the way there from 45 m take some 110 m, 200 s at the pilot's speeds in a current of
    0.3 m/s; `max_time_s` leaves room for a second search and a second approach.
    """
    return WorldCfg(
        water="pool",
        station=load_conical_station("rotating"),
        start=StartCfg(ring=True, min_range_m=20.0, max_range_m=45.0, heading_deg=180.0),
        limits=LimitsCfg(max_time_s=600.0),
        station_heading="unknown",
    )
