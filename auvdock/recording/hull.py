"""The vehicle's solid parts as Rerun's shapes."""

from __future__ import annotations

import math

import numpy as np
import rerun as rr

from auvdock.core.marine import flip_vector
from auvdock.core.vehicle import HullPartCfg, VehicleCfg
from auvdock.recording import paths
from auvdock.recording.palette import rgba

__all__ = ["hull_shapes"]

_COLOUR = rgba(250, 190, 40)


def hull_shapes(vehicle: VehicleCfg) -> dict[str, rr.AsComponents]:
    """Entity path and shape of each solid part, in the body frame."""
    parts = vehicle.hull_parts
    if len(parts) == 1:
        return {paths.HULL: _shape(parts[0])}
    return {f"{paths.HULL}/{rr.escape_entity_path_part(part.name)}": _shape(part) for part in parts}


def _shape(part: HullPartCfg) -> rr.AsComponents:
    centre = flip_vector(np.array(part.position_m))
    length, width, height = part.size_m
    solid = rr.components.FillMode.Solid
    if part.shape == "box":
        half = [[0.5 * length, 0.5 * width, 0.5 * height]]
        return rr.Boxes3D(half_sizes=half, centers=[centre], colors=[_COLOUR], fill_mode=solid)
    # Round shapes point along z; the quarter turn about y lays them along x.
    quarter = [rr.Quaternion(xyzw=[0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)])]
    radius = 0.5 * width
    if part.shape == "cylinder":
        return rr.Cylinders3D(
            lengths=[length], radii=[radius], centers=[centre], quaternions=quarter, colors=[_COLOUR], fill_mode=solid
        )
    # A capsule stands on its first cap's centre.
    start = centre - np.array([0.5 * length - radius, 0.0, 0.0])
    return rr.Capsules3D(
        lengths=[length - width],
        radii=[radius],
        translations=[start],
        quaternions=quarter,
        colors=[_COLOUR],
        fill_mode=solid,
    )
