"""Beacons and their layout on a station: what the station carries and what the vehicle has been told of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive, PositiveShare, between

__all__ = ["BeaconCfg", "BeaconLayout", "BeamAngle", "WavelengthNm", "ring_layout"]

BeamAngle = Annotated[float, between(0.5, 360.0)]
"""Full angle of a beam, degrees."""
WavelengthNm = Annotated[float, between(380.0, 720.0, "which is visible")]
"""Dominant wavelength of a lamp."""


@dataclass(frozen=True)
class BeaconCfg(Checked):
    """One light, in the station frame.

    The station frame has its origin in the centre of the mouth, x along the approach axis out towards the vehicle,
    z up, y completing a right-handed frame: seen from the approaching vehicle +y is to the right.
    """

    name: str
    """Unique name; the array's are B0, B1, ... in the order of paper A's layout."""
    role: Literal["array", "long_range", "entrance"]
    """What it is for: pose by PnP, far line of sight, near line of sight (paper A, section 3.1)."""
    position_m: tuple[float, float, float]
    """Position in the station frame."""
    axis: tuple[float, float, float]
    """Direction of the beam's axis in the station frame; any length."""
    wavelength_nm: WavelengthNm
    """Dominant wavelength: 450 is blue, 620 red."""
    power_w: Positive
    """Electrical power."""
    efficiency: PositiveShare
    """Radiant flux over electrical power."""
    beam_angle_deg: BeamAngle
    """Full beam angle at half of the peak intensity."""

    def __post_init__(self) -> None:
        """Refuse a beam without direction."""
        if not sum(part * part for part in self.axis) > 0.0:
            raise ConfigError("axis", self.axis, "a direction of non-zero length")


@dataclass(frozen=True)
class BeaconLayout:
    """All lights of a station, in a fixed order."""

    beacons: tuple[BeaconCfg, ...]

    def __post_init__(self) -> None:
        """Check names and that the array can give a pose."""
        names = [beacon.name for beacon in self.beacons]
        if len(set(names)) != len(names):
            raise ConfigError("beacons", names, "a different name for each beacon")
        count = len(self.indices("array"))
        if count < 4:
            raise ConfigError(
                "beacons",
                f"{count} with role 'array'",
                "at least 4 array beacons, PnP needs 4 for a unique pose",
            )

    def indices(self, role: str) -> tuple[int, ...]:
        """Indices of the beacons with a role."""
        return tuple(index for index, beacon in enumerate(self.beacons) if beacon.role == role)

    @cached_property
    def positions_m(self) -> Array:
        """(n, 3) positions in the station frame."""
        return np.array([beacon.position_m for beacon in self.beacons])

    @cached_property
    def axes(self) -> Array:
        """(n, 3) unit beam axes in the station frame."""
        axes = np.array([beacon.axis for beacon in self.beacons])
        return axes / np.linalg.norm(axes, axis=1, keepdims=True)

    @cached_property
    def array_positions_m(self) -> Array:
        """(k, 3) positions of the array beacons B0, B1, ... in the station frame."""
        return self.positions_m[list(self.indices("array"))]


def ring_layout(
    count: int,
    radius_m: float,
    *,
    first_angle_deg: float = 60.0,
    inward_tilt_deg: float = 6.0,
    wavelength_nm: float = 450.0,
    power_w: float = 10.0,
    efficiency: float = 0.35,
    beam_angle_deg: float = 45.0,
) -> tuple[BeaconCfg, ...]:
    """Array beacons on a circle in the plane of the mouth, numbered clockwise as the approaching vehicle sees them.

    With six lights and the defaults this is paper A's array: B0 top right, B1 right-most, B2 bottom right, B3 bottom
    left, B4 left-most, B5 top left; opposite pairs (0, 3), (1, 4), (2, 5); beams of 45° tilted 6° inwards, where the
    paper's table 5 has its greatest guidance space.
    """
    tilt = math.radians(inward_tilt_deg)
    beacons: list[BeaconCfg] = []
    for index in range(count):
        angle = math.radians(first_angle_deg) - 2.0 * math.pi * index / count
        right, up = math.cos(angle), math.sin(angle)
        beacons.append(
            BeaconCfg(
                name=f"B{index}",
                role="array",
                position_m=(0.0, radius_m * right, radius_m * up),
                axis=(math.cos(tilt), -math.sin(tilt) * right, -math.sin(tilt) * up),
                wavelength_nm=wavelength_nm,
                power_w=power_w,
                efficiency=efficiency,
                beam_angle_deg=beam_angle_deg,
            )
        )
    return tuple(beacons)
