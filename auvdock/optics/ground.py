"""What platform and floor add to an image seen from above, without drawing it: for exposure and glare in `beacons`."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.landing_station import LandingStationCfg
from auvdock.numeric.constants import TAG_CELLS, TAG_SQUARE_CELLS
from auvdock.optics.tag_pattern import BLACK_SHARE, tag_cells
from auvdock.optics.tag_scene import TagScene

__all__ = ["Ground"]

_PLATFORM, _FLOOR = 0.56, 0.42
"""Mean reflectances of the scene's materials "station" and "floor"."""
_COLUMNS, _ROWS = 16, 12


class Ground:
    """Brightness of platform, tag and floor at a grid of pixels."""

    def __init__(self, scene: TagScene, station: LandingStationCfg) -> None:
        """Keep the grid's rays and the platform's outline."""
        self._scene, self._station = scene, station
        camera = scene.lit.camera
        x = (np.arange(_COLUMNS) + 0.5) * camera.width_px / _COLUMNS - 0.5
        y = (np.arange(_ROWS) + 0.5) * camera.height_px / _ROWS - 0.5
        pixels = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
        self._pixels = pixels
        self._rays = camera.rays(pixels)
        self._solid = scene.lit.lens.solid_angle_at(pixels)[:, None]
        self._white = tag_cells(scene.tag.tag_id)

    def electrons_per_s(self, T_world_camera: Array, *, tag_hidden: bool = False) -> Array:
        """(n, 3) electrons per second and pixel of what a grid of rays meets, red, green, blue."""
        lit = self._scene.lit
        station = self._station
        to_station = lit.setup.T_world_station[:3, :3].T
        rays = self._rays @ T_world_camera[:3, :3].T
        origin = T_world_camera[:3, 3]
        down = np.minimum(rays @ lit.setup.T_world_station[:3, 2], -1e-3)
        height = self._scene.height_m(T_world_camera)
        reach = height / -down
        points = origin + rays * reach[:, None]
        local = (points - lit.setup.T_world_station[:3, 3]) @ to_station.T
        beside = (np.abs(local[:, 0]) > 0.5 * station.length_m) | (np.abs(local[:, 1]) > 0.5 * station.width_m)
        reach = np.where(beside, (height + station.height_m) / -down, reach)
        points = origin + rays * np.minimum(reach, 80.0)[:, None]
        reflectance = np.where(beside, _FLOOR, _PLATFORM)
        if not tag_hidden:
            self._put_tag(local, reflectance)
        unit, veil = self._scene.unit_e_s(points, T_world_camera)
        light = unit * reflectance[:, None] + veil
        if lit.lamp is not None:
            middle = float(np.median(reach))
            light += lit.lamp.backscatter_near(self._pixels, middle) @ lit.electrons_per_j.T
        return light * self._solid

    def _put_tag(self, local: Array, reflectance: Array) -> None:
        """Overwrite the reflectance where points (n, 3) of the station frame lie on the tag."""
        tag = self._scene.tag
        cell = tag.size_m / TAG_SQUARE_CELLS
        u = np.floor(0.5 * TAG_CELLS - (local[:, 1] - tag.position_m[1]) / cell)
        v = np.floor(0.5 * TAG_CELLS - (local[:, 0] - tag.position_m[0]) / cell)
        on = (u >= 0) & (u < TAG_CELLS) & (v >= 0) & (v < TAG_CELLS)
        white = self._white[v[on].astype(np.int64), u[on].astype(np.int64)]
        reflectance[on] = np.where(white, 1.0, BLACK_SHARE) * tag.reflectance
