"""How much of a vehicle is under water, and where: the sea ends at z = 0."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.marine import flip_vector
from auvdock.core.vehicle import HullPartCfg, VehicleCfg
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records
from auvdock.numeric.rotations import rotation_of_quat_wxyz
from auvdock.numeric.scalars import cross
from auvdock.sim.actuation import Actuator
from auvdock.sim.hydrodynamics import Hull

__all__ = ["Piece", "clearance_m", "cut_hull", "immerse"]

_SLICES = 24
"""Slices of a round part along its axis."""
_LAYERS, _MOST_CELLS = 3, 12
"""Cells of a box along its shortest edge, and the most along any."""


@dataclass(frozen=True)
class Piece(Record):
    """A piece of the displaced volume, immersed as a disc that stands upright is."""

    place_m: Annotated[Array, 3]
    """In the body frame."""
    radius_m: float
    weight: float
    """Share of the volume; all add up to 1."""


def cut_hull(vehicle: VehicleCfg) -> Records[Piece]:
    """(m,) pieces of a vehicle's displaced volume: slices of a round part, cells of a box.

    Each is immersed as a disc that stands upright is, so a level cylinder exactly, at other attitudes and for boxes to
    some hundredths of the volume. A piece's buoyancy depends on its own height alone, so that all of it has a potential
    and does no work over a closed path. The pieces' weights are their volumes, tilted linearly so that their middle is
    the vehicle's origin: that is the centre of buoyancy by the vehicle's data, while a torpedo's tail, which its hull
    does not show, tapers. Still water without waves; air does nothing.

    Raises:
        ConfigError: a hull about the centre of buoyancy of which no volume can be spread.
    """
    places, radii, volumes = (
        np.concatenate(parts) for parts in zip(*(_cut(part) for part in vehicle.displacing_parts), strict=True)
    )
    pieces = Piece.zeros(len(volumes))
    pieces["place_m"], pieces["radius_m"], pieces["weight"] = places, radii, volumes
    pieces["weight"] = _balanced(pieces["place_m"], pieces["weight"], vehicle.name)
    return pieces


def clearance_m(pieces: Records[Piece], actuators: Records[Actuator]) -> float:
    """Depth of the origin from which all of the vehicle is under water, whatever its attitude."""
    reach = [np.linalg.norm(parts["place_m"], axis=1) + parts["radius_m"] for parts in (pieces, actuators)]
    return float(np.concatenate(reach).max())


@compiled
def immerse(
    qpos: Array, qvel: Array, pieces: Records[Piece], hull: Records[Hull], actuators: Records[Actuator]
) -> None:
    """Work out what of the hull and of each actuator is under water: the sea ends at z = 0.

    A disc of radius a that stands upright with its middle at height z is immersed to the share
    f = (arccos t − t √(1 − t²)) / π of its area, t = z / a between −1 and 1.

    Args:
        qpos: (7,) position and quaternion wxyz of the body.
        qvel: (6,) velocity in the world frame, angular velocity in the body frame.
        pieces: (m,) of the hull.
        hull: (1,) takes its immersed share s, ds/dt while s grows, and the moment Σ f w p of the pieces at p.
        actuators: (n,) take their immersed shares; radius 0 takes the hull's.
    """
    _, _, (up_x, up_y, up_z) = rotation_of_quat_wxyz(qpos[3:])
    rate = qvel[3:]
    rise_x, rise_y, rise_z = cross(up_x, up_y, up_z, rate[0], rate[1], rate[2])
    dry, growth, moment = 0.0, 0.0, hull[0].moment_m
    for i in range(3):
        moment[i] = 0.0
    for i in range(len(pieces)):
        place, radius, weight = pieces[i].place_m, pieces[i].radius_m, pieces[i].weight
        a, b, c = place[0], place[1], place[2]
        t = (qpos[2] + up_x * a + up_y * b + up_z * c) / radius
        if t <= -1.0:
            continue
        t = min(t, 1.0)
        chord = math.sqrt(1.0 - t * t)
        part = weight * (1.0 - (math.acos(t) - t * chord) / math.pi)
        dry += part
        growth -= weight * 2.0 / math.pi * chord / radius * (qvel[2] + rise_x * a + rise_y * b + rise_z * c)
        # The whole hull's moment is nothing: what is out of the water tells the rest's.
        moment[0] -= part * a
        moment[1] -= part * b
        moment[2] -= part * c
    hull[0].immersed, hull[0].growth_1_s = max(0.0, 1.0 - dry), max(0.0, growth)
    for i in range(len(actuators)):
        place, radius = actuators[i].place_m, actuators[i].radius_m
        if radius > 0.0:
            height = qpos[2] + up_x * place[0] + up_y * place[1] + up_z * place[2]
            t = min(max(height / radius, -1.0), 1.0)
            actuators[i].immersed = (math.acos(t) - t * math.sqrt(1.0 - t * t)) / math.pi
        else:
            actuators[i].immersed = hull[0].immersed


def _cut(part: HullPartCfg) -> tuple[Array, Array, Array]:
    """Pieces of a hull part: places (m, 3) in package body axes, radii (m,), volumes (m,)."""
    middle = flip_vector(np.array(part.position_m))
    length, width, _ = part.size_m
    if part.shape == "box":
        edges = np.array(part.size_m)
        counts = np.clip(np.rint(_LAYERS * edges / edges.min()), _LAYERS, _MOST_CELLS).astype(np.int64)
        steps = edges / counts
        axes = [(np.arange(count) - 0.5 * (count - 1)) * step for count, step in zip(counts, steps, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        radii, volumes = np.full(len(places), 0.5 * steps.mean()), np.full(len(places), steps.prod())
    else:
        x = ((np.arange(_SLICES) + 0.5) / _SLICES - 0.5) * length
        places = np.column_stack([x, np.zeros(_SLICES), np.zeros(_SLICES)])
        radii = np.full(_SLICES, 0.5 * width)
        if part.shape == "capsule":
            into_cap = np.maximum(0.0, np.abs(x) - 0.5 * (length - width))
            radii = np.sqrt(radii**2 - into_cap**2)
        volumes = math.pi * radii**2 * length / _SLICES
    return middle + places, radii, volumes


def _balanced(places: Array, volumes: Array, name: str) -> Array:
    """Volumes turned into weights that add up to 1 and have their middle in the origin."""
    shares = volumes / volumes.sum()
    middle = shares @ places
    about = places - middle
    tilt = np.linalg.lstsq((about.T * shares) @ about, -middle)[0]
    weights = shares * (1.0 + about @ tilt)
    if np.any(weights <= 0.0) or np.abs(weights @ places).max() > 1e-6:
        raise ConfigError("hull", name, "parts whose volume lies about the origin, the centre of buoyancy")
    return weights
