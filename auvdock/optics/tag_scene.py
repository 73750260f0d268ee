"""The tag as the camera meets it: its place in the image and how bright its cells are. Shared by both fidelities."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.landing_station import TagCfg
from auvdock.core.transforms import invert
from auvdock.numeric.constants import TAG_SQUARE_CELLS
from auvdock.optics.illumination import Illumination
from auvdock.optics.scene import LitScene
from auvdock.optics.tag_pattern import BLACK_SHARE, corners_station_m, tag_to_station
from auvdock.optics.view import View

__all__ = ["TagScene", "TagView"]

_FACING = 0.17
"""Least cosine between the tag's normal and the ray to it: 80°."""


class TagView(NamedTuple):
    """A tag before the camera.

    Attributes:
        corners_px: (4, 2) corners of the black square, in the order of `TagDetection.corners_px`.
        cell_px: mean edge of a cell.
        inside: whether the tag with its white margin lies fully in the image.
        white_e_s: (3,) electrons per second and pixel of a white cell in the middle: red, green, blue.
        black_e_s: (3,) of a black one.
        around_e_s: (3,) on top of both: halos of lamps, backscatter and daylight's veil.
    """

    corners_px: Array
    cell_px: float
    inside: bool
    white_e_s: Array
    black_e_s: Array
    around_e_s: Array


class TagScene:
    """One tag on a station, under the lamps and in the water of a `LitScene`."""

    def __init__(self, lit: LitScene, tag: TagCfg) -> None:
        """Precompute where it lies."""
        self.lit, self.tag = lit, tag
        self.light = Illumination(lit)
        self.cells_to_world = lit.setup.T_world_station[:3, :3] @ tag_to_station(tag)
        self.cells_to_world[:, 2] += lit.setup.T_world_station[:3, 3]
        self.normal_world: Array = lit.setup.T_world_station[:3, 2].copy()
        self.centre_world = self.to_world(corners_station_m(tag)).mean(axis=0)
        self._corners = self.to_world(corners_station_m(tag))
        self._outline = self.to_world(corners_station_m(tag, margin_cells=1.0))

    def to_world(self, points_station: Array) -> Array:
        """(n, 3) points of the station frame in the world."""
        return points_station @ self.lit.setup.T_world_station[:3, :3].T + self.lit.setup.T_world_station[:3, 3]

    def height_m(self, T_world_camera: Array) -> float:
        """Height of the camera above the tag's plane."""
        return float(self.normal_world @ (T_world_camera[:3, 3] - self.centre_world))

    def faces(self, T_world_camera: Array) -> bool:
        """Whether the camera is on the tag's side and before it, with all of it in front of the camera."""
        to_camera = T_world_camera[:3, 3] - self.centre_world
        distance = float(np.linalg.norm(to_camera))
        ahead = (self._outline - T_world_camera[:3, 3]) @ T_world_camera[:3, 2]
        return float(self.normal_world @ to_camera) > _FACING * distance and float(ahead.min()) > 0.02

    def unit_e_s(self, points_world: Array, T_world_camera: Array) -> tuple[Array, Array]:
        """Electrons per second, steradian and unit of reflectance from points (n, 3) of the tag, and their veil.

        The first (n, 3) is E / π e^{-c z}, the second (n, 3) daylight's veil B∞ (1 - e^{-(a + b_b) z}), both red,
        green, blue: the equations of `optics.surfaces`.
        """
        lit = self.lit
        offset = points_world - T_world_camera[:3, 3]
        z = np.linalg.norm(offset, axis=1)[:, None]
        direct = self.light.at(points_world, T_world_camera) / math.pi * np.exp(-z * lit.water.attenuation)
        veil = lit.veil_w_m2_sr(-float(T_world_camera[2, 3]))
        lost = -np.expm1(-z * (lit.water.absorption + lit.water.backscattering))
        return direct @ lit.electrons_per_j.T, (veil * lost) @ lit.electrons_per_j.T

    def look(self, view: View) -> TagView | None:
        """The tag in a frame; None where the camera cannot see its face."""
        T_world_camera = view.T_world_camera
        if not self.faces(T_world_camera):
            return None
        lit = self.lit
        camera = lit.camera
        to_camera = invert(T_world_camera)
        outline = self._outline @ to_camera[:3, :3].T + to_camera[:3, 3]
        inside = bool(np.all(camera.in_view(outline)))
        corners = camera.project(self._corners @ to_camera[:3, :3].T + to_camera[:3, 3])
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
        middle = self.centre_world[None, :]
        unit, veil = self.unit_e_s(middle, T_world_camera)
        ray = (middle - T_world_camera[:3, 3]) @ T_world_camera[:3, :3]
        distance = float(np.linalg.norm(ray))
        solid = lit.lens.rad_per_px**2
        around = veil[0] * solid + self._halos_e_s(view, ray[0] / distance)
        if lit.lamp is not None:
            around += (
                lit.lamp.backscatter_near(corners.mean(axis=0)[None, :], distance)[0] @ lit.electrons_per_j.T * solid
            )
        white = unit[0] * (self.tag.reflectance * solid)
        return TagView(corners, float(edges.mean()) / TAG_SQUARE_CELLS, inside, white, white * BLACK_SHARE, around)

    def _halos_e_s(self, view: View, ray_camera: Array) -> Array:
        """(3,) light of the lamps' halos and cores in the direction of the tag, on the sensor or off it."""
        lit, model = view.in_sight, self.lit.spots
        if not lit.any():
            return np.zeros(3)
        spots = model.spread(view.arrivals, lit)
        angle = np.arccos(np.clip(view.arrivals["ray_camera"][lit] @ ray_camera, -1.0, 1.0))
        radius_px = np.clip(angle / self.lit.lens.rad_per_px, model.radii_px[0], model.radii_px[-1])
        level = np.array(
            [np.interp(radius, model.radii_px, row) for radius, row in zip(radius_px, spots.profile, strict=True)]
        )
        return level @ spots.rows["channel"].copy()
