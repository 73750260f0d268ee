"""Draws the rotating beacon's beam beside its lamp: the streak that one sees of it from the side.

The unscattered light shows the beam sharp: a ribbon along a great circle, Gaussian across, evaluated per pixel of the
coarse grid of `Lens`. What scattering makes of the pieces (`optics.beam_pieces`) is broad and is evaluated on every
second row and column of the grid.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.transforms import cross
from auvdock.numeric.compiled import compiled
from auvdock.optics.beam_pieces import BeamPieces, PieceLight
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet
from auvdock.optics.view import Beam

__all__ = ["BeamImage"]

_ENTRIES = 384
_RIBBON = 256
_LEAST_E = 0.05
"""Electrons in a pixel that are not worth drawing: a hundredth of the read noise."""
_NOTHING = 0.02
"""Of that, what a pixel across the ribbon is left out for."""


class BeamImage:
    """The beam of one rotating beacon on one camera's sensor."""

    def __init__(self, lens: Lens, lights: LightSet, lamp: int) -> None:
        """Precompute rays and the angles at which the pieces' tables are made."""
        self._shape = lens.shape
        # Tables are read at the fourth root of the squared chord: fine near the centre, wide outside.
        self._scale = np.float32((_ENTRIES - 1) / math.sqrt(2.0))
        index = np.arange(_ENTRIES) / float(self._scale)
        self._angle2 = (2.0 * np.arcsin(np.minimum(index**2 / 2.0, 1.0))) ** 2
        self._least_rad = 0.7 * lens.factor * lens.rad_per_px
        first_row = int(lights.lamps["halo_row"][lamp])
        self._pieces = BeamPieces(lights.halo, first_row, 2.0 * self._least_rad)
        rays = lens.rays.astype(np.float32)
        self._rays = np.ascontiguousarray(rays.T)
        self._few_shape = (-(-lens.shape[0] // 2), -(-lens.shape[1] // 2))
        few = cv2.resize(rays.reshape(*lens.shape, 3), self._few_shape[::-1]).reshape(-1, 3)
        few /= np.linalg.norm(few, axis=1, keepdims=True)
        self._few = np.ascontiguousarray(few.T)
        self._solid_angle = lens.solid_angle_sr.astype(np.float32)
        self._pixel_sr = lens.rad_per_px**2
        self._channel = lights.column("electrons_per_j")[lamp] * lens.aperture_m2

    def add(self, image: NDArray[np.float32], beam: Beam, exposure_s: float) -> None:
        """Add electrons per image pixel of the beam to the coarse grid (h, w, 3)."""
        pieces = self._pieces.light(beam)
        floor = _LEAST_E / (float(self._channel.max()) * exposure_s * self._pixel_sr)
        radiance = self._blobs(beam, pieces, floor)
        if radiance is None:
            radiance = np.zeros(self._shape, dtype=np.float32)
        self._add_ribbon(radiance, beam, pieces.ribbon * beam.light_w_m2, floor)
        _add_coloured(image, radiance, self._solid_angle, (self._channel * exposure_s).astype(np.float32))

    def _blobs(self, beam: Beam, pieces: PieceLight, floor: float) -> NDArray[np.float32] | None:
        """(h, w) radiance of the Gaussians and halos about the pieces."""
        tables = self._pieces.per_sr(pieces, self._angle2, pieces.blob)
        tables *= beam.light_w_m2[:, None]
        index = np.flatnonzero(tables[:, 0] > floor)
        if len(index) == 0:
            return None
        few = np.zeros(self._few.shape[1], dtype=np.float32)
        rays = beam.rays_camera[index].astype(np.float32)
        _add_tables(few, self._few, rays, tables[index].astype(np.float32), self._scale)
        enlarged = cv2.resize(few.reshape(self._few_shape), self._shape[::-1], interpolation=cv2.INTER_LINEAR)
        return np.asarray(enlarged, dtype=np.float32)

    def _add_ribbon(self, radiance: NDArray[np.float32], beam: Beam, light: Array, floor: float) -> None:
        """Add the sharp part to radiance (h, w): light per angle along, spread as a Gaussian across."""
        edge = beam.edge_rad
        span = float(edge[-1])
        grid = np.linspace(0.0, span, _RIBBON)
        # Linear in the running sum, so that the light of each piece is kept.
        running = np.interp(grid, edge, np.concatenate([[0.0], np.cumsum(light)]))
        along = np.append(np.diff(running) * ((_RIBBON - 1) / span), 0.0)
        width = np.maximum(np.interp(grid, 0.5 * (edge[1:] + edge[:-1]), beam.width_rad), self._least_rad)
        along /= math.sqrt(2.0 * math.pi) * width
        if float(along.max()) < floor:
            return
        reach = float((width * np.sqrt(2.0 * np.log(np.maximum(along / (_NOTHING * floor), 1.0)))).max())
        axes = np.array([beam.ray_camera, beam.along_camera, cross(beam.ray_camera, beam.along_camera)])
        _add_along(
            radiance.ravel(),
            self._rays,
            axes.astype(np.float32),
            along.astype(np.float32),
            (-0.5 / width**2).astype(np.float32),
            np.float32((_RIBBON - 1) / span),
            np.float32(reach),
        )


@compiled
def _add_tables(
    radiance: NDArray[np.float32],
    grid: NDArray[np.float32],
    rays: NDArray[np.float32],
    tables: NDArray[np.float32],
    scale: np.float32,
) -> None:
    """Add to radiance (n,) at a grid (3, n) the tables (m, entries) about rays (m, 3), linear between entries."""
    count, last = grid.shape[1], tables.shape[1] - 2
    place = np.empty(count, dtype=np.float32)
    for piece in range(len(rays)):
        x, y, z = rays[piece]
        table = tables[piece]
        for i in range(count):
            dx, dy, dz = grid[0, i] - x, grid[1, i] - y, grid[2, i] - z
            place[i] = np.sqrt(np.sqrt(dx * dx + dy * dy + dz * dz)) * scale
        for i in range(count):
            entry = min(np.int32(place[i]), last)
            radiance[i] += table[entry] + (place[i] - np.float32(entry)) * (table[entry + 1] - table[entry])


@compiled
def _add_along(
    radiance: NDArray[np.float32],
    grid: NDArray[np.float32],
    axes: NDArray[np.float32],
    along: NDArray[np.float32],
    across: NDArray[np.float32],
    per_rad: np.float32,
    widest: np.float32,
) -> None:
    """Add a ribbon to radiance (n,) at a grid (3, n).

    It starts at the first of `axes` (3, 3) and runs towards the second: along (k,) e^{across (k,) d²}, d the sine of
    the angle from the great circle.
    """
    count, last = grid.shape[1], len(along) - 1
    away = np.empty(count, dtype=np.float32)
    for i in range(count):
        away[i] = grid[0, i] * axes[2, 0] + grid[1, i] * axes[2, 1] + grid[2, i] * axes[2, 2]
    for i in range(count):
        d = away[i]
        if d > widest or d < -widest:
            continue
        start = grid[0, i] * axes[0, 0] + grid[1, i] * axes[0, 1] + grid[2, i] * axes[0, 2]
        further = grid[0, i] * axes[1, 0] + grid[1, i] * axes[1, 1] + grid[2, i] * axes[1, 2]
        place = np.arctan2(further, start) * per_rad + np.float32(0.5)
        if place >= 0.0:
            entry = min(np.int32(place), last)
            radiance[i] += along[entry] * np.exp(across[entry] * d * d)


@compiled
def _add_coloured(
    image: NDArray[np.float32],
    radiance: NDArray[np.float32],
    solid_angle: NDArray[np.float32],
    colour: NDArray[np.float32],
) -> None:
    """Add radiance (h, w) times solid angle (h, w) and colour (3,) to an image (h, w, 3)."""
    red, green, blue = colour
    for j in range(image.shape[0]):
        for i in range(image.shape[1]):
            value = radiance[j, i] * solid_angle[j, i]
            image[j, i, 0] += value * red
            image[j, i, 1] += value * green
            image[j, i, 2] += value * blue
