"""How much of a vehicle is under water, and where: the sea ends at z = 0."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.marine import flip_vector
from auvdock.core.vehicle import HullPartCfg, VehicleCfg
from auvdock.numeric.compiled import compiled
from auvdock.numeric.rotations import rotation_of_quat_wxyz
from auvdock.numeric.scalars import cross

__all__ = ["Immersion", "immerse"]

_SLICES = 24
"""Slices of a round part along its axis."""
_LAYERS, _MOST_CELLS = 3, 12
"""Cells of a box along its shortest edge, and the most along any."""


class Immersion:
    """What of a vehicle is under water, for `stepping.advance`.

    The displaced volume is cut into pieces: slices of a round part, cells of a box. Each is immersed as a disc that
    stands upright is, so a level cylinder exactly, at other attitudes and for boxes to some hundredths of the volume.
    A piece's buoyancy depends on its own height alone, so that all of it has a potential and does no work over a
    closed path. The pieces' weights are their volumes, tilted linearly so that their middle is the vehicle's origin:
    that is the centre of buoyancy by the vehicle's data, while a torpedo's tail, which its hull does not show,
    tapers. Still water without waves; air does nothing.

    Attributes:
        clearance_m: the vehicle is under water as long as its origin is this deep, whatever its attitude.
        pieces: (m, 5) see `immerse`.
        under: (5 + n,) likewise, of a vehicle that is all under water.
    """

    def __init__(self, vehicle: VehicleCfg) -> None:
        """Cut the hull into pieces.

        Raises:
            ConfigError: a hull about the centre of buoyancy of which no volume can be spread.
        """
        self.pieces = _balanced(np.concatenate([_cut(part) for part in vehicle.displacing_parts]), vehicle.name)
        places = [flip_vector(np.array(actuator.position_m)) for actuator in vehicle.actuators]
        # A fin's place is in no vehicle's data: it fares as the hull does.
        reach = [0.5 * part.disc_diameter_m if part.kind == "thruster" else 0.0 for part in vehicle.actuators]
        self._actuators: Array = np.column_stack([np.array(places), np.array(reach)])
        spheres = np.concatenate([self.pieces[:, :4], self._actuators])
        self.clearance_m = float(np.max(np.linalg.norm(spheres[:, :3], axis=1) + spheres[:, 3]))
        self.under: Array = np.ones(5 + len(reach))
        self.under[1:5] = 0.0
        self._near = self.under.copy()

    def of(self, qpos: Array, qvel: Array) -> Array:
        """(5 + n,) what `immerse` says of a state (7,), (6,) of the body; good until the next call."""
        if qpos[2] < -self.clearance_m:
            return self.under
        immerse(qpos, qvel, self.pieces, self._actuators, self._near)
        return self._near


@compiled
def immerse(qpos: Array, qvel: Array, pieces: Array, actuators: Array, out: Array) -> None:
    """What of the hull and of each actuator is under water.

    A disc of radius a that stands upright with its middle at height z is immersed to the share
    f = (arccos t − t √(1 − t²)) / π of its area, t = z / a between −1 and 1.

    Args:
        qpos: (7,) position and quaternion wxyz of the body.
        qvel: (6,) velocity in the world frame, angular velocity in the body frame.
        pieces: (m, 5) of the hull: place in the body frame, radius a, weight; weights add up to 1.
        actuators: (n, 4) place in the body frame and radius; radius 0 takes the hull's share.
        out: (5 + n,) takes the hull's share s, in which exactly 1 is all; ds/dt in 1/s while it grows, else 0; the
            moment Σ f w p of the shares about the origin in m, body frame (3); the actuators' shares.
    """
    _, _, (up_x, up_y, up_z) = rotation_of_quat_wxyz(qpos[3], qpos[4], qpos[5], qpos[6])
    rise_x, rise_y, rise_z = cross(up_x, up_y, up_z, qvel[3], qvel[4], qvel[5])
    dry, growth = 0.0, 0.0
    for i in range(5):
        out[i] = 0.0
    for i in range(len(pieces)):
        a, b, c, radius, weight = pieces[i, 0], pieces[i, 1], pieces[i, 2], pieces[i, 3], pieces[i, 4]
        t = (qpos[2] + up_x * a + up_y * b + up_z * c) / radius
        if t <= -1.0:
            continue
        t = min(t, 1.0)
        chord = math.sqrt(1.0 - t * t)
        part = weight * (1.0 - (math.acos(t) - t * chord) / math.pi)
        dry += part
        growth -= weight * 2.0 / math.pi * chord / radius * (qvel[2] + rise_x * a + rise_y * b + rise_z * c)
        # The whole hull's moment is nothing: what is out of the water tells the rest's.
        out[2] -= part * a
        out[3] -= part * b
        out[4] -= part * c
    out[0], out[1] = max(0.0, 1.0 - dry), max(0.0, growth)
    for i in range(len(actuators)):
        a, b, c, radius = actuators[i, 0], actuators[i, 1], actuators[i, 2], actuators[i, 3]
        if radius > 0.0:
            t = min(max((qpos[2] + up_x * a + up_y * b + up_z * c) / radius, -1.0), 1.0)
            out[5 + i] = (math.acos(t) - t * math.sqrt(1.0 - t * t)) / math.pi
        else:
            out[5 + i] = out[0]


def _cut(part: HullPartCfg) -> Array:
    """(m, 5) pieces of a hull part: place in package body axes, radius, volume."""
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
    return np.column_stack([middle + places, radii, volumes])


def _balanced(pieces: Array, name: str) -> Array:
    """Volumes turned into weights that add up to 1 and have their middle in the origin."""
    places, volumes = pieces[:, :3], pieces[:, 4]
    shares = volumes / volumes.sum()
    middle = shares @ places
    about = places - middle
    tilt = np.linalg.lstsq((about.T * shares) @ about, -middle)[0]
    weights = shares * (1.0 + about @ tilt)
    if np.any(weights <= 0.0) or np.abs(weights @ places).max() > 1e-6:
        raise ConfigError("hull", name, "parts whose volume lies about the origin, the centre of buoyancy")
    return np.column_stack([pieces[:, :4], weights])
