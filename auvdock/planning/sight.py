"""What a camera that looks at the station sees from thousands of places at once.

Light arrives and spreads as it does for the renderer and the `beacons` fidelity; exposure and what spots add up to are
vectorised over places. The camera points at the array's centroid and is level.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.numeric.records import Records
from auvdock.optics.arrival import Arrival
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet
from auvdock.optics.sensor import SensorScale
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.spots import SpotModel
from auvdock.optics.water import WaterCfg

__all__ = ["Sight"]

Floats = NDArray[np.float32]
_BINS = 260
_EVERY = slice(0, None, 2)
_BIN_NATS = 0.06
SMOOTHING_PX2 = 0.4
"""Variance, per axis, of the 3 × 3 smoothing that the detector begins with and of the pixel's own area."""


class Sight:
    """Camera, water and lamps, ready to be asked from anywhere."""

    def __init__(self, camera: Camera, water: WaterCfg, layout: BeaconLayout, imaging: ImagingCfg) -> None:
        """Precompute tables.

        Args:
            camera: intrinsics and distortion; its mounting does not matter, it looks at the array's centroid.
            water: what lies between.
            layout: the station's lamps.
            imaging: the camera as an instrument.
        """
        self.lights = LightSet(layout, water)
        self.array = np.array(layout.indices("array"))
        self.target_m = layout.array_positions_m.mean(axis=0)
        self.camera, self.imaging = camera, imaging
        self.lens = Lens(camera, imaging)
        self.spots = SpotModel(self.lens, self.lights, imaging)
        self._smoothed = SpotModel(self.lens, self.lights, imaging, SMOOTHING_PX2)
        self.scale = SensorScale(imaging, 1.0)
        self.channel = self.lights.column("electrons_per_j") * self.lens.aperture_m2
        self.blue = np.flatnonzero(self.channel.argmax(axis=1) == 2)
        nm = np.array([beacon.wavelength_nm for beacon in layout.beacons])
        self._colours = [np.flatnonzero(nm == value) for value in np.unique(nm)]
        self._log_first = math.log(float(self.spots.radii_px[0]))
        self._log_step = math.log(float(self.spots.radii_px[1] / self.spots.radii_px[0]))

    def frames(self, points_m: Array) -> Array:
        """(m, 3, 3) right, down and ahead of a level camera at places (m, 3) that looks at the array, station frame."""
        ahead = self.target_m - points_m
        ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
        right = np.column_stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))])
        length = np.linalg.norm(right, axis=1, keepdims=True)
        # Straight above or below there is no level camera; any roll is as good as another.
        right = np.where(length > 1e-6, right / np.maximum(length, 1e-12), np.array([0.0, 1.0, 0.0]))
        return np.stack([right, np.cross(ahead, right), ahead], axis=1)

    def look(self, points_m: Array) -> Records[Arrival]:
        """(m n,) the light of all n lamps at camera places (m, 3), place by place."""
        T_station_camera = np.zeros((len(points_m), 4, 4))
        T_station_camera[:, :3, :3] = np.swapaxes(self.frames(points_m), 1, 2)
        T_station_camera[:, :3, 3], T_station_camera[:, 3, 3] = points_m, 1.0
        return self.lights.arrive_everywhere(T_station_camera, self.lens.projection)

    def profiles(self, arrivals: Records[Arrival]) -> Floats:
        """(m, n, k) irradiance per pixel at `SpotModel.radii_px` as the detector smooths it; 0 off the sensor."""
        return (
            self._smoothed.profiles(arrivals)
            .astype(np.float32)
            .reshape(-1, self.lights.count, len(self.spots.radii_px))
        )

    def sensitivity_s(self, profile: Floats, pixels: Array) -> Array:
        """(m,) exposure time × gain on which the auto-exposure settles.

        The law asks for a saturated area. Where spots overlap, the level at radius r about light i is taken as the sum
        of all spots of its colour at √(r² + d²), d their distances from it, and the ring's area is shared among the
        lights within r: far out a cluster of lights counts once, near by each for itself. Areas go into a histogram
        over the logarithm of the sensitivity that saturates them, 6 % wide, summed from the shortest and interpolated.
        """
        exposure = self.imaging.exposure
        m, n, rings = profile.shape
        if not exposure.automatic:
            return np.full(m, exposure.initial_s)
        low, high = exposure.min_s, exposure.max_s * exposure.max_gain
        gap2 = np.sum((pixels[:, :, None] - pixels[:, None]) ** 2, axis=3).astype(np.float32)
        radii = self.spots.radii_px[_EVERY]
        area = np.add.reduceat(self.spots.ring_px2, np.arange(0, rings, 2))
        level = np.zeros((m, n, len(radii)), dtype=np.float32)
        sharing = np.zeros_like(level)
        lit = profile[:, :, 0] > 0.0
        for same in self._colours:
            for i in same:
                reach2 = gap2[:, i, same][:, None, :]
                at = (radii**2).astype(np.float32)[None, :, None] + reach2
                level[:, i] = self._lookup(profile[:, same], at).sum(axis=2)
                sharing[:, i] = ((reach2 < (radii**2)[None, :, None]) & lit[:, None, same]).sum(axis=2)
        level *= lit[:, :, None]
        # Place of each ring on the axis ln(sensitivity that saturates it), from the shortest exposure upwards.
        place = level[:, :, None, :] * self.channel.astype(np.float32)[None, :, :, None]
        np.maximum(place, np.float32(1e-30), out=place)
        np.log(place, out=place)
        place *= np.float32(-1.0 / _BIN_NATS)
        place += np.float32((math.log(self.scale.saturated_e) - math.log(low)) / _BIN_NATS)
        np.clip(place, 0.0, _BINS - 1.0, out=place)
        index = place.astype(np.int32)
        index += (np.arange(m, dtype=np.int32) * _BINS)[:, None, None, None]
        weight = (area / np.maximum(sharing, 1.0))[:, :, None, :]
        weight = np.broadcast_to(weight, index.shape)
        total = np.cumsum(np.bincount(index.ravel(), weight.ravel(), minlength=m * _BINS).reshape(m, _BINS), axis=1)
        wanted = exposure.saturated_share * self.camera.width_px * self.camera.height_px * 3
        over = total >= wanted
        first = np.where(over.any(axis=1), over.argmax(axis=1), _BINS - 1)
        rows = np.arange(m)
        above, below = total[rows, first], np.where(first > 0, total[rows, np.maximum(first - 1, 0)], 0.0)
        part = np.clip((wanted - below) / np.maximum(above - below, 1e-9), 0.0, 1.0)
        return np.clip(low * np.exp((first + part) * _BIN_NATS), low, high)

    def codes(self, profile: Floats, pixels: Array, exposure_s: Array, gain: Array, places_px: Array) -> Array:
        """Blue codes (m, q) of the image at places (m, q, 2): all spots together, clipped at 255, without noise."""
        blue = self.blue
        places, spots = places_px.astype(np.float32), pixels[:, blue].astype(np.float32)
        dx = places[:, :, None, 0] - spots[:, None, :, 0]
        dy = places[:, :, None, 1] - spots[:, None, :, 1]
        dx *= dx
        dy *= dy
        dx += dy
        level = self._lookup(profile[:, blue], dx) @ self.channel[blue, 2].astype(np.float32)
        return self.code(level * exposure_s[:, None], gain)

    def code(self, electrons: Array, gain: Array) -> Array:
        """Codes (m, q) of electrons (m, q) at gains (m,), clipped at 255: `SensorScale` for many gains at once."""
        full = (self.scale.full_scale_e / gain)[:, None]
        if self.imaging.encoding == "linear":
            return np.minimum(electrons * (255.0 / full), 255.0)
        read = self.scale.read_e
        return np.minimum((np.sqrt(electrons + read**2) - read) * 255.0 / (np.sqrt(full + read**2) - read), 255.0)

    def noise_dn(self, gain: Array) -> Array:
        """(m,) standard deviation of the code in the dark parts of the image, quantisation included."""
        full, read2 = self.scale.full_scale_e / gain, self.scale.read_e**2
        if self.imaging.encoding == "linear":
            return np.sqrt(read2 * (255.0 / full) ** 2 + 1.0 / 12.0)
        return np.sqrt(0.25 * (255.0 / (np.sqrt(full + read2) - self.scale.read_e)) ** 2 + 1.0 / 12.0)

    def _lookup(self, profile: Floats, distance2_px2: Floats) -> Floats:
        """(m, q, n) irradiance per pixel of each lamp's spot (m, n, k) at squared distances (m, q, n)."""
        place = np.maximum(distance2_px2, np.float32(self.spots.radii_px[0] ** 2))
        np.log(place, out=place)
        place *= np.float32(0.5)
        place -= np.float32(self._log_first)
        place *= np.float32(1.0 / self._log_step)
        np.minimum(place, np.float32(profile.shape[2] - 1.001), out=place)
        index = place.astype(np.int32)
        place -= index
        m, n, k = profile.shape
        index += (np.arange(m * n, dtype=np.int32) * k).reshape(m, 1, n)
        flat = profile.ravel()
        lower = flat.take(index)
        index += 1
        upper = flat.take(index)
        upper -= lower
        upper *= place
        upper += lower
        return upper
