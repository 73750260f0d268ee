"""The camera under water: from a pose to a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.contracts import Frame
from auvdock.core.response import CameraResponse
from auvdock.optics.beam_image import BeamImage
from auvdock.optics.exposure import AutoExposure, frames_of_a_turn
from auvdock.optics.faults import TagCover
from auvdock.optics.lights_image import LightsImage, add_spot
from auvdock.optics.metering import predicted_share
from auvdock.optics.scene import LitScene
from auvdock.optics.sensor import Sensor, SensorScale, saturated_share
from auvdock.optics.settings import ExposureCfg, ImagingCfg
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.surfaces import Surfaces
from auvdock.optics.tag_image import TagImage
from auvdock.optics.tag_scene import TagScene
from auvdock.optics.view import View

TAG_GEOM = "tag"
"""Name of the geom that shows the tag in MuJoCo's model, for views other than this camera's."""

__all__ = ["TAG_GEOM", "ExposureCfg", "HasModel", "ImagingCfg", "Shot", "UnderwaterCamera"]


class HasModel(Protocol):
    """Whoever owns a MuJoCo model: the simulator."""

    @property
    def model(self) -> Any:  # noqa: ANN401
        """The `mujoco.MjModel` whose static geoms are drawn."""
        ...


@dataclass(frozen=True, eq=False)
class Shot:
    """A frame and how it came about.

    Attributes:
        frame: the image.
        view: the lights behind it.
        exposure_s: exposure time.
        gain: analogue gain.
    """

    frame: Frame
    view: View
    exposure_s: float
    gain: float


class UnderwaterCamera:
    """Renders lamps, halos, surfaces and nuisances to 8 bits.

    Auto-exposure reacts to the frames taken before; `reset` forgets them.
    """

    def __init__(self, setup: OpticalSetup, scene: HasModel | None = None) -> None:
        """Precompute tables; no OpenGL context is made before a frame needs one.

        Args:
            setup: camera, water and lights.
            scene: owner of the MuJoCo model whose static geoms are drawn, except one named `TAG_GEOM` where there is a
                tag; without it only lights and tag are.

        Raises:
            ConfigError: a dead light that the station does not have.
        """
        imaging, camera = setup.imaging, setup.camera
        self.lit = LitScene(setup)
        self.tag = TagImage(TagScene(self.lit, setup.tag)) if setup.tag is not None else None
        self._cover = TagCover(setup.faults)
        self.exposure = AutoExposure(imaging.exposure, frames_of_a_turn(camera, setup.rotating))
        self._camera = camera
        self._response = CameraResponse(imaging.encoding, imaging.full_well_e, imaging.read_noise_e)
        self._sensor = Sensor(camera.width_px, camera.height_px, imaging)
        hidden = (TAG_GEOM,) if setup.tag is not None else ()
        self.surfaces = Surfaces(self.lit, scene.model, hidden) if scene is not None and imaging.surfaces else None
        """Station and floor; None where they are not drawn."""
        lens = self.lit.lens
        self._solid_angle = np.repeat(lens.solid_angle_sr.astype(np.float32)[:, :, None], 3, axis=2)
        self._beam_image: BeamImage | None = None
        # Enlarged coarse pixels may reach over the image's right and lower edge.
        self._whole = np.empty((lens.shape[0] * lens.factor, lens.shape[1] * lens.factor, 3), dtype=np.float32)
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Start an episode: new noise, new nuisances, exposure from scratch."""
        self.lit.reset(rng)
        lit = self.lit
        self._lights = LightsImage(lit.lens, lit.lights, lit.spots)
        if lit.rotating is not None:
            self._beam_image = BeamImage(lit.lens, lit.lights, lit.rotating.lamp)
        self._sensor.reset(self.lit.sensor_rng)
        self.exposure.reset()
        self._cover.reset()

    def close(self) -> None:
        """Free OpenGL's context, if one was made."""
        if self.surfaces is not None:
            self.surfaces.close()

    def capture(self, T_world_body: Array, time_s: float, station_time_s: float | None = None) -> Frame:
        """Take a frame from a body pose (4, 4).

        Args:
            T_world_body: (4, 4) pose of the vehicle.
            time_s: time of mid exposure by the vehicle's clock: the frame's time stamp.
            station_time_s: the same by the station's clock, which turns the rotating beacon; None: the two agree.

        Raises:
            GraphicsError: surfaces are to be seen and no OpenGL context can be had.
        """
        return self.take(T_world_body, time_s, station_time_s).frame

    def take(self, T_world_body: Array, time_s: float, station_time_s: float | None = None) -> Shot:
        """Take a frame as `capture` does, with what it was made of: for fitting detection models."""
        view = self.lit.look(T_world_body, time_s, station_time_s, self.exposure.exposure_s)
        tag_hidden = False
        if self.tag is not None:
            tag_hidden = self._cover.hidden(self.tag.scene.height_m(view.T_world_camera), time_s)
        if not self.exposure.settled:
            self._settle(view, tag_hidden)
        exposure_s, gain = self.exposure.exposure_s, self.exposure.gain
        self.electrons(view, exposure_s, gain, tag_hidden=tag_hidden)
        image = self._sensor.expose(self._whole, gain)
        code = self.lit.scale(gain).metered_code(self.exposure.metered)
        self.exposure.update(saturated_share(image, code))
        return Shot(Frame(image, time_s, self._camera, exposure_s, gain, self._response), view, exposure_s, gain)

    def _settle(self, view: View, tag_hidden: bool) -> None:
        """Choose the first exposure: from the lights, or from a trial picture where tag and lamp count as well."""
        if self.tag is None and self.lit.lamp is None:
            self.exposure.settle(predicted_share(self.lit, view, metered=self.exposure.metered))
            return
        bright = np.sort(self.electrons(view, 1.0, tag_hidden=tag_hidden).reshape(-1)[::7])
        level = SensorScale(self.lit.setup.imaging, 1.0).saturated_e
        self.exposure.settle(lambda s: 1.0 - float(np.searchsorted(bright, level / s)) / bright.size)

    @property
    def _buffer(self) -> NDArray[np.float32]:
        """(H, W, 3) the image's part of what is drawn on; a view, made anew since pickling would part the two."""
        return self._whole[: self._camera.height_px, : self._camera.width_px]

    def electrons(
        self, view: View, exposure_s: float, gain: float = 1.0, *, tag_hidden: bool = False
    ) -> NDArray[np.float32]:
        """Mean photo-electrons (H, W, 3), red, green, blue, without noise; valid until the next call."""
        lens, arrivals = self.lit.lens, view.arrivals
        lit = np.flatnonzero(view.in_sight)
        coarse = self._lights.coarse(arrivals, lit, exposure_s)
        if view.beam is not None and self._beam_image is not None:
            self._beam_image.add(coarse, view.beam, exposure_s)
        surfaces = self.surfaces
        drawn: NDArray[np.float32] | None = None
        if surfaces is not None and surfaces.visible(view.T_world_camera[:3, 3], exposure_s * gain):
            rows, columns = surfaces.shape
            drawn, distance = surfaces.electrons(view.T_world_camera, exposure_s)
            self._add_backscatter(coarse, distance, exposure_s)
            image = cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_LINEAR)
            image += drawn
        else:
            self._add_backscatter(coarse, None, exposure_s)
            image = coarse
            veil = self.lit.veil_w_m2_sr(view.depth_m)
            if veil.max() > 0.0:
                even = (self.lit.electrons_per_j @ veil * exposure_s).astype(np.float32) * self._solid_angle
                image += even
                drawn = even
        cv2.resize(image, self._whole.shape[1::-1], self._whole, interpolation=cv2.INTER_LINEAR)
        if self.tag is not None:
            self.tag.add(self._whole, view.T_world_camera, exposure_s, drawn, hidden=tag_hidden)
        near, shown = lens.locate(arrivals["ray_camera"].copy(), self._lights.reach_px)
        index = lit[shown[lit]]
        self._lights.add_fine(self._whole, arrivals, near, index, exposure_s)
        if view.flakes is not None:
            self._add_flakes(view, exposure_s)
        return self._buffer

    def _add_backscatter(
        self, image: NDArray[np.float32], distance: NDArray[np.float32] | None, exposure_s: float
    ) -> None:
        """Add what the vehicle's own lamps scatter back to an image on the coarse grid (rows, columns, 3)."""
        if self.lit.lamp is None:
            return
        radiance = self.lit.lamp.backscatter(distance)
        light = cv2.transform(radiance, (self.lit.electrons_per_j * exposure_s).astype(np.float32))
        image += light * self._solid_angle

    def _add_flakes(self, view: View, exposure_s: float) -> None:
        flakes, imaging = view.flakes, self.lit.setup.imaging
        if flakes is None:
            return
        colour = self.lit.flake_channel(view) * exposure_s
        floor = 0.3 * imaging.read_noise_e
        for pixel, light, width in zip(flakes.pixels, flakes.irradiance_w_m2, flakes.sigma_px, strict=True):
            energy = (colour * light).astype(np.float32)
            if energy.max() > floor:
                sigma = float(np.hypot(imaging.lens_sigma_px, width))
                add_spot(self._whole, pixel, min(sigma, 20.0), energy)
