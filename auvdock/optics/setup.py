"""What a camera looks through and at: all that the optics of an episode is made from."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.landing_station import TagCfg
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.optics.faults import FaultCfg
from auvdock.optics.lamp import LampCfg
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import WaterCfg

__all__ = ["OpticalSetup"]


@dataclass(frozen=True, eq=False)
class OpticalSetup:
    """Camera, water, lights and what is wrong with them; both fidelities and their fits are made from it."""

    camera: Camera
    """Intrinsics, distortion and mounting."""
    water: WaterCfg
    """What lies between."""
    layout: BeaconLayout
    """The station's beacons."""
    T_world_station: Array
    """(4, 4) pose of the station frame."""
    imaging: ImagingCfg = ImagingCfg()
    """The camera as an instrument."""
    nuisance: NuisanceCfg = NuisanceCfg()
    """What makes the scene hard."""
    rotating: RotatingBeaconCfg | None = None
    """The station's rotating beacon, if it has one."""
    lamp: LampCfg | None = None
    """The vehicle's own lamps beside the camera, None for none."""
    tag: TagCfg | None = None
    """A marker on the station, None for none."""
    faults: FaultCfg = FaultCfg()
    """Lights that are dead, and when the tag is covered."""
    seen_from: str = "front"
    """"front" for a funnel along x, "above" for a platform whose lights shine up."""
