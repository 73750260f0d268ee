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
from auvdock.optics.tag_pattern import CELLS, TagPattern
from auvdock.optics.tag_scene import TagScene

__all__ = ["TagImage"]

_PAD_PX = 5
_STRIP_PX = 32768
"""Pixels that are drawn at a time: few enough to stay in a processor's cache from one step to the next."""
_SPARE_TEXELS = 4.0
_TEXEL_PX = 0.8
"""Distance of the texture's texels in pixels."""
_KNOTS = 7
_COVER = 0.25
"""Reflectance of what covers a hidden tag: grey silt."""


class TagImage:
    """One tag on one camera's sensor."""

    def __init__(self, scene: TagScene) -> None:
        """Keep the scene; the map of the lens is made at the first frame."""
        self.scene = scene
        self._pattern = TagPattern(scene.tag)
        camera, cfg = scene.lit.camera, scene.lit.cfg
        self._size = (camera.width_px, camera.height_px)
        # A pixel averages over its own width: variance 1/12.
        self._sigma_px = math.sqrt(cfg.lens_sigma_px**2 + 1.0 / 12.0)
        self._tangents: NDArray[np.float32] | None = None
        steps = np.linspace(0.0, CELLS, 9)
        low, high = np.zeros(9), np.full(9, float(CELLS))
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
        x0, y0, x1, y1 = region
        back = np.asarray(np.linalg.inv(plane), dtype=np.float64)
        sigma_u, sigma_v, step = self._footprint(plane, back)
        first, count = self._pattern.texels(step, sigma_u, sigma_v)
        to_texel = np.array([[1.0 / step, 0.0, -first / step], [0.0, 1.0 / step, -first / step], [0.0, 0.0, 1.0]])
        window = self._window(region, to_texel @ back, count)
        reflected, covered = self._pattern.texture(step, sigma_u, sigma_v, window)
        if hidden:
            reflected = np.full_like(reflected, _COVER) if covered is None else covered * np.float32(_COVER)
        unit, veil = self._shading(region, back, T_world_camera, exposure_s)
        under = self._less(surfaces, region) if surfaces is not None else None
        to_window = np.array([[1.0, 0.0, -window[0]], [0.0, 1.0, -window[1]], [0.0, 0.0, 1.0]]) @ to_texel @ back
        tangents, target = self._lens_map()[:, y0:y1, x0:x1], image[y0:y1, x0:x1]
        rows = max(_STRIP_PX // (x1 - x0), 1)
        for top in range(0, y1 - y0, rows):
            strip = slice(top, min(top + rows, y1 - y0))
            place = _mapped(tangents[0, strip], tangents[1, strip], to_window)
            cv2.accumulateProduct(unit[strip], _read(reflected, place), target[strip])
            beside = None if veil is None else veil[strip]
            if under is not None:
                beside = under[strip] if beside is None else beside + under[strip]
            if beside is None:
                continue
            if covered is None:
                cv2.add(target[strip], beside, target[strip])
            else:
                cv2.accumulateProduct(beside, _read(covered, place), target[strip])

    def _window(self, region: tuple[int, int, int, int], to_texel: Array, count: int) -> tuple[int, int, int, int]:
        """Texels x0, y0, x1, y1 that a region shows: from a nearby tag's they are few."""
        x0, y0, x1, y1 = region
        t = self._lens_map()[:, y0:y1, x0:x1]
        # Lens and plane keep inside and outside apart, so the region's rim shows the outermost texels.
        rim = np.concatenate([t[:, 0], t[:, -1], t[:, :, 0], t[:, :, -1]], axis=1).astype(np.float64).T
        place = np.column_stack([rim, np.ones(len(rim))]) @ to_texel.T
        if not float(place[:, 2].min()) > 0.0:
            # It reaches to the plane's horizon.
            return 0, 0, count, count
        place = place[:, :2] / place[:, 2:]
        low = np.clip(place.min(axis=0) - _SPARE_TEXELS, 0.0, count - 2.0)
        high = np.clip(place.max(axis=0) + _SPARE_TEXELS + 1.0, low + 2.0, float(count))
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

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

    def _footprint(self, plane: Array, back: Array) -> tuple[float, float, float]:
        """Blur along u and v in cells, and the distance of texels, from the lens' scale in the middle of the tag."""
        middle = plane @ np.array([0.5 * CELLS, 0.5 * CELLS, 1.0])
        camera = self.scene.lit.camera
        limit = self.scene.lit.lens.max_tangent
        tangent = middle[:2] / middle[2]
        tangent /= max(float(np.hypot(*tangent)) / limit, 1.0)
        pixel = camera.project(np.array([[*tangent, 1.0]]))[0]
        around = camera.normalise(pixel + np.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]]))
        cells = np.column_stack([around, np.ones(4)]) @ back.T
        cells = cells[:, :2] / cells[:, 2:]
        gradient = np.column_stack([cells[0] - cells[1], cells[2] - cells[3]])
        per_px = np.hypot(gradient[:, 0], gradient[:, 1])
        sigma = self._sigma_px * per_px
        step = _TEXEL_PX * float(per_px.min())
        # Reading between texels is itself a blur: a triangle of variance step² / 6.
        sigma = np.sqrt(np.maximum(sigma**2 - step**2 / 6.0, 0.0))
        return float(sigma[0]), float(sigma[1]), step

    def _shading(
        self, region: tuple[int, int, int, int], back: Array, T_world_camera: Array, exposure_s: float
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Electrons per unit of reflectance and of the veil (h, w, 3), computed at a few points and enlarged.

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
        np.clip(cells[:, :2], -CELLS, 2.0 * CELLS, out=cells[:, :2])
        unit, veil = scene.unit_e_s(cells @ scene.cells_to_world.T, T_world_camera)
        lens = scene.lit.lens
        pixels = np.column_stack([np.tile(x, _KNOTS), np.repeat(y, _KNOTS)])
        solid = lens.solid_angle_at(pixels)[:, None] * exposure_s
        return _enlarge(unit * solid, region), _enlarge(veil * solid, region) if veil.any() else None

    def _less(self, coarse: NDArray[np.float32], region: tuple[int, int, int, int]) -> NDArray[np.float32]:
        """The negative of the region of a coarser image (h, w, 3) as `cv2.resize` would enlarge it."""
        x0, y0, x1, y1 = region
        lens = self.scene.lit.lens
        step = lens.shape[1] * lens.factor // coarse.shape[1]
        left, top = max(x0 // step - 1, 0), max(y0 // step - 1, 0)
        right, bottom = -(-x1 // step) + 1, -(-y1 // step) + 1
        part = np.negative(coarse[top:bottom, left:right])
        size = (part.shape[1] * step, part.shape[0] * step)
        whole = cv2.resize(part, size, interpolation=cv2.INTER_LINEAR)
        whole = np.asarray(whole, dtype=np.float32)
        return whole[y0 - top * step : y1 - top * step, x0 - left * step : x1 - left * step]


_Place = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Where each pixel (h, w) falls in a texture: columns and rows."""


def _mapped(x: NDArray[np.float32], y: NDArray[np.float32], homography: Array) -> _Place:
    """Points (h, w) under a homography (3, 3)."""
    rows: list[list[float]] = homography.tolist()
    across, down, scale = (cv2.addWeighted(x, by_x, y, by_y, constant) for by_x, by_y, constant in rows)
    across, down = cv2.divide(across, scale, across), cv2.divide(down, scale, down)
    return np.asarray(across, dtype=np.float32), np.asarray(down, dtype=np.float32)


def _read(texture: NDArray[np.float32], place: _Place) -> NDArray[np.float32]:
    """(h, w, 3) a texture (rows, columns) between its texels, 0 off it, alike for red, green and blue."""
    # One channel at a time: for two OpenCV rounds the place to a 32nd of a texel, and takes as long.
    drawn = cv2.remap(texture, *place, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0.0)
    return np.asarray(cv2.cvtColor(drawn, cv2.COLOR_GRAY2RGB), dtype=np.float32)


def _enlarge(values: Array, region: tuple[int, int, int, int]) -> NDArray[np.float32]:
    """Bilinear (h, w, 3) over a region, from the centres (k², 3) of its k × k parts."""
    x0, y0, x1, y1 = region
    knots = values.reshape(_KNOTS, _KNOTS, 3).astype(np.float32)
    whole = cv2.resize(knots, (x1 - x0, y1 - y0), interpolation=cv2.INTER_LINEAR)
    return np.asarray(whole, dtype=np.float32)
