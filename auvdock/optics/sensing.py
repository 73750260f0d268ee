"""The `beacons` fidelity: detections from the radiometry alone, without an image."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.contracts import Detections
from auvdock.optics.detection_model import (
    Candidates,
    DetectionModelCfg,
    FlashModelCfg,
    draw_detections,
    load_detection_model,
)
from auvdock.optics.exposure import AutoExposure, frames_of_a_turn
from auvdock.optics.flash import FlashOptics, with_flash
from auvdock.optics.meeting import Candidate, squared_distances
from auvdock.optics.metering import predicted_share, veil_share
from auvdock.optics.scene import LitScene
from auvdock.optics.sensor import SensorScale
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.spots import Spots
from auvdock.optics.view import Flakes, View

__all__ = ["BeaconSensor", "meet"]


class BeaconSensor:
    """Gives what a detector would give, from the same lamps, water, nuisances and exposure law as the renderer."""

    def __init__(
        self, setup: OpticalSetup, detector_name: str = "threshold", model: DetectionModelCfg | None = None
    ) -> None:
        """Precompute tables.

        Args:
            setup: camera, water and lights.
            detector_name: detector whose fitted behaviour is drawn from.
            model: that behaviour itself, in place of the fitted one.

        Raises:
            ConfigError: nothing was fitted for a detector of that name.
        """
        self.model = model if model is not None else load_detection_model(detector_name)
        self.lit = LitScene(setup)
        self._flash = FlashOptics(self.lit)
        camera = setup.camera
        self.exposure = AutoExposure(setup.imaging.exposure, frames_of_a_turn(camera, setup.rotating))
        self._size = (camera.width_px, camera.height_px)
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Start an episode: new nuisances, exposure from scratch."""
        self.lit.reset(rng)
        self.exposure.reset()

    def detect(self, T_world_body: Array, time_s: float, station_time_s: float | None = None) -> Detections:
        """Detections of a frame from a body pose (4, 4); times as in `UnderwaterCamera.capture`."""
        lit, exposure = self.lit, self.exposure
        view = lit.look(T_world_body, time_s, station_time_s, exposure.exposure_s)
        spots = self._flash.spots(view)
        if not exposure.settled:
            exposure.settle(predicted_share(lit, view, spots, exposure.metered))
        seen, share = meet(lit, view, spots, exposure.exposure_s, exposure.gain, flash_model=self.model.flash)
        if exposure.metered < 1.0:
            share = predicted_share(lit, view, spots, exposure.metered)(exposure.sensitivity_s)
        exposure.update(share)
        return draw_detections(seen, self.model, self._size, lit.sensor_rng)


def meet(
    lit: LitScene,
    view: View,
    spots: Spots,
    exposure_s: float,
    gain: float,
    *,
    flash_model: FlashModelCfg | None = None,
    ground_e_s: Array | None = None,
) -> tuple[Candidates, float]:
    """The lights on the sensor as a detector meets them, and the saturated share of the image.

    A light's surroundings are the cores and halos of all others at its centre, and the veil of daylight.

    Args:
        lit: the scene.
        view: its lamps in this frame.
        spots: those whose centre is on the sensor, in the order of `view.inside`.
        exposure_s: exposure time.
        gain: analogue gain.
        flash_model: how the detector meets a rotating beacon; None: the defaults.
        ground_e_s: (3,) electrons per second and pixel of the surfaces behind the lights, in place of the veil.
    """
    scale = lit.scale(gain)
    behind_e_s = lit.behind_e_s(view) if ground_e_s is None else ground_e_s
    lights, distance2_px2, saturated_px2 = lit.spots.meet(spots, scale, exposure_s, behind_e_s)
    share = saturated_px2 / lit.spots.samples
    if ground_e_s is None and lit.is_day:
        share += veil_share(behind_e_s * exposure_s, scale.saturated_e)
    seen = Candidates(lights, distance2_px2)
    if view.beam is not None:
        seen = with_flash(lit, spots, seen, scale, exposure_s, flash_model or FlashModelCfg())
    if view.flakes is not None:
        colour = lit.flake_channel(view) * exposure_s
        seen = _with_flakes(seen, view.flakes, colour, lit.setup.imaging.lens_sigma_px, scale, exposure_s)
    return seen, share


def _with_flakes(
    seen: Candidates, flakes: Flakes, colour: Array, lens_sigma_px: float, scale: SensorScale, exposure_s: float
) -> Candidates:
    """Flakes of snow among the lights: to a detector they are lights; `colour` (3,) is electrons for 1 W/m²."""
    sigma = np.hypot(lens_sigma_px, flakes.sigma_px)
    best = int(np.argmax(colour))
    peak = flakes.irradiance_w_m2 * colour[best] / (2.0 * math.pi * sigma * sigma)
    contrast = np.minimum(scale.codes(peak), 255.0)
    shown = np.flatnonzero(contrast > 2.0)
    m = len(seen.lights)
    lights = Candidate.zeros(m + len(shown))
    lights[:m], more = seen.lights, lights[m:]
    more["pixel"], more["contrast_dn"] = flakes.pixels[shown], contrast[shown]
    more["noise_dn"], more["width_px"] = scale.noise_dn(peak[shown]), sigma[shown]
    more["flux"], more["light_e_s"], more["red"] = peak[shown], peak[shown] / exposure_s, best == 0
    return seen._replace(lights=lights, distance2_px2=squared_distances(lights))
