"""Configuration of a landing world: platform, vehicle, water, belly camera with its lamps, and where it starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from auvdock.core.calibrated_camera import CalibratedCameraCfg
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.landing_station import LandingStationCfg, load_landing_station
from auvdock.core.limits import NotNegative, at_least
from auvdock.envs.config import Fidelity, LimitsCfg, check_rates
from auvdock.envs.latency import LatencyCfg
from auvdock.envs.room import hull_room
from auvdock.optics.faults import FaultCfg
from auvdock.optics.lamp import LampCfg
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import WaterCfg
from auvdock.sim.simulator import SimCfg

__all__ = ["LandingStartCfg", "LandingWorldCfg"]


@dataclass(frozen=True)
class LandingStartCfg(Checked):
    """Where a landing starts; each quantity is drawn uniformly."""

    min_height_m: Annotated[float, at_least(0.5)] = 3.0
    """Least height of the seat above its place in the guides."""
    max_height_m: float = 6.0
    """Greatest such height."""
    lateral_m: NotNegative = 1.5
    """Greatest distance from the station's vertical, along and across the centre line each."""
    heading_deg: NotNegative = 45.0
    """Greatest heading difference to the centre line."""
    random_current_direction: bool = True
    """Draw the current's direction uniformly instead of taking sim.current.direction_deg."""

    def __post_init__(self) -> None:
        """Refuse heights out of order."""
        if self.min_height_m > self.max_height_m:
            raise ConfigError("min_height_m", self.min_height_m, "at most max_height_m")


@dataclass(frozen=True)
class LandingWorldCfg(Checked):
    """Everything outside the head of a vehicle that lands."""

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
    """TOML file of a fitted detection model of the lights for the beacons fidelity, in place of the detector's own."""
    station: LandingStationCfg = field(default_factory=load_landing_station)
    sim: SimCfg = SimCfg(vehicle="bluerov2_heavy")
    camera: CalibratedCameraCfg = CalibratedCameraCfg()
    """The belly camera; paper C's by default."""
    imaging: ImagingCfg = field(default_factory=landing_imaging)
    lamp: LampCfg | None = LampCfg()
    """The vehicle's own lamps beside its belly camera."""
    faults: FaultCfg = FaultCfg()
    nuisance: NuisanceCfg = NuisanceCfg()
    start: LandingStartCfg = LandingStartCfg()
    limits: LimitsCfg = LimitsCfg()
    control_hz: float = 20.0
    """Commands a second; the paper's loop runs at 20 Hz, as its camera does. A multiple of the camera's rate."""
    latency: LatencyCfg = LatencyCfg()

    def __post_init__(self) -> None:
        """Refuse rates that do not divide, and starts that have no place."""
        check_rates(self.sim.physics_hz, self.control_hz, self.camera.rate_hz)
        periods = self.control_hz / self.camera.rate_hz
        if abs(periods - round(periods)) > 1e-9:
            raise ConfigError("control_hz", self.control_hz, f"a multiple of the camera's {self.camera.rate_hz:g} Hz")
        self._check_start()

    def _check_start(self) -> None:
        """Refuse starts of which some draw would lie out of the water or in the guides; a start is level."""
        start, guide = self.start, self.station.guide
        with located("sim."):
            room = hull_room(self.sim.vehicle)
        most_m = self.station.depth_m - guide.seat_height_m - room.above_seat_m
        least_m = guide.top_m - guide.seat_height_m + room.below_seat_m
        if start.max_height_m > most_m:
            raise ConfigError(
                "start.max_height_m",
                start.max_height_m,
                f"at most {math.floor(1e3 * most_m) / 1e3:g} m, a start below the surface: the station lies "
                f"{self.station.depth_m:g} m deep",
            )
        if start.min_height_m < least_m:
            remedy = f"{math.ceil(1e3 * least_m) / 1e3:g} m or more, a start above the guides"
            raise ConfigError("start.min_height_m", start.min_height_m, remedy)
