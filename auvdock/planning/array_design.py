"""An array of lights as a vector of numbers, for the optimiser: mirror-symmetric about the axis' upright plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Positive, at_least, at_most, between
from auvdock.planning.paper_a import PaperALamp

__all__ = ["ArrayBounds", "ArrayDesign", "bounds_of", "decode", "paper_lamps", "physical_layout", "ring_vector"]


@dataclass(frozen=True)
class ArrayBounds(Checked):
    """What the optimiser may choose from."""

    lights: Annotated[int, between(4, 16)] = 6
    """Number of lights; an odd one stands on the upright plane."""
    min_radius_m: Positive = 0.5
    """Least distance from the axis."""
    max_radius_m: float = 1.0
    """Greatest distance from the axis: the mouth's rim."""
    min_tilt_deg: float = -10.0
    """Least inward tilt; negative is outwards."""
    max_tilt_deg: float = 30.0
    """Greatest inward tilt."""
    min_beam_deg: Annotated[float, at_least(1.0)] = 5.0
    """Narrowest beam, full angle."""
    max_beam_deg: Annotated[float, at_most(179.0)] = 70.0
    """Widest beam."""
    min_gap_m: float = 0.3
    """Least distance between two lights."""

    def __post_init__(self) -> None:
        """Refuse bounds that hold no layout."""
        for name in ("radius_m", "tilt_deg", "beam_deg"):
            low, high = getattr(self, f"min_{name}"), getattr(self, f"max_{name}")
            if low > high:
                raise ConfigError(f"min_{name}", low, f"a number of at most max_{name} ({high:g})")
        if self.min_gap_m * self.lights > 2.0 * math.pi * self.max_radius_m:
            raise ConfigError("min_gap_m", self.min_gap_m, f"less: {self.lights} lights do not fit on the rim")


@dataclass(frozen=True, eq=False)
class ArrayDesign:
    """One array.

    Attributes:
        azimuth_rad: (n,) direction from the axis, 0 up, positive to the right as the vehicle sees it.
        radius_m: (n,) distance from the axis.
        inward_tilt_deg: (n,) tilt of each beam.
        beam_deg: full beam angle of all lights.
    """

    azimuth_rad: Array
    radius_m: Array
    inward_tilt_deg: Array
    beam_deg: float

    def least_gap_m(self) -> float:
        """Least distance between two lights."""
        places = np.column_stack([self.radius_m * np.sin(self.azimuth_rad), self.radius_m * np.cos(self.azimuth_rad)])
        gap = np.linalg.norm(places[:, None] - places[None], axis=2)
        return float(gap[np.triu_indices(len(places), 1)].min())


def bounds_of(cfg: ArrayBounds) -> list[tuple[float, float]]:
    """Bounds of the vector: beam angle; azimuth, radius, tilt of each pair; radius and tilt of an odd light."""
    one = [(0.03, math.pi - 0.03), (cfg.min_radius_m, cfg.max_radius_m), (cfg.min_tilt_deg, cfg.max_tilt_deg)]
    bounds = [(cfg.min_beam_deg, cfg.max_beam_deg)]
    for _ in range(cfg.lights // 2):
        bounds += one
    return bounds + (one[1:] if cfg.lights % 2 else [])


def decode(vector: Array, lights: int) -> ArrayDesign:
    """The array that a vector stands for."""
    pairs = vector[1 : 1 + 3 * (lights // 2)].reshape(-1, 3)
    azimuth, radius, tilt = (np.concatenate([pairs[:, k], sign * pairs[:, k]]) for k, sign in ((0, -1), (1, 1), (2, 1)))
    if lights % 2:
        azimuth, radius, tilt = np.append(azimuth, 0.0), np.append(radius, vector[-2]), np.append(tilt, vector[-1])
    return ArrayDesign(azimuth, radius, tilt, float(vector[0]))


def ring_vector(cfg: ArrayBounds, beam_deg: float, inward_tilt_deg: float) -> Array:
    """The vector of the paper's ring on the rim, as far as the bounds allow: where a search may start."""
    first = math.pi / cfg.lights if cfg.lights % 2 == 0 else 2.0 * math.pi / cfg.lights
    vector = [beam_deg]
    for pair in range(cfg.lights // 2):
        vector += [first + 2.0 * math.pi * pair / cfg.lights, cfg.max_radius_m, inward_tilt_deg]
    vector += [cfg.max_radius_m, inward_tilt_deg] if cfg.lights % 2 else []
    low, high = np.array(bounds_of(cfg)).T
    return np.clip(np.array(vector), low, high)


def physical_layout(design: ArrayDesign, others: BeaconLayout, power_w: float) -> BeaconLayout:
    """The array in place of that of `others`, whose remaining lights are kept; `power_w` is each light's.

    Lights are numbered clockwise from the top as the approaching vehicle sees them.
    """
    pattern = others.beacons[others.indices("array")[0]]
    order = np.argsort(np.mod(design.azimuth_rad, 2.0 * math.pi), kind="stable")
    lamps: list[BeaconCfg] = []
    for number, index in enumerate(order):
        right, up = math.sin(design.azimuth_rad[index]), math.cos(design.azimuth_rad[index])
        radius, tilt = float(design.radius_m[index]), math.radians(float(design.inward_tilt_deg[index]))
        lamps.append(
            BeaconCfg(
                name=f"B{number}",
                role="array",
                position_m=(float(pattern.position_m[0]), radius * right, radius * up),
                axis=(math.cos(tilt), -math.sin(tilt) * right, -math.sin(tilt) * up),
                wavelength_nm=pattern.wavelength_nm,
                power_w=power_w,
                efficiency=pattern.efficiency,
                beam_angle_deg=design.beam_deg,
            )
        )
    return BeaconLayout((*lamps, *(beacon for beacon in others.beacons if beacon.role != "array")))


def paper_lamps(design: ArrayDesign, relative_intensity: float = 1.0) -> list[PaperALamp]:
    """The array in paper A's model; its x is to the right, its y upwards."""
    lamps: list[PaperALamp] = []
    for azimuth, radius, tilt in zip(design.azimuth_rad, design.radius_m, design.inward_tilt_deg, strict=True):
        phi = 0.5 * math.pi - float(azimuth)
        place = (float(radius) * math.cos(phi), float(radius) * math.sin(phi), 0.0)
        lamps.append(PaperALamp(place, phi, -float(tilt), design.beam_deg, relative_intensity))
    return lamps
