"""Draws the tag into a frame at full resolution, over the surfaces that are drawn coarser.

Every pixel near the tag is taken back through the lens to the tag's plane, where the pattern is known in closed form,
blurred by pixel and lens. Light, attenuation and veil change slowly over the tag: they are computed at a few points.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.transforms import invert
from auvdock.numeric.constants import TAG_CELLS
from auvdock.optics.tag_pattern import reflectances
from auvdock.optics.tag_pixels import TagLight, add_tag
from auvdock.optics.tag_scene import TagScene

__all__ = ["TagImage"]

_PAD_PX = 5
_KNOTS = 7
_NOTHING: NDArray[np.float32] = np.zeros((0, 1, 3), dtype=np.float32)
_COVER = 0.25
"""Reflectance of what covers a hidden tag: grey silt."""


class TagImage:
    """One tag on one camera's sensor."""

    def __init__(self, scene: TagScene) -> None:
        """Keep the scene; the map of the lens is made at the first frame."""
        self.scene = scene
        self._cells = reflectances(scene.tag)
        self._covered = np.where(self._cells > 0.0, np.float32(_COVER), np.float32(0.0))
        camera, cfg = scene.lit.camera, scene.lit.setup.imaging
        self._size = (camera.width_px, camera.height_px)
        # A pixel averages over its own width: variance 1/12.
        self._sigma_px = math.sqrt(cfg.lens_sigma_px**2 + 1.0 / 12.0)
        self._tangents: NDArray[np.float32] | None = None
        steps = np.linspace(0.0, TAG_CELLS, 9)
        low, high = np.zeros(9), np.full(9, float(TAG_CELLS))
        border = [(steps, low), (steps, high), (low, steps), (high, steps)]
        self._border = np.concatenate([np.column_stack([u, v, np.ones(9)]) for u, v in border])

    def add(
        self,
        image: NDArray[np.float32],
        T_world_camera: Array,
        exposure_s: float,
        surfaces: NDArray[np.float32] | None,
        *,
        hidden: bool = False,
    ) -> None:
        """Put the tag in place of what was drawn there.

        Args:
            image: (H, W, 3) electrons so far, changed in place.
            T_world_camera: (4, 4) pose of the camera.
            exposure_s: exposure time.
            surfaces: (h, w, 3) electrons per image pixel that surfaces and daylight's veil gave `image`, at a coarser
                resolution; None for none.
            hidden: something grey lies on the tag and covers it.
        """
        scene = self.scene
        if not scene.faces(T_world_camera):
            return
        to_camera = invert(T_world_camera)
        # (u, v, 1) in cells to points of the camera frame, up to scale tangents of the ray.
        plane = to_camera[:3, :3] @ scene.cells_to_world
        plane[:, 2] += to_camera[:3, 3]
        region = self._region(self._border @ plane.T)
        if region is None:
            return
        back = np.asarray(np.linalg.inv(plane), dtype=np.float64)
        unit, veil = self._shading(region, back, T_world_camera, exposure_s)
        width = region[2] - region[0]
        add_tag(
            image,
            region,
            self._lens_map(),
            back.astype(np.float32),
            self._covered if hidden else self._cells,
            self._blur_cells(plane, back),
            TagLight(
                _widened(unit, width),
                _widened(veil, width) if veil is not None else _NOTHING,
                *(self._below(surfaces, region) if surfaces is not None else (_NOTHING, 1.0, 0.0, 0)),
            ),
        )

    def _lens_map(self) -> NDArray[np.float32]:
        """(2, H, W) tangents of the ray through each pixel, to the right and down."""
        if self._tangents is None:
            width, height = self._size
            grid = np.stack(np.meshgrid(np.arange(float(width)), np.arange(float(height))), axis=2)
            tangents = self.scene.lit.camera.normalise(grid.reshape(-1, 2))
            self._tangents = np.ascontiguousarray(tangents.T, dtype=np.float32).reshape(2, height, width)
        return self._tangents

    def _region(self, border_camera: Array) -> tuple[int, int, int, int] | None:
        """Columns x0 to x1 and rows y0 to y1 that may show the tag, None if none does."""
        tangents = border_camera[:, :2] / border_camera[:, 2:]
        # Beyond the sensor's corners the distortion polynomial folds: stay at a circle just outside.
        reach = np.maximum(np.hypot(tangents[:, 0], tangents[:, 1]) / self.scene.lit.lens.max_tangent, 1.0)
        tangents /= reach[:, None]
        pixels = self.scene.lit.camera.project(np.column_stack([tangents, np.ones(len(tangents))]))
        low = np.floor(pixels.min(axis=0)) - _PAD_PX
        high = np.ceil(pixels.max(axis=0)) + _PAD_PX + 1
        x0, y0 = max(int(low[0]), 0), max(int(low[1]), 0)
        x1, y1 = min(int(high[0]), self._size[0]), min(int(high[1]), self._size[1])
        return (x0, y0, x1, y1) if x0 < x1 and y0 < y1 else None

    def _blur_cells(self, plane: Array, back: Array) -> tuple[float, float]:
        """Standard deviation of the blur along u and v in cells, from the lens' scale in the middle of the tag."""
        middle = plane @ np.array([0.5 * TAG_CELLS, 0.5 * TAG_CELLS, 1.0])
        camera = self.scene.lit.camera
        limit = self.scene.lit.lens.max_tangent
        tangent = middle[:2] / middle[2]
        tangent /= max(float(np.hypot(*tangent)) / limit, 1.0)
        pixel = camera.project(np.array([[*tangent, 1.0]]))[0]
        around = camera.normalise(pixel + np.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]]))
        cells = np.column_stack([around, np.ones(4)]) @ back.T
        cells = cells[:, :2] / cells[:, 2:]
        gradient = np.column_stack([cells[0] - cells[1], cells[2] - cells[3]])
        sigma = self._sigma_px * np.hypot(gradient[:, 0], gradient[:, 1])
        return float(sigma[0]), float(sigma[1])

    def _shading(
        self, region: tuple[int, int, int, int], back: Array, T_world_camera: Array, exposure_s: float
    ) -> tuple[Array, Array | None]:
        """Electrons per unit of reflectance and of the veil (k², 3), in the middle of k × k parts of a region.

        The veil is None where there is none.
        """
        x0, y0, x1, y1 = region
        scene = self.scene
        share = (np.arange(_KNOTS) + 0.5) / _KNOTS
        x, y = x0 + share * (x1 - x0) - 0.5, y0 + share * (y1 - y0) - 0.5
        columns = np.clip(np.rint(x).astype(int), x0, x1 - 1)
        rows = np.clip(np.rint(y).astype(int), y0, y1 - 1)
        tangents = self._lens_map()[:, rows[:, None], columns].reshape(2, -1).T.astype(np.float64)
        cells = np.column_stack([tangents, np.ones(len(tangents))]) @ back.T
        cells /= cells[:, 2:]
        # Far outside the tag's outline the plane may run away to the horizon.
        np.clip(cells[:, :2], -TAG_CELLS, 2.0 * TAG_CELLS, out=cells[:, :2])
        unit, veil = scene.unit_e_s(cells @ scene.cells_to_world.T, T_world_camera)
        lens = scene.lit.lens
        pixels = np.column_stack([np.tile(x, _KNOTS), np.repeat(y, _KNOTS)])
        solid = lens.solid_angle_at(pixels)[:, None] * exposure_s
        return unit * solid, veil * solid if veil.any() else None

    def _below(
        self, coarse: NDArray[np.float32], region: tuple[int, int, int, int]
    ) -> tuple[NDArray[np.float32], float, float, int]:
        """Part of a coarser image (h, w, 3) that holds a region, its columns enlarged as `cv2.resize` would.

        With it come its rows per row of the image, its row at the region's first, and the region's first column in it.
        """
        x0, y0, x1, y1 = region
        lens = self.scene.lit.lens
        step = lens.shape[1] * lens.factor // coarse.shape[1]
        left, top = max(x0 // step - 1, 0), max(y0 // step - 1, 0)
        part = coarse[top : -(-y1 // step) + 1, left : -(-x1 // step) + 1]
        wide = cv2.resize(part, (part.shape[1] * step, len(part)), interpolation=cv2.INTER_LINEAR)
        return np.asarray(wide, dtype=np.float32), 1.0 / step, (y0 + 0.5) / step - 0.5 - top, x0 - left * step


def _widened(knots: Array, width: int) -> NDArray[np.float32]:
    """(k, width, 3) what is known at the centres (k², 3) of k × k parts of a region, between its columns of parts."""
    square = knots.reshape(_KNOTS, _KNOTS, 3).astype(np.float32)
    return np.asarray(cv2.resize(square, (width, _KNOTS), interpolation=cv2.INTER_LINEAR), dtype=np.float32)
