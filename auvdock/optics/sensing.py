"""The `beacons` fidelity: detections from the radiometry alone, without an image."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.contracts import Detections
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.optics.detection_model import (
    Candidates,
    DetectionModelCfg,
    FlashModelCfg,
    draw_among,
    draw_detections,
    load_detection_model,
)
from auvdock.optics.exposure import AutoExposure, frames_of_a_turn
from auvdock.optics.flash import FlashOptics, with_flash
from auvdock.optics.light_loop import see, squared_distances
from auvdock.optics.metering import predicted_share, veil_share
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.scene import LitScene, View
from auvdock.optics.sensor import SensorScale
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.spots import Spots
from auvdock.optics.water import WaterCfg

__all__ = ["BeaconSensor", "candidates_in_view"]

_RED_CHANNEL = np.array(0)


class BeaconSensor:
    """Gives what a detector would give, from the same lamps, water, nuisances and exposure law as the renderer."""

    def __init__(
        self,
        camera: Camera,
        water: WaterCfg,
        layout: BeaconLayout,
        nuisance: NuisanceCfg,
        cfg: ImagingCfg,
        T_world_station: Array,
        detector_name: str = "threshold",
        model: DetectionModelCfg | None = None,
        rotating: RotatingBeaconCfg | None = None,
    ) -> None:
        """Precompute tables.

        Args:
            camera: intrinsics, distortion and mounting.
            water: what lies between.
            layout: the station's beacons.
            nuisance: what makes the scene hard.
            cfg: the camera as an instrument.
            T_world_station: (4, 4) pose of the station frame.
            detector_name: detector whose fitted behaviour is drawn from.
            model: that behaviour itself, in place of the fitted one.
            rotating: the station's rotating beacon, if it has one.

        Raises:
            ConfigError: nothing was fitted for a detector of that name.
        """
        self.model = model if model is not None else load_detection_model(detector_name)
        self.lit = LitScene(camera, water, layout, nuisance, cfg, T_world_station, rotating)
        self._flash = FlashOptics(self.lit)
        self.exposure = AutoExposure(cfg.exposure, frames_of_a_turn(camera, rotating))
        self._size = (camera.width_px, camera.height_px)
        self._rng = np.random.default_rng(0)
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Start an episode: new nuisances, exposure from scratch."""
        self.lit.reset(rng)
        self._rng = self.lit.sensor_rng
        self.exposure.reset()

    def detect(self, T_world_body: Array, time_s: float, station_time_s: float | None = None) -> Detections:
        """Detections of a frame from a body pose (4, 4); times as in `UnderwaterCamera.capture`."""
        exposure = self.exposure
        if exposure.settled and exposure.metered == 1.0 and self.lit.is_plain:
            return self._detect_plain(T_world_body)
        view = self.lit.look(T_world_body, time_s, station_time_s, exposure.exposure_s)
        spots = self._flash.spots(view)
        if not exposure.settled:
            exposure.settle(predicted_share(self.lit, view, spots, exposure.metered))
        seen, share = candidates_in_view(self.lit, view, spots, exposure.exposure_s, exposure.gain, self.model.flash)
        if exposure.metered < 1.0:
            share = predicted_share(self.lit, view, spots, exposure.metered)(exposure.sensitivity_s)
        exposure.update(share)
        return draw_detections(seen, self.model, self._size, self._rng)

    def _detect_plain(self, T_world_body: Array) -> Detections:
        """`detect` where nothing but lamps, water and lens plays a part: the same in one compiled call."""
        lit, exposure = self.lit, self.exposure
        lights, spots, exposure_s = lit.lights, lit.spots, exposure.exposure_s
        scale = lit.scale(exposure.gain)
        pixels, levels, red, distance2, area, hidden, near = see(
            lit.station_camera(T_world_body),
            lights.lamps,
            lights.behind,
            lights.rim,
            lit.lens.numbers,
            *spots.spreading,
            spots.ring_px2,
            spots.spacing,
            spots.channel,
            scale.numbers,
            exposure_s,
            scale.saturated_e,
            self.model.numbers,
        )
        exposure.update(area / spots.samples)
        seen = Candidates(pixels, levels, distance2, red)
        return draw_among(seen, (hidden, near), self.model, self._size, self._rng)


def candidates_in_view(
    lit: LitScene,
    view: View,
    spots: Spots,
    exposure_s: float,
    gain: float,
    flash_model: FlashModelCfg | None = None,
    ground_e_s: Array | None = None,
) -> tuple[Candidates, float]:
    """The lights on the sensor as a detector meets them, and the saturated share of the image.

    A light's surroundings are the cores and halos of all others at its centre, and the veil of daylight.

    Args:
        lit: the scene.
        view: its lamps in this frame.
        spots: profiles of those whose centre is on the sensor, in the order of `view.inside`.
        exposure_s: exposure time.
        gain: analogue gain.
        flash_model: how the detector meets a rotating beacon; None: the defaults.
        ground_e_s: (3,) electrons per second and pixel of the surfaces behind the lights, in place of the veil.
    """
    pixels = view.pixels.compress(view.inside, 0)
    scale = lit.scale(gain)
    met = lit.spots.meet(spots, pixels, exposure_s, scale.saturated_e)
    around, share = met.around_e, met.share
    if ground_e_s is not None:
        around += ground_e_s[met.channel] * exposure_s
    elif lit.nuisance.daylight != "none":
        veil = lit.veil_e_s(-float(view.T_world_camera[2, 3])) * exposure_s
        around += veil[met.channel]
        share += veil_share(veil, scale.saturated_e)
    levels = np.array([*scale.contrast(met.own_e, around), met.radius_px, spots.sigma_px, met.own_e])
    seen = Candidates(pixels, levels, met.distance2_px2, met.channel == _RED_CHANNEL)
    if view.beam is not None:
        seen = with_flash(lit, spots, seen, scale, exposure_s, flash_model or FlashModelCfg())
    if view.flakes is None:
        return seen, share
    return _with_flakes(lit, view, seen, scale, exposure_s), share


def _with_flakes(lit: LitScene, view: View, seen: Candidates, scale: SensorScale, exposure_s: float) -> Candidates:
    """Flakes of snow among the lights: to a detector they are lights."""
    flakes = view.flakes
    if flakes is None:
        return seen
    sigma = np.hypot(lit.cfg.lens_sigma_px, flakes.sigma_px)
    colour = lit.flake_channel(view) * exposure_s
    best = int(np.argmax(colour))
    peak = flakes.irradiance_w_m2 * colour[best] / (2.0 * math.pi * sigma * sigma)
    contrast = np.minimum(scale.codes(peak), 255.0)
    shown = np.flatnonzero(contrast > 2.0)
    pixels = np.concatenate([seen.pixels, flakes.pixels[shown]])
    none = np.zeros(len(shown))
    more = contrast[shown], none, scale.noise_dn(peak[shown]), none, sigma[shown], peak[shown]
    return Candidates(
        pixels,
        np.concatenate([seen.levels, np.array(more)], axis=1),
        squared_distances(pixels),
        np.concatenate([seen.red, np.full(len(shown), best == 0)]),
        seen.flash,
        None if seen.light_e_s is None else np.concatenate([seen.light_e_s, peak[shown] / exposure_s]),
        None if seen.light_noise_e_s is None else np.concatenate([seen.light_noise_e_s, none]),
    )
