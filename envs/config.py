"""Configuration of a docking world: station, vehicle, water, camera and where an episode starts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from auvdock.core.camera import CameraCfg
from auvdock.core.errors import ConfigError
from auvdock.core.station import ConicalStationCfg, load_conical_station
from auvdock.optics.imaging import ImagingCfg
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.sim.simulator import SimCfg

__all__ = ["FIDELITIES", "LimitsCfg", "StartCfg", "WorldCfg"]

FIDELITIES = ("pixels", "beacons")
"""`pixels` renders every frame; `beacons` draws detections from the same radiometry without an image."""


@dataclass(frozen=True)
class StartCfg:
    """Where an episode starts; each quantity is drawn uniformly."""

    min_range_m: float = 15.0
    """Least distance in front of the mouth."""
    max_range_m: float = 30.0
    """Greatest distance in front of the mouth."""
    lateral_m: float = 3.0
    """Greatest distance sideways from the approach axis."""
    vertical_m: float = 1.5
    """Greatest depth difference to the mouth's centre."""
    heading_deg: float = 30.0
    """Greatest heading difference to the approach axis."""
    random_current_direction: bool = False
    """Draw the current's direction uniformly instead of taking sim.current.direction_deg."""

    def __post_init__(self) -> None:
        """Refuse impossible starts."""
        if not 2.0 <= self.min_range_m <= self.max_range_m:
            raise ConfigError("world.start.min_range_m", self.min_range_m, "2 m or more and at most max_range_m")
        for name in ("lateral_m", "vertical_m", "heading_deg"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ConfigError(f"world.start.{name}", getattr(self, name), "0 or more")


@dataclass(frozen=True)
class LimitsCfg:
    """What ends an episode without success."""

    max_time_s: float = 240.0
    """Simulated time."""
    collision_force_n: float = 2000.0
    """A contact harder than this ends the episode as `collision`."""

    def __post_init__(self) -> None:
        """Refuse limits that end every episode at once."""
        for name in ("max_time_s", "collision_force_n"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"world.limits.{name}", getattr(self, name), "a number above 0")


@dataclass(frozen=True)
class WorldCfg:
    """Everything outside the vehicle's head."""

    fidelity: str = "pixels"
    """"pixels" or "beacons"."""
    water: str = "clear"
    """Water preset: Jerlov "I" to "9C", "clear", "pool", "lake"."""
    attenuation_per_m: float | None = None
    """Beam attenuation c at 450 nm in 1/m in place of the preset's."""
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

    def __post_init__(self) -> None:
        """Check that the rates divide and the names exist."""
        if self.fidelity not in FIDELITIES:
            raise ConfigError("fidelity", self.fidelity, f"one of {', '.join(FIDELITIES)}")
        for name, rate in (("world.control_hz", self.control_hz), ("world.camera.rate_hz", self.camera.rate_hz)):
            steps = self.sim.physics_hz / rate if rate > 0.0 else 0.0
            if steps < 1.0 or abs(steps - round(steps)) > 1e-9:
                raise ConfigError(name, rate, f"a rate that divides the physics rate of {self.sim.physics_hz:g} Hz")
