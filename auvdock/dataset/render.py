"""Renders a scene's frames and labels them: the picture with noise, the labels on the expected picture without."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.station import ConicalStationCfg
from auvdock.dataset.conditions import Condition, Stage, draw_condition, set_stage
from auvdock.dataset.config import DatasetCfg
from auvdock.dataset.jellyfish import add_jellyfish
from auvdock.dataset.labels import Label, LabelledFrame
from auvdock.dataset.lights import Onlooker
from auvdock.dataset.plan import SceneSpec
from auvdock.dataset.poses import Room, before_funnel, over_platform
from auvdock.dataset.rules import label_lights
from auvdock.dataset.tags import label_tag
from auvdock.optics.gl import StaticRenderer
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.metering import predicted_share
from auvdock.optics.sensor import Sensor, SensorScale
from auvdock.optics.view import View

__all__ = ["render_scene"]

_APART_S = 1.7
"""Time between a condition's frames: long after flicker has forgotten, and no multiple of a beacon's turn."""
_FACING_DEG = 6.0
"""A beam this near the camera's azimuth faces it."""
_METERED = 29
"""Of the samples of a trial picture one in so many is sorted."""


@dataclass(frozen=True)
class _Model:
    """Owner of a MuJoCo model, as a simulator is."""

    model: Any


def render_scene(cfg: DatasetCfg, spec: SceneSpec) -> Iterator[LabelledFrame]:
    """The frames of a scene, one after the other; the same scene gives the same frames.

    One OpenGL context serves all conditions of the scene.

    Raises:
        GraphicsError: surfaces are to be seen and no OpenGL context can be had.
    """
    stage_rng, rng = np.random.default_rng(spec.seed).spawn(2)
    stage = set_stage(cfg, spec, stage_rng)
    renderer: StaticRenderer | None = None
    left = spec.frames
    try:
        while left > 0:
            count = min(left, cfg.scenes.frames)
            condition = draw_condition(cfg, spec, stage, rng.spawn(1)[0])
            imager = UnderwaterCamera(condition.setup, _Model(stage.model))
            if imager.surfaces is not None:
                # The model and the camera's geometry are the same, and with them the picture that OpenGL draws.
                renderer = renderer or imager.surfaces.renderer
                imager.surfaces.renderer = renderer
            yield from _Shooting(cfg, stage, condition, imager, rng.spawn(1)[0]).frames(count)
            left -= count
    finally:
        if renderer is not None:
            renderer.close()


class _Shooting:
    """Takes the frames of one condition."""

    def __init__(
        self, cfg: DatasetCfg, stage: Stage, condition: Condition, imager: UnderwaterCamera, rng: np.random.Generator
    ) -> None:
        self._cfg, self._stage, self._condition, self._imager = cfg, stage, condition, imager
        scene_rng, sensor_rng, self._rng = rng.spawn(3)
        imager.reset(scene_rng)
        camera = stage.camera
        self._sensor = Sensor(camera.width_px, camera.height_px, condition.imaging)
        self._sensor.reset(sensor_rng)
        self._onlooker = Onlooker(imager, 0.5 * cfg.labels.cap_px)
        self._room = Room(-float(condition.setup.T_world_station[2, 3]), stage.station.floor_below_m)

    def frames(self, count: int) -> Iterator[LabelledFrame]:
        """So many frames."""
        for index in range(count):
            # A generator of its own, so that what one frame draws leaves the others as they are.
            yield self._frame(index, self._rng.spawn(1)[0])

    def _frame(self, index: int, rng: np.random.Generator) -> LabelledFrame:
        cfg, imager, condition = self._cfg, self._imager, self._condition
        c_range = float(rng.uniform(*condition.band))
        range_m = max(c_range / condition.c_per_m, cfg.range.least_m)
        pose, azimuth_rad = self._pose(range_m, rng)
        view = imager.lit.look(pose, _APART_S * index, self._station_time_s(azimuth_rad, rng), 0.001)
        low, high = np.log(cfg.exposure.factor)
        exposure_s, gain = self._exposure(view, float(math.exp(rng.uniform(low, high))))
        electrons = imager.electrons(view, exposure_s, gain)
        scale = imager.lit.scale(gain)
        jellyfish = 0
        if rng.random() < cfg.nuisance.jellyfish_share:
            jellyfish = add_jellyfish(electrons, scale.saturated_e, rng)
        labels = self._labels(electrons, scale, view, exposure_s, gain)
        image = self._sensor.expose(electrons, gain)
        setup = condition.setup
        facts: dict[str, Any] = {
            "kind": self._stage.kind,
            "lights": self._stage.lights,
            "water": setup.water.name,
            "attenuation_per_m": condition.c_per_m,
            "range_m": range_m,
            "c_range": condition.c_per_m * range_m,
            "exposure_s": exposure_s,
            "gain": gain,
            "encoding": condition.imaging.encoding,
            "own_lamp_w": 0.0 if setup.lamp is None else setup.lamp.power_w,
            "jellyfish": jellyfish,
            **vars(setup.nuisance),
        }
        return LabelledFrame(image, labels, facts)

    def _labels(
        self, electrons: NDArray[np.float32], scale: SensorScale, view: View, exposure_s: float, gain: float
    ) -> tuple[Label, ...]:
        rules, onlooker = self._cfg.labels, self._onlooker
        found = label_lights(electrons, scale, onlooker.lights(view, exposure_s), onlooker.radii_px, rules)
        return (*found, *label_tag(self._imager, view, exposure_s, gain, rules))

    def _pose(self, range_m: float, rng: np.random.Generator) -> tuple[Array, float]:
        pose, camera = self._cfg.pose, self._stage.camera
        if self._stage.is_platform:
            return over_platform(pose, range_m, camera, self._room, rng), 0.0
        around = self._stage.kind in ("rotating_front", "rotating_side")
        return before_funnel(pose, range_m, camera, self._room, rng, around=around)

    def _station_time_s(self, azimuth_rad: float, rng: np.random.Generator) -> float | None:
        """When a rotating beacon's beam faces the camera at an azimuth, or does not; None without one."""
        station = self._stage.station
        if not isinstance(station, ConicalStationCfg) or station.rotating is None:
            return None
        facing = self._stage.kind == "rotating_front"
        off_deg = rng.uniform(-_FACING_DEG, _FACING_DEG) if facing else rng.uniform(_FACING_DEG, 360.0 - _FACING_DEG)
        turned_deg = math.degrees(azimuth_rad) + float(off_deg) - station.rotating.initial_azimuth_deg
        return (turned_deg % 360.0) / 360.0 / station.rotating.rate_rev_s

    def _exposure(self, view: View, factor: float) -> tuple[float, float]:
        """Exposure time and gain: what the camera would settle at, times a factor.

        As `UnderwaterCamera.take` has it: by the lights, or by a trial picture where tag and lamps count as well.
        """
        imager, cfg = self._imager, self._condition.imaging.exposure
        auto = imager.exposure
        auto.reset()
        if imager.tag is None and imager.lit.lamp is None:
            auto.settle(predicted_share(imager.lit, view, self._onlooker.spots(view), auto.metered))
        else:
            bright = np.sort(imager.electrons(view, 1.0).reshape(-1)[::_METERED])
            level = imager.lit.scale(1.0).saturated_e
            auto.settle(lambda s: 1.0 - float(np.searchsorted(bright, level / s)) / bright.size)
        wanted_s = min(max(auto.sensitivity_s * factor, cfg.min_s), cfg.max_s * cfg.max_gain)
        return min(wanted_s, cfg.max_s), max(wanted_s / cfg.max_s, 1.0)
