"""Station and floor in the water: the revised image formation model (Akkaynak & Treibitz 2018).

Per band, I = J e^{-β_D z} + B∞ (1 - e^{-β_B z}) with z the distance along the ray. The direct signal carries the image
and loses all that is scattered: β_D = c = a + b. The veil is lit by daylight from all sides, to which forward
scattering is no loss: β_B = a + b_b (Gordon 1973). J = ρ E / π, with E the daylight at depth, shaded from above, plus
the light of lamps: see `optics.illumination` for the station's and `optics.lamp` for the vehicle's own.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, BoolArray
from auvdock.numeric.compiled import compiled
from auvdock.optics.gl import StaticRenderer
from auvdock.optics.illumination import LAMP_M2, Illumination
from auvdock.optics.lamp_light import add_spilled
from auvdock.optics.scene import LitScene
from auvdock.sim.mj import MjModel, mujoco

__all__ = ["Surfaces"]

_GLARE_M2 = 0.15**2
"""Closer to a lamp than this, its own core and halo outshine what it lights."""
_GREATEST_RADIANCE = 1.0 / math.pi
_BOUND_STEPS = 40


class Surfaces:
    """Draws the static geoms of a model at a half or a third of the resolution, through water and lens."""

    def __init__(self, lit: LitScene, model: MjModel, hidden_geoms: tuple[str, ...] = ()) -> None:
        """Precompute lens maps and what lamps do to each geom; no OpenGL yet.

        Args:
            lit: lamps, water and lens.
            model: the MuJoCo model whose static geoms are drawn.
            hidden_geoms: names of geoms that are left out, because something else draws them.
        """
        self._lit = lit
        camera, lens = lit.camera, lit.lens
        step = next(step for step in (3, 2, 1) if lens.factor % step == 0)
        self.shape = (lens.shape[0] * lens.factor // step, lens.shape[1] * lens.factor // step)
        rows, columns = self.shape
        x, y = np.meshgrid((np.arange(columns) + 0.5) * step - 0.5, (np.arange(rows) + 0.5) * step - 0.5)
        tangents = camera.normalise(np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)).reshape(
            rows, columns, 2
        )
        half_x, half_y = (1.02 * float(np.abs(tangents[:, :, k]).max()) for k in range(2))
        width = round(columns * half_x / float(np.abs(tangents[rows // 2, :, 0]).max()))
        height = round(rows * half_y / float(np.abs(tangents[:, columns // 2, 1]).max()))
        self.renderer = StaticRenderer(model, width, height, half_x, half_y, hidden_geoms)
        map_x = (tangents[:, :, 0] / half_x + 1.0) * 0.5 * width - 0.5
        # The renderer's rows run from the bottom up.
        map_y = (1.0 - tangents[:, :, 1] / half_y) * 0.5 * height - 0.5
        map_x, map_y = map_x.astype(np.float32), map_y.astype(np.float32)
        # In fixed point OpenCV reads the maps a third faster.
        self._maps = cv2.convertMaps(map_x, map_y, cv2.CV_16SC2)
        self._nearest = cv2.convertMaps(map_x, map_y, cv2.CV_16SC2, nninterpolation=True)
        self._stretch = np.sqrt(1.0 + np.sum(tangents**2, axis=2)).astype(np.float32)
        self._rays = np.ascontiguousarray(lens.rays.T, dtype=np.float32)

        water = lit.water
        self._beta_direct = water.attenuation
        self._beta_veil = water.absorption + water.backscattering
        solid = cv2.resize(lens.solid_angle_sr.astype(np.float32), (columns, rows), interpolation=cv2.INTER_LINEAR)
        self._solid_angle = np.repeat(solid[:, :, None], 3, axis=2)

        self.light = Illumination(lit)
        self.geoms = _Geoms(model)
        nearest = np.array([self.geoms.distance_m(lamp) for lamp in self.light.lamps_m]).T
        loss = np.exp(-self.light.absorption_per_m * nearest) / np.maximum(nearest**2, _GLARE_M2)
        self._lamp_irradiance = loss @ self.light.spill_w_sr
        # A vehicle that looks for a rotating beacon is far from the lamps for long, and the floor below it is dark.
        self._planes = self.geoms.planes if lit.rotating is not None else np.zeros(0, dtype=np.int64)
        self._lamp_to_plane = nearest[self._planes]

    def close(self) -> None:
        """Free OpenGL's context."""
        self.renderer.close()

    def visible(self, position_world_m: Array, sensitivity_s: float) -> bool:
        """Whether any surface can stand out of the noise, in the most favourable case, from a position (3,)."""
        daylight = self._lit.daylight_w_m2(-float(position_world_m[2]))
        distance = self.geoms.distance_m(position_world_m)
        through = np.exp(-distance[:, None] * self._beta_direct)
        irradiance = self._lamp_irradiance + daylight
        if self._lit.lamp is not None:
            irradiance = irradiance + self._lit.lamp.brightest(distance)
        per_pixel = self._lit.electrons_per_j.T * (sensitivity_s * self._lit.lens.rad_per_px**2)
        veil = float(self._lit.veil_e_s(-float(position_world_m[2])).max()) * sensitivity_s
        noise = math.sqrt(self._lit.setup.imaging.read_noise_e**2 + veil)
        brightest: Array = ((irradiance * through * _GREATEST_RADIANCE) @ per_pixel).max(axis=1)
        shown: BoolArray = np.greater(brightest, noise)
        doubtful = shown[self._planes].any()
        if np.count_nonzero(shown) > np.count_nonzero(shown[self._planes]) or not doubtful:
            return bool(shown.any())
        radiance = self.plane_radiance(position_world_m, distance[self._planes], daylight, through[self._planes])
        return float((radiance @ per_pixel).max()) > noise

    def plane_radiance(self, position_world_m: Array, height: Array, daylight: Array, through: Array) -> Array:
        """(n, 3) upper bound of each plane's radiance through water, tighter than that of its nearest point.

        A point at d from a lamp lies D - d from the camera or farther, D being the camera's distance from that lamp, so
        that its light has come a way of D at least: max over d of E(d) e^{-β max(D - d, h)}, in steps of d in which
        each factor is taken at the end where it is greater; h is the camera's distance from the plane.
        """
        away = np.linalg.norm(self.light.lamps_m - position_world_m, axis=1)
        bound = _plane_bound(
            away, self._lamp_to_plane, height, self.light.absorption_per_m, self._beta_direct, self.light.spill_w_sr
        )
        irradiance = bound + daylight * through
        if self._lit.lamp is not None:
            irradiance = irradiance + self._lit.lamp.brightest(height) * through
        return irradiance * _GREATEST_RADIANCE

    def electrons(self, T_world_camera: Array, exposure_s: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Electrons (h, w, 3) per image pixel, red, green, blue, at this resolution, and distances as `radiance` gives.

        Raises:
            GraphicsError: no OpenGL context can be had.
        """
        radiance, distance = self.radiance(T_world_camera)
        image = cv2.transform(radiance, (self._lit.electrons_per_j * exposure_s).astype(np.float32))
        return np.asarray(cv2.multiply(image, self._solid_angle, image), dtype=np.float32), distance

    def radiance(self, T_world_camera: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Radiance per band (h, w, 3) in W/(m² sr), blue, green, red, at this resolution, and what distance it is from.

        The distance (rows, columns) is along the rays of the lens' coarse grid; `inf` for nothing.

        Raises:
            GraphicsError: no OpenGL context can be had.
        """
        colour, depth = self.renderer.render(T_world_camera)
        # OpenCV reads four channels of 8 bits a third faster than three.
        colour = cv2.cvtColor(colour, cv2.COLOR_RGB2BGRA)
        colour = cv2.remap(colour, *self._maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        depth = cv2.remap(depth, *self._nearest, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        distance = np.asarray(cv2.multiply(depth, self._stretch), dtype=np.float32)
        depth_m = -float(T_world_camera[2, 3])
        daylight = self._lit.daylight_w_m2(depth_m)
        veil = self._lit.veil_w_m2_sr(depth_m)
        # Beyond this nothing but veil is left, and e^x would run into slow denormal numbers.
        np.minimum(distance, np.float32(80.0 / max(float(self._beta_direct.max()), 0.1)), out=distance)
        size = self._lit.lens.shape[::-1]
        coarse = np.asarray(cv2.resize(distance, size, interpolation=cv2.INTER_NEAREST), dtype=np.float32)
        light = self._light(T_world_camera, coarse, daylight)
        light = cv2.resize(light, (self.shape[1], self.shape[0]), interpolation=cv2.INTER_LINEAR)
        albedo = cv2.cvtColor(colour, cv2.COLOR_BGRA2BGR).astype(np.float32)
        scene = cv2.multiply(albedo, light, albedo, scale=1.0 / (255.0 * math.pi))
        image = np.asarray(cv2.multiply(scene, _exponential(distance, -self._beta_direct), scene), dtype=np.float32)
        if veil.max() > 0.0:
            lost = _exponential(distance, -self._beta_veil)
            image += cv2.transform(lost, np.column_stack([np.diag(-veil), veil]).astype(np.float32))
        return image, coarse

    def _light(self, T_world_camera: Array, distance: NDArray[np.float32], daylight: Array) -> NDArray[np.float32]:
        """Lamps' light and daylight (rows, columns, 3) on what is seen, per band, on the coarse grid of the lens."""
        rows, columns = distance.shape
        z = distance.ravel()
        lamps = (self.light.lamps_m - T_world_camera[:3, 3]) @ T_world_camera[:3, :3]
        light = np.empty((3, len(z)), dtype=np.float32)
        light[:] = daylight[:, None]
        add_spilled(
            light,
            self._rays,
            z,
            lamps.astype(np.float32),
            self.light.absorption_per_m.astype(np.float32),
            self.light.spill_w_sr.astype(np.float32),
            np.float32(LAMP_M2),
        )
        if self._lit.lamp is not None:
            self._lit.lamp.add_along(light, self._rays, z)
        return np.asarray(cv2.merge(list(light.reshape(3, rows, columns))), dtype=np.float32)


def _exponential(distance: NDArray[np.float32], per_m: Array) -> NDArray[np.float32]:
    """(h, w, 3) e^{k z} for a distance image (h, w) and three coefficients in 1/m."""
    planes = [cv2.exp(distance * np.float32(k)) for k in per_m]
    return np.asarray(cv2.merge(planes), dtype=np.float32)


@compiled
def _plane_bound(
    away: Array, lamp_to_plane: Array, height: Array, absorption: Array, beta: Array, spill_w_sr: Array
) -> Array:
    """(n, 3) greatest lamp light that planes (n,) at `height` show per band, see `Surfaces.plane_radiance`."""
    bound = np.zeros((len(height), 3))
    for plane in range(len(height)):
        for lamp in range(len(away)):
            nearest = lamp_to_plane[plane, lamp]
            span = max(away[lamp] - nearest, 0.0)
            most = np.zeros(3)
            for step in range(_BOUND_STEPS):
                d = nearest + span * (step / _BOUND_STEPS)
                light = np.exp(-absorption[lamp] * d) / max(d * d, _GLARE_M2)
                way = max(away[lamp] - nearest - span * ((step + 1) / _BOUND_STEPS), height[plane])
                for band in range(3):
                    most[band] = max(most[band], light * np.exp(-beta[band] * way))
            for band in range(3):
                bound[plane, band] += most[band] * spill_w_sr[lamp, band]
    return bound


class _Geoms:
    """Distances to the static geoms of a model: exact for boxes and planes, to the bounding sphere for others."""

    def __init__(self, model: MjModel) -> None:
        data: Any = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        fixed = model.body_weldid[model.geom_bodyid] == 0
        shown = model.geom_group <= 2
        index = np.flatnonzero(fixed & shown)
        self._place = np.array(data.geom_xpos)[index]
        self._rotation = np.array(data.geom_xmat)[index].reshape(-1, 3, 3)
        kind = np.array(model.geom_type)[index]
        size = np.array(model.geom_size)[index]
        plane, box = kind == int(mujoco.mjtGeom.mjGEOM_PLANE), kind == int(mujoco.mjtGeom.mjGEOM_BOX)
        size[plane] = np.where(size[plane] > 0.0, size[plane], 1e6) * (1.0, 1.0, 0.0)
        self._round = np.where(plane | box, 0.0, np.array(model.geom_rbound)[index])
        size[~(plane | box)] = 0.0
        self.planes = np.flatnonzero(plane)
        """Indices of the planes among the geoms."""
        self._size = size

    def distance_m(self, point: Array) -> Array:
        """(n,) distance from a point (3,) in the world to each geom, 0 inside."""
        local = np.einsum("nji,nj->ni", self._rotation, point - self._place)
        outside = np.maximum(np.abs(local) - self._size, 0.0)
        return np.maximum(np.sqrt(np.einsum("ni,ni->n", outside, outside)) - self._round, 0.0)
