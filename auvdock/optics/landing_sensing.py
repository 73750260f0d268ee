"""The `beacons` fidelity of a landing: lights and tag as detectors would give them, without an image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from auvdock.assets import asset, asset_names
from auvdock.core.arrays import Array
from auvdock.core.contracts import Detections, TagDetection
from auvdock.core.errors import ConfigError
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.strict import load_toml
from auvdock.optics.detection_model import DetectionModelCfg, draw_detections
from auvdock.optics.exposure import AutoExposure
from auvdock.optics.faults import TagCover
from auvdock.optics.ground import Ground
from auvdock.optics.metering import predicted_share
from auvdock.optics.scene import LitScene
from auvdock.optics.sensing import meet
from auvdock.optics.sensor import SensorScale
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.spots import Spots
from auvdock.optics.tag_model import TagModelCfg, draw_tag, load_tag_model, tag_sight
from auvdock.optics.tag_scene import TagScene
from auvdock.optics.view import View

__all__ = ["LandingSensor", "landing_share", "load_landing_detection_model"]


class LandingSensor:
    """Gives what the detectors would give, from the same lamps, water, faults and exposure law as the renderer."""

    def __init__(
        self,
        setup: OpticalSetup,
        station: LandingStationCfg,
        *,
        detector_name: str = "threshold",
        tag_detector_name: str = "apriltag",
        model: DetectionModelCfg | None = None,
        tag_model: TagModelCfg | None = None,
    ) -> None:
        """Precompute tables.

        Args:
            setup: camera, water and lights.
            station: the platform.
            detector_name: detector of lights whose behaviour, fitted on landing frames, is drawn from.
            tag_detector_name: detector of tags whose fitted behaviour is drawn from.
            model: the former's behaviour itself, in place of the fitted one.
            tag_model: the latter's.

        Raises:
            ConfigError: nothing was fitted for a detector of that name.
        """
        self.model = model if model is not None else load_landing_detection_model(detector_name)
        self.tag_model = tag_model if tag_model is not None else load_tag_model(tag_detector_name)
        self.lit = LitScene(setup)
        self.tag = TagScene(self.lit, station.tag)
        self.ground = Ground(self.tag, station)
        self.exposure = AutoExposure(setup.imaging.exposure)
        self._cover = TagCover(setup.faults)
        self._size = (setup.camera.width_px, setup.camera.height_px)
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Start an episode: new nuisances, exposure from scratch."""
        self.lit.reset(rng)
        self._tag_rng = rng.spawn(1)[0]
        self.exposure.reset()
        self._cover.reset()

    def detect(self, T_world_body: Array, time_s: float) -> tuple[Detections, tuple[TagDetection, ...]]:
        """Detections of lights and of the tag in a frame from a body pose (4, 4)."""
        view = self.lit.look(T_world_body, time_s)
        spots = self.lit.spots.spread(view.arrivals, view.inside)
        hidden = self._cover.hidden(self.tag.height_m(view.T_world_camera), time_s)
        ground = self.ground.electrons_per_s(view.T_world_camera, tag_hidden=hidden)
        exposure = self.exposure
        if not exposure.settled:
            exposure.settle(landing_share(self.lit, view, spots, ground))
        exposure_s, gain = exposure.exposure_s, exposure.gain
        seen, share = meet(self.lit, view, spots, exposure_s, gain, ground_e_s=np.median(ground, axis=0))
        exposure.update(share + float(np.mean(ground * exposure_s >= self.lit.scale(gain).saturated_e)))
        detections = draw_detections(seen, self.model, self._size, self.lit.sensor_rng)
        tag = None if hidden else self.tag.look(view)
        sight = None if tag is None else tag_sight(tag, self.lit, exposure_s, gain)
        return detections, draw_tag(sight, self.tag.tag.tag_id, self.tag_model, self._tag_rng)


def load_landing_detection_model(name: str) -> DetectionModelCfg:
    """The model of a detector of lights as fitted on frames from above a landing station.

    Raises:
        ConfigError: no model was fitted for a detector of that name.
    """
    known = asset_names("landing_detection")
    if name not in known:
        remedy = f"one of {', '.join(known)}: the beacons fidelity knows only fitted detectors"
        raise ConfigError("detector", name, remedy)
    return load_toml(DetectionModelCfg, asset("landing_detection", name))


def landing_share(lit: LitScene, view: View, spots: Spots, ground_e_s: Array) -> Callable[[float], float]:
    """Saturated share of the image as a function of sensitivity in seconds: lights, and ground (n, 3)."""
    lights = predicted_share(lit, view, spots)
    saturated_e = SensorScale(lit.setup.imaging, 1.0).saturated_e
    return lambda s: lights(s) + float(np.mean(ground_e_s * s >= saturated_e))
