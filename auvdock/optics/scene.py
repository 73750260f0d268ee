"""Lamps, water, nuisances and lens together: what light reaches the camera at a pose. Shared by both fidelities."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.beacons import BeaconCfg, BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import invert
from auvdock.optics.bands import BANDS_NM, electrons_per_joule
from auvdock.optics.faults import dead_indices
from auvdock.optics.lamp import LampCfg, VehicleLamp
from auvdock.optics.lens import Lens
from auvdock.optics.nuisance import NuisanceCfg, nuisance_streams
from auvdock.optics.radiometry import LightSet, Received
from auvdock.optics.rotating_light import Beam, RotatingLight
from auvdock.optics.sensor import SensorScale
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.snow import Flakes, MarineSnow
from auvdock.optics.spots import SpotModel
from auvdock.optics.water import WaterCfg

__all__ = ["LitScene", "View"]

_WATER_INDEX = 1.34


class View(NamedTuple):
    """What the lamps send into the camera in one frame.

    Attributes:
        T_world_camera: (4, 4).
        received: light of every lamp, nuisances included.
        pixels: (n, 2) positions on the sensor; meaningful where `inside` or near it.
        inside: (n,) lamps whose centre falls on the sensor.
        flakes: marine snow, None without.
        beam: what is seen of the rotating beacon beside its lamp, None without one.
    """

    T_world_camera: Array
    received: Received
    pixels: Array
    inside: BoolArray
    flakes: Flakes | None
    beam: Beam | None = None


class LitScene:
    """Lamps of the station, lamps of others and mirror images, with their fluctuations."""

    def __init__(
        self,
        camera: Camera,
        water: WaterCfg,
        layout: BeaconLayout,
        nuisance: NuisanceCfg,
        cfg: ImagingCfg,
        T_world_station: Array,
        rotating: RotatingBeaconCfg | None = None,
        *,
        seen_from: str = "front",
        lamp: LampCfg | None = None,
        dead_lights: tuple[str, ...] = (),
    ) -> None:
        """Precompute what does not change within an episode.

        Args:
            camera: intrinsics, distortion and mounting.
            water: what lies between.
            layout: the station's beacons.
            nuisance: what makes the scene hard.
            cfg: the camera as an instrument.
            T_world_station: (4, 4) pose of the station frame.
            rotating: the station's rotating beacon, if it has one.
            seen_from: "front" for a funnel along x, "above" for a platform whose lights shine up.
            lamp: the vehicle's own lamps beside the camera, None for none.
            dead_lights: names of the station's lights that do not shine.

        Raises:
            ConfigError: a dead light that the station does not have.
        """
        self.camera, self.water, self.layout, self.nuisance, self.cfg = camera, water, layout, nuisance, cfg
        self.rotating: RotatingLight | None = None
        """The rotating beacon; its lamp comes right after those of the layout."""
        self._own = (*layout.beacons, *((_lamp_of(rotating),) if rotating is not None else ()))
        self._rotating_cfg = rotating
        self.T_world_station = T_world_station
        self._T_station_world = invert(T_world_station)
        self._seen_from = seen_from
        self.dead = dead_indices(layout, dead_lights)
        """Indices of the station's lights that do not shine."""
        self.lens = Lens(camera, cfg)
        self.lamp = VehicleLamp(lamp, self.lens, water) if lamp is not None and lamp.power_w > 0.0 else None
        """The vehicle's own lamps."""
        self._scale = (1.0, SensorScale(cfg, 1.0))
        self.electrons_per_j = np.array([electrons_per_joule(nm) for nm in BANDS_NM]).T * self.lens.aperture_m2
        """(3, 3) electrons per second of each channel (row) for 1 W/(m² sr) over 1 sr in each band (column)."""
        self.snow = MarineSnow(nuisance.snow_level, self.lens, float(water.attenuation[0]))
        self._fluctuates = nuisance.flicker != "none" or nuisance.marine_snow != "none"
        self._mirrors = nuisance.surface_reflection != "none"
        self.sensor_rng, self._streams = nuisance_streams(np.random.default_rng(0))
        quiet = not (self._fluctuates or self._mirrors) and nuisance.daylight == "none"
        self.is_plain = quiet and rotating is None and not len(self.dead) and self.lens.is_radial
        """Whether a frame shows nothing but lamps through water and a radial lens, so that `light_loop.see` will do."""
        self._set_lights(())
        self.reset(np.random.default_rng(0))

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the episode's strangers, flakes and fluctuations; one stream per part."""
        self.sensor_rng, self._streams = nuisance_streams(rng)
        self.snow.reset(self._streams["marine_snow"])
        strangers = self._strangers(self._streams["interfering_lights"])
        n = len(self._own)
        if strangers or self.lights.count != n:
            self._set_lights(strangers)
        self._log = self._streams["flicker"].standard_normal(n)
        self._dark_until = np.full(n, -np.inf)
        self._occluded_until = np.full(n, -np.inf)
        self._last_s: float | None = None

    def daylight_w_m2(self, depth_m: float) -> Array:
        """(3,) downwelling irradiance per band at a depth: E(0) e^{-K_d z}."""
        surface = self.nuisance.daylight_level.irradiance_w_m2
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

    def scale(self, gain: float) -> SensorScale:
        """The sensor's scale at a gain; the last one is kept."""
        if self._scale[0] != gain:
            self._scale = (gain, SensorScale(self.cfg, gain))
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
        received = self.lights.received(T_station_camera)
        if len(self.dead):
            received.core_w_m2[self._unlit] = 0.0
            received.halo_w_m2[self._unlit] = 0.0
        beam = None
        if self.rotating is not None:
            turned_s = time_s if station_time_s is None else station_time_s
            beam = self.rotating.shine(received, T_station_camera[:3, :3], turned_s, exposure_s)
        if self._fluctuates:
            factor = self._fluctuate(time_s, received.range_m)[self._source]
            received.core_w_m2[:] *= factor
            received.halo_w_m2[:] *= factor
            if self.rotating is not None and beam is not None:
                beam.light_w_m2[:] *= factor[self.rotating.lamp]
        if self._mirrors:
            self._mirror(received, T_world_camera)
        pixels, inside = self.lens.locate(received.ray_camera)
        flakes = None
        if self.nuisance.marine_snow != "none":
            day = float(self.daylight_w_m2(-T_world_camera[2, 3])[0])
            flakes = self.snow.flakes(T_world_camera, received, day)
        return View(T_world_camera, received, pixels, inside, flakes, beam)

    def station_camera(self, T_world_body: Array) -> Array:
        """(4, 4) pose of the camera in the station frame, for a pose of the vehicle."""
        return self._T_station_world.dot(T_world_body.dot(self.camera.T_body_camera))

    def flake_channel(self, view: View) -> Array:
        """(3,) electrons per second for 1 W/m² of light from flakes: the mean colour of what lights them."""
        light = view.received.core_w_m2 + view.received.halo_w_m2 + 1e-12
        return light @ self.lights.electrons_per_j / float(light.sum()) * self.lens.aperture_m2

    def _set_lights(self, strangers: tuple[BeaconCfg, ...]) -> None:
        self.lights = LightSet(self.layout, self.water, self._own[len(self.layout.beacons) :])
        mirrored = [k for k, beacon in enumerate(self._own) if beacon.role != "entrance"]
        images = self._images(mirrored) if self._mirrors else ()
        fixed = len(self.layout.beacons)
        extra = (*self._own[fixed:], *strangers, *images)
        self.lights = LightSet(self.layout, self.water, extra, funnel=self._seen_from == "front")
        self._image_slice = slice(self.lights.count - len(images), self.lights.count)
        own = len(self._own)
        if self._rotating_cfg is not None:
            image = self.lights.count - 1 if images else None
            self.rotating = RotatingLight(self._rotating_cfg, self.lights, self.water, fixed, image)
        # Whose fluctuation each light shares: its own, none (the last entry), or that of the lamp it mirrors.
        source = [*range(own), *(own for _ in strangers), *mirrored[: len(images)]]
        self._source = np.array(source, dtype=np.int64)
        self._unlit = np.flatnonzero(np.isin(self._source, self.dead))
        self.spots = SpotModel(self.lens, self.lights, self.water, self.cfg)

    def _strangers(self, rng: np.random.Generator) -> tuple[BeaconCfg, ...]:
        level = self.nuisance.interference_level
        lamps: list[BeaconCfg] = []
        for index in range(level.count):
            if self._seen_from == "above":
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
        rotation, origin = self.T_world_station[:3, :3], self.T_world_station[:3, 3]
        flip = np.array([1.0, 1.0, -1.0])
        for k in mirrored:
            beacon, position, axis = self._own[k], self.lights.positions_m[k], self.lights.axes[k]
            place = rotation.T @ (flip * (rotation @ position + origin) - origin)
            way = rotation.T @ (flip * (rotation @ axis))
            images.append(
                BeaconCfg(
                    f"image of {beacon.name}",
                    beacon.role,
                    (float(place[0]), float(place[1]), float(place[2])),
                    (float(way[0]), float(way[1]), float(way[2])),
                    beacon.wavelength_nm,
                    beacon.power_w,
                    beacon.efficiency,
                    beacon.beam_angle_deg,
                )
            )
        return tuple(images)

    def _mirror(self, received: Received, T_world_camera: Array) -> None:
        level = self.nuisance.reflection_level
        part = self._image_slice
        up = received.ray_camera[part] @ T_world_camera[2, :3]
        factor = level.share * _fresnel_from_water(np.abs(up)) * (up > 0.0)
        received.core_w_m2[part] *= factor
        received.halo_w_m2[part] *= factor
        rays = received.ray_camera[part]
        rays += self._streams["surface_reflection"].normal(0.0, 2.0 * level.slope_rad, rays.shape)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)

    def _fluctuate(self, time_s: float, range_m: Array) -> Array:
        """(station's lamps + 1,) factors on their light; the last entry is 1."""
        flicker, snow = self.nuisance.flicker_level, self.nuisance.snow_level
        n = len(self._own)
        step = 0.0 if self._last_s is None else max(time_s - self._last_s, 0.0)
        self._last_s = time_s
        stream = self._streams["flicker"]
        keep = math.exp(-step / flicker.correlation_s)
        self._log *= keep
        self._log += math.sqrt(1.0 - keep * keep) * stream.standard_normal(n)
        std = flicker.log_std_at_10_m * np.sqrt(range_m[:n] / 10.0)
        factor = np.exp(std * self._log - 0.5 * std * std)
        draws = stream.random((2, n))
        starts = draws[0] < 1.0 - math.exp(-flicker.dropouts_per_s * step)
        ends = time_s - flicker.dropout_s * np.log(np.maximum(draws[1], 1e-12))
        self._dark_until[starts] = ends[starts]
        factor[self._dark_until > time_s] = 0.0
        draws = self._streams["marine_snow"].random((2, n))
        starts = draws[0] < 1.0 - math.exp(-snow.occlusions_per_s * step)
        ends = time_s - snow.occlusion_s * np.log(np.maximum(draws[1], 1e-12))
        self._occluded_until[starts] = ends[starts]
        factor[self._occluded_until > time_s] *= snow.occlusion_transmission
        return np.append(factor, 1.0)


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


def _fresnel_from_water(cosine: Array) -> Array:
    """Reflectance (n,) for unpolarised light that meets the surface from below (total beyond 48.3°)."""
    sine2 = np.minimum(_WATER_INDEX**2 * (1.0 - cosine**2), 1.0)
    inside, outside = cosine, np.sqrt(1.0 - sine2)
    s = (_WATER_INDEX * inside - outside) / (_WATER_INDEX * inside + outside + 1e-12)
    p = (inside - _WATER_INDEX * outside) / (inside + _WATER_INDEX * outside + 1e-12)
    return 0.5 * (s * s + p * p)
