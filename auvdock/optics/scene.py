"""Lamps, water, nuisances and lens together: what light reaches the camera at a pose. Shared by both fidelities."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconCfg
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import invert
from auvdock.optics.bands import BANDS_NM, electrons_per_joule
from auvdock.optics.disturbance import Flicker, Mirror
from auvdock.optics.faults import dead_indices
from auvdock.optics.lamp import VehicleLamp
from auvdock.optics.lens import Lens
from auvdock.optics.nuisance import nuisance_streams
from auvdock.optics.radiometry import LightSet
from auvdock.optics.rotating_light import RotatingLight
from auvdock.optics.sensor import SensorScale
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.snow import MarineSnow
from auvdock.optics.spots import SpotModel
from auvdock.optics.view import Moment, Step, View

__all__ = ["LitScene"]

_NIGHT = np.zeros(3)


class LitScene:
    """Lamps of the station, lamps of others and mirror images, with their fluctuations."""

    def __init__(self, setup: OpticalSetup) -> None:
        """Precompute what does not change within an episode.

        Raises:
            ConfigError: a dead light that the station does not have.
        """
        self.setup, self.camera, self.water = setup, setup.camera, setup.water
        self.rotating: RotatingLight | None = None
        """The rotating beacon; its lamp comes right after those of the layout."""
        self._own = (*setup.layout.beacons, *((_lamp_of(setup.rotating),) if setup.rotating is not None else ()))
        self._T_station_world = invert(setup.T_world_station)
        self._dead = dead_indices(setup.layout, setup.faults.dead_lights)
        self.lens = Lens(setup.camera, setup.imaging)
        lamp = setup.lamp
        self.lamp = VehicleLamp(lamp, self.lens, setup.water) if lamp is not None and lamp.power_w > 0.0 else None
        """The vehicle's own lamps."""
        self._scale = (1.0, SensorScale(setup.imaging, 1.0))
        self.electrons_per_j = np.array([electrons_per_joule(nm) for nm in BANDS_NM]).T * self.lens.aperture_m2
        """(3, 3) electrons per second of each channel (row) for 1 W/(m² sr) over 1 sr in each band (column)."""
        self.is_day = setup.nuisance.daylight != "none"
        level, c_per_m = setup.nuisance.snow_level, float(setup.water.attenuation[0])
        self.snow = MarineSnow(level, self.lens, c_per_m, self.daylight_w_m2)
        self._steps: list[Step] = []
        self._set_lights(())
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the episode's strangers, flakes and fluctuations; one stream per part."""
        nuisance = self.setup.nuisance
        self.sensor_rng, streams = nuisance_streams(rng)
        self.snow.reset(streams["marine_snow"])
        strangers = self._strangers(streams["interfering_lights"])
        if strangers or self.lights.count != len(self._own):
            self._set_lights(strangers)
        self._steps = [self.rotating.shine] if self.rotating is not None else []
        if nuisance.flicker != "none" or nuisance.marine_snow != "none":
            rotating = None if self.rotating is None else self.rotating.lamp
            source, rngs = self._source, (streams["flicker"], streams["marine_snow"])
            flicker = Flicker(nuisance, len(self._own), source, *rngs, rotating)
            self._steps.append(flicker.dim)
        if nuisance.surface_reflection != "none":
            first = self.lights.count - self._images_count
            mirror = Mirror(nuisance.reflection_level, self.lens, first, streams["surface_reflection"])
            self._steps.append(mirror.reflect)
        if len(self.snow.places_m):
            self._steps.append(self.snow.drift)

    def daylight_w_m2(self, depth_m: float) -> Array:
        """(3,) downwelling irradiance per band at a depth: E(0) e^{-K_d z}."""
        surface = self.setup.nuisance.daylight_level.irradiance_w_m2
        return surface * np.exp(-self.water.diffuse_attenuation * max(depth_m, 0.0))

    def veil_w_m2_sr(self, depth_m: float) -> Array:
        """(3,) radiance B∞ per band of unbounded water, looking level: E b_b / (2π (a + b_b)).

        Single backscattering of the downwelling light, forward scattering taken as no loss (Gordon 1973).
        """
        a, bb = self.water.absorption, self.water.backscattering
        return self.daylight_w_m2(depth_m) * bb / (2.0 * math.pi * np.maximum(a + bb, 1e-9))

    def veil_e_s(self, depth_m: float) -> Array:
        """(3,) electrons per second of the veil in a pixel in the middle of the image: red, green, blue."""
        return self.electrons_per_j @ self.veil_w_m2_sr(depth_m) * self.lens.rad_per_px**2

    def behind_e_s(self, view: View) -> Array:
        """(3,) the same at a view's depth: what is behind the lights of a camera that looks level."""
        return self.veil_e_s(view.depth_m) if self.is_day else _NIGHT

    def scale(self, gain: float) -> SensorScale:
        """The sensor's scale at a gain; the last one is kept."""
        if self._scale[0] != gain:
            self._scale = (gain, SensorScale(self.setup.imaging, gain))
        return self._scale[1]

    def look(
        self, T_world_body: Array, time_s: float, station_time_s: float | None = None, exposure_s: float = 0.0
    ) -> View:
        """Light at the camera now; advances flicker and occlusions to `time_s`.

        Args:
            T_world_body: (4, 4) pose of the vehicle.
            time_s: time of mid exposure by the vehicle's clock.
            station_time_s: the same by the station's clock, which turns the rotating beacon; None: the two agree.
            exposure_s: time over which the rotating beacon's light is averaged.
        """
        T_world_camera = T_world_body.dot(self.camera.T_body_camera)
        T_station_camera = self._T_station_world.dot(T_world_camera)
        view = View(T_world_camera, T_station_camera, self.lights.arrive(T_station_camera, self.lens.projection))
        if self._steps:
            moment = Moment(time_s, time_s if station_time_s is None else station_time_s, exposure_s)
            for step in self._steps:
                view = step(view, moment)
        return view

    def flake_channel(self, view: View) -> Array:
        """(3,) electrons per second for 1 W/m² of light from flakes: the mean colour of what lights them."""
        light = view.arrivals["core_w_m2"] + view.arrivals["halo_w_m2"] + 1e-12
        return light @ self.lights.column("electrons_per_j") / float(light.sum()) * self.lens.aperture_m2

    def _set_lights(self, strangers: tuple[BeaconCfg, ...]) -> None:
        setup, own = self.setup, len(self._own)
        fixed = len(setup.layout.beacons)
        mirrored = [k for k, beacon in enumerate(self._own) if beacon.role != "entrance"]
        images = self._images(mirrored) if setup.nuisance.surface_reflection != "none" else ()
        # Whose fluctuation each light shares: its own, none (the last entry), or that of the lamp it mirrors.
        source = [*range(own), *(own for _ in strangers), *mirrored[: len(images)]]
        self._source = np.array(source, dtype=np.int64)
        self._images_count = len(images)
        extra = (*self._own[fixed:], *strangers, *images)
        dark = np.flatnonzero(np.isin(self._source, self._dead))
        self.lights = LightSet(setup.layout, self.water, extra, funnel=setup.seen_from == "front", dark=dark)
        if setup.rotating is not None:
            image = self.lights.count - 1 if images else None
            self.rotating = RotatingLight(setup.rotating, self.lights, fixed, image)
        self.spots = SpotModel(self.lens, self.lights, setup.imaging)

    def _strangers(self, rng: np.random.Generator) -> tuple[BeaconCfg, ...]:
        level = self.setup.nuisance.interference_level
        lamps: list[BeaconCfg] = []
        for index in range(level.count):
            if self.setup.seen_from == "above":
                lamps.append(_stranger_below(index, level.power_w, rng))
                continue
            x, y, z = rng.uniform((-6.0, -6.0, -2.5), (2.0, 6.0, 3.0))
            # Keep clear of the mouth: a lamp inside the funnel would be the station's.
            y += math.copysign(1.5, y)
            nm = 450.0 if rng.random() < 0.5 else 530.0
            place = (float(x), float(y), float(z))
            lamps.append(BeaconCfg(f"stranger{index}", "array", place, (1.0, 0.0, 0.0), nm, level.power_w, 0.35, 90.0))
        return tuple(lamps)

    def _images(self, mirrored: list[int]) -> tuple[BeaconCfg, ...]:
        """Some of the station's lamps mirrored in the surface z = 0; those inside the funnel do not shine there."""
        images: list[BeaconCfg] = []
        T_world_station = self.setup.T_world_station
        rotation, origin = T_world_station[:3, :3], T_world_station[:3, 3]
        flip = np.array([1.0, 1.0, -1.0])
        axes = np.array([beacon.axis for beacon in self._own])
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        for k in mirrored:
            beacon = self._own[k]
            place = rotation.T @ (flip * (rotation @ np.array(beacon.position_m) + origin) - origin)
            x, y, z = (rotation.T @ (flip * (rotation @ axes[k]))).tolist()
            name, position_m = f"image of {beacon.name}", (float(place[0]), float(place[1]), float(place[2]))
            images.append(dataclasses.replace(beacon, name=name, position_m=position_m, axis=(x, y, z)))
        return tuple(images)


def _stranger_below(index: int, power_w: float, rng: np.random.Generator) -> BeaconCfg:
    """A lamp that lies about near a platform on the floor, 1.5 m to 4 m from its centre, and shines up."""
    distance, bearing = rng.uniform((1.5, -math.pi), (4.0, math.pi))
    place = (float(distance * math.cos(bearing)), float(distance * math.sin(bearing)), float(rng.uniform(-0.2, 1.0)))
    nm = 450.0 if rng.random() < 0.5 else 530.0
    return BeaconCfg(f"stranger{index}", "array", place, (0.0, 0.0, 1.0), nm, power_w, 0.35, 90.0)


def _lamp_of(cfg: RotatingBeaconCfg) -> BeaconCfg:
    """The rotating beacon's lamp; its axis is a place holder, `RotatingLight` says where it shines."""
    return BeaconCfg(
        "rotating",
        "long_range",
        cfg.position_m,
        (1.0, 0.0, 0.0),
        cfg.wavelength_nm,
        cfg.power_w,
        cfg.efficiency,
        cfg.divergence_deg,
    )
