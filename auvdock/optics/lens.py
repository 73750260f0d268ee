"""What the camera's geometry means for light: aperture, solid angle per pixel, angles around a pixel."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.camera import Camera
from auvdock.numeric.records import Records
from auvdock.optics.arrival import Projection, locate
from auvdock.optics.settings import ImagingCfg

__all__ = ["Lens"]


class Lens:
    """A camera's geometry, on a coarse grid of pixels.

    The maps are made when first asked for: where nothing is rendered nobody does, and they take 40 ms.

    Attributes:
        factor: image pixels per coarse pixel (4 at 640 × 360, 6 at 800 × 600).
        shape: (rows, columns) of the coarse grid.
        aperture_m2: area of the entrance pupil times the lens' transmission.
        rad_per_px: angle of a pixel in the middle of the image.
        projection: the same for compiled code, one row.
        max_tangent: tangent of the angle between the optical axis and the farthest corner of the image.
    """

    def __init__(self, camera: Camera, cfg: ImagingCfg) -> None:
        """Precompute what every frame needs."""
        self.camera = camera
        self.factor = _coarse_factor(camera.width_px)
        columns, rows = -(-camera.width_px // self.factor), -(-camera.height_px // self.factor)
        self.shape = (rows, columns)
        self._middle = np.array([(camera.width_px - 1) / 2, (camera.height_px - 1) / 2])
        focal_px = float(camera.matrix[0, 0])
        self.rad_per_px = 1.0 / focal_px
        focal_m = focal_px * cfg.sensor_width_m / camera.width_px
        self.aperture_m2 = math.pi / 4.0 * (focal_m / cfg.f_number) ** 2 * cfg.lens_transmission
        last_x, last_y = camera.width_px - 0.5, camera.height_px - 0.5
        corner = camera.normalise(np.array([[-0.5, -0.5], [last_x, last_y], [last_x, -0.5], [-0.5, last_y]]))
        self._max_tangent2 = float(np.max(np.sum(corner**2, axis=1)))
        self.max_tangent = math.sqrt(self._max_tangent2)
        self.projection: Records[Projection] = self._projection_at(0.0)

    @cached_property
    def rays(self) -> Array:
        """(rows × columns, 3) unit rays through the coarse pixels' centres."""
        return self.camera.rays(self._grid())

    @cached_property
    def metric(self) -> Array:
        """(rows, columns, 3) tensor g11, g12, g22: an offset (x, y) px subtends √(g11 x² + 2 g12 x y + g22 y²)."""
        camera, grid = self.camera, self._grid()
        right, down = np.array([0.5, 0.0]), np.array([0.0, 0.5])
        along_x = camera.rays(grid + right) - camera.rays(grid - right)
        along_y = camera.rays(grid + down) - camera.rays(grid - down)
        pairs = ((along_x, along_x), (along_x, along_y), (along_y, along_y))
        parts = [np.einsum("ij,ij->i", one, other) for one, other in pairs]
        metric: Array = np.column_stack(parts).reshape(*self.shape, 3)
        return metric

    @cached_property
    def solid_angle_sr(self) -> Array:
        """(rows, columns) solid angle of one image pixel, √det g."""
        g11, g12, g22 = np.moveaxis(self.metric, 2, 0)
        determinant: Array = g11 * g22 - g12 * g12
        return np.sqrt(determinant)

    def _grid(self) -> Array:
        """(rows × columns, 2) the coarse pixels' centres."""
        rows, columns = self.shape
        x, y = ((np.arange(count) + 0.5) * self.factor - 0.5 for count in (columns, rows))
        grid: Array = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2).astype(np.float64)
        return grid

    def metric_at(self, pixels: Array) -> Array:
        """(n, 3) metric tensors at pixels (n, 2); outside the image those of the border."""
        columns = np.clip((pixels[:, 0] / self.factor).astype(np.int64), 0, self.shape[1] - 1)
        rows = np.clip((pixels[:, 1] / self.factor).astype(np.int64), 0, self.shape[0] - 1)
        return self.metric[rows, columns]

    def solid_angle_at(self, pixels: Array) -> Array:
        """(n,) solid angle of the pixels (n, 2); outside the image that of the border."""
        metric = self.metric_at(pixels)
        return np.sqrt(metric[:, 0] * metric[:, 2] - metric[:, 1] ** 2)

    def locate(self, rays: Array, margin_px: float = 0.0) -> tuple[Array, BoolArray]:
        """Pixels (n, 2) of rays (n, 3) in the camera frame and whether they lie within `margin_px` of the image.

        Rays beyond the image's corners (by more than the margin) have no meaningful pixel: the distortion polynomial
        folds back there.
        """
        return locate(rays, self.projection if margin_px == 0.0 else self._projection_at(margin_px))

    def _projection_at(self, margin_px: float) -> Records[Projection]:
        """`projection` with a margin about the image."""
        matrix, distortion = self.camera.matrix, self.camera.distortion
        limit = self._max_tangent2 * (1.0 + margin_px * self.rad_per_px) ** 2
        brown = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion])
        tangential = bool(distortion[2] != 0.0 or distortion[3] != 0.0)
        return Projection(brown, tangential, limit, self._middle, self._middle + (0.5 + margin_px)).packed()


def _coarse_factor(width_px: int) -> int:
    """Image pixels per coarse pixel: some 160 columns, and a multiple of 2 or 3 so that surfaces fit in between."""
    factor = max(1, round(width_px / 160))
    return factor if factor % 2 == 0 or factor % 3 == 0 else factor + 1 if factor > 1 else 1
