"""Triangle meshes of surfaces of revolution."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from auvdock.core.arrays import Array

__all__ = ["Mesh", "beam_cone", "frustum"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices_m: (n, 3).
        normals: (n, 3) unit, away from the axis.
        triangles: (m, 3) indices of vertices.
    """

    vertices_m: Array
    normals: Array
    triangles: NDArray[np.uint32]

    def shown(self, colour: int) -> rr.Mesh3D:
        """The mesh as Rerun shows it, in one colour."""
        return rr.Mesh3D(
            vertex_positions=self.vertices_m,
            vertex_normals=self.normals,
            triangle_indices=self.triangles,
            albedo_factor=colour,
        )


def frustum(
    start_m: Array, direction: Array, length_m: float, start_radius_m: float, end_radius_m: float, segments: int = 32
) -> Mesh:
    """The mantle of a cone's frustum, a cylinder if both radii are the same; the ends stay open.

    Args:
        start_m: (3,) centre of the first circle.
        direction: (3,) axis, any length.
        length_m: distance between the circles.
        start_radius_m: radius of the first circle.
        end_radius_m: radius of the second one.
        segments: number of flat strips around.
    """
    axis = direction / np.linalg.norm(direction)
    # Any vector that is not parallel to the axis spans the plane of the circles with it.
    helper = np.array([0.0, 0.0, 1.0]) if abs(float(axis[2])) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = np.cross(helper, axis)
    across /= np.linalg.norm(across)
    angles = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    radial = np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * np.cross(axis, across)
    vertices = np.vstack([start_m + start_radius_m * radial, start_m + length_m * axis + end_radius_m * radial])
    slope = start_radius_m - end_radius_m
    normals = (length_m * radial + slope * axis) / math.hypot(length_m, slope)
    first = np.arange(segments)
    second = (first + 1) % segments
    triangles = np.vstack(
        [
            np.column_stack([first, second, first + segments]),
            np.column_stack([second, second + segments, first + segments]),
        ]
    )
    return Mesh(vertices, np.vstack([normals, normals]), triangles.astype(np.uint32))


def beam_cone(apex_m: Array, axis: Array, beam_angle_deg: float, length_m: float) -> Mesh:
    """The cone in which a lamp gives at least half of its peak intensity, `length_m` along its surface.

    Angles of more than 160 degrees are drawn as 160: wider ones are no cones to look at.
    """
    half = math.radians(min(beam_angle_deg, 160.0)) / 2.0
    return frustum(apex_m, axis, length_m * math.cos(half), 0.0, length_m * math.sin(half), segments=24)
