"""What a camera that looks at the station sees from many places at once: radiometry, exposure and spots, vectorised.

It is the model of the renderer and of the `beacons` fidelity, from the same lamps, water, halo table, lens, sensor and
detector model; `optics.radiometry` and `optics.sensing` compute one pose at a time, this computes thousands. The camera
points at the array's centroid and is level.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.optics.halo import halo_table
from auvdock.optics.lens import Lens
from auvdock.optics.light import beam_profile
from auvdock.optics.radiometry import LightSet
from auvdock.optics.sensor import SensorScale
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.spots import SpotModel
from auvdock.optics.water import WaterCfg

__all__ = ["Arriving", "Sight"]

Floats = NDArray[np.float32]
_BINS = 260
_EVERY = slice(0, None, 2)
_BIN_NATS = 0.06
SMOOTHING_PX2 = 0.4
"""Variance, per axis, of the 3 × 3 smoothing that the detector begins with and of the pixel's own area."""


@dataclass(frozen=True, eq=False)
class Arriving:
    """Light of n lamps at m camera places.

    Attributes:
        offset_m: (m, n, 3) from camera to lamp, station frame.
        range_m: (m, n).
        scattering_depth: (m, n) b r.
        core_w_m2: (m, n) unscattered irradiance.
        halo_w_m2: (m, n) forward-scattered irradiance.
    """

    offset_m: Array
    range_m: Array
    scattering_depth: Array
    core_w_m2: Array
    halo_w_m2: Array


class Sight:
    """Camera, water and lamps, ready to be asked from anywhere."""

    def __init__(
        self,
        camera: Camera,
        water: WaterCfg,
        layout: BeaconLayout,
        imaging: ImagingCfg,
        lights: LightSet | None = None,
    ) -> None:
        """Precompute tables.

        Args:
            camera: intrinsics and distortion; its mounting does not matter, it looks at the array's centroid.
            water: what lies between.
            layout: the station's lamps.
            imaging: the camera as an instrument.
            lights: the lamps of `layout` in `water`, if they are at hand.
        """
        self.lights = lights if lights is not None else LightSet(layout, water)
        self.array = np.array(layout.indices("array"))
        self.target_m = layout.array_positions_m.mean(axis=0)
        self.camera, self.imaging = camera, imaging
        self.lens = Lens(camera, imaging)
        self.spots = SpotModel(self.lens, self.lights, water, imaging)
        self.scale = SensorScale(imaging, 1.0)
        table = halo_table(water.scattering_angle_rad)
        self._table = table
        # Lens and detector smooth: the cusp of a halo is softened by half as much again as the renderer softens it.
        smooth2 = imaging.lens_sigma_px**2 + SMOOTHING_PX2
        angle = np.sqrt(self.spots.radii_px**2 + 1.5 * smooth2) * self.lens.rad_per_px
        self._rows = (table.density_rows(angle) * self.lens.rad_per_px**2).astype(np.float32)
        self._minus_half_r2 = (-0.5 * self.spots.radii_px**2).astype(np.float32)
        self.channel = self.lights.electrons_per_j * self.lens.aperture_m2
        self._beam_deg = [beacon.beam_angle_deg for beacon in layout.beacons]
        rim = layout.array_positions_m
        self._rim_x = float(np.mean(rim[:, 0]))
        self._rim_centre = rim[:, 1:].mean(axis=0)
        self._rim_radius2 = float(np.max(np.sum((rim[:, 1:] - self._rim_centre) ** 2, axis=1)))
        self.blue = np.flatnonzero(self.channel.argmax(axis=1) == 2)
        nm = np.array([beacon.wavelength_nm for beacon in layout.beacons])
        self._colours = [np.flatnonzero(nm == value) for value in np.unique(nm)]
        self._log_first = math.log(float(self.spots.radii_px[0]))
        self._log_step = math.log(float(self.spots.radii_px[1] / self.spots.radii_px[0]))

    def arriving(self, points_m: Array) -> Arriving:
        """Core and halo irradiance of all lamps at camera places (m, 3); equal to `LightSet.received` pose by pose."""
        lights = self.lights
        offset = lights.positions_m[None] - points_m[:, None]
        r = np.sqrt(np.maximum(np.einsum("mni,mni->mn", offset, offset), 1e-4))
        cosine = -np.einsum("mni,ni->mn", offset, lights.axes) / r
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        total = lights.peak_w_sr * np.exp(-lights.absorption_per_m * r) / (r * r)
        for index in range(lights.count):
            total[:, index] *= self._beam(index, angle[:, index])
        total[self._hidden(points_m)] = 0.0
        depth = lights.scattering_per_m * r
        core = total * np.exp(-depth)
        return Arriving(offset, r, depth, core, total - core)

    def on_sensor(self, points_m: Array, offset_m: Array) -> tuple[Array, BoolArray]:
        """Pixels (m, n, 2) of the lamps and whether their centres fall on the sensor (m, n)."""
        ahead = self.target_m - points_m
        ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
        right = np.column_stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))])
        length = np.linalg.norm(right, axis=1, keepdims=True)
        # Straight above or below there is no level camera; any roll is as good as another.
        right = np.where(length > 1e-6, right / np.maximum(length, 1e-12), np.array([0.0, 1.0, 0.0]))
        down = np.cross(ahead, right)
        frame = np.stack([right, down, ahead], axis=1)
        rays = np.einsum("mij,mnj->mni", frame, offset_m)
        rays /= np.maximum(np.linalg.norm(rays, axis=2, keepdims=True), 1e-9)
        pixels, inside = self.lens.locate(rays.reshape(-1, 3))
        inside &= rays.reshape(-1, 3)[:, 2] > 0.0
        return pixels.reshape(*rays.shape[:2], 2), inside.reshape(rays.shape[:2])

    def profiles(self, arriving: Arriving, inside: BoolArray) -> Floats:
        """(m, n, k) irradiance per pixel at `SpotModel.radii_px`; 0 for lamps that are not on the sensor."""
        row, weight = self._table.row_of(arriving.scattering_depth.ravel())
        shape = (*arriving.range_m.shape, len(self._minus_half_r2))
        lower = self._rows[row]
        profile = lower + (self._rows[row + 1] - lower) * weight.astype(np.float32)[:, None]
        profile *= arriving.halo_w_m2.ravel().astype(np.float32)[:, None]
        sigma2 = (self.spots.sigma_px(arriving.range_m.ravel()) ** 2 + SMOOTHING_PX2).astype(np.float32)
        gauss = np.exp(self._minus_half_r2 / sigma2[:, None])
        gauss *= (arriving.core_w_m2.ravel() / (2.0 * math.pi * sigma2)).astype(np.float32)[:, None]
        profile += gauss
        profile *= inside.ravel()[:, None]
        return np.asarray(profile, dtype=np.float32).reshape(shape)

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

    def _beam(self, index: int, angle: Array) -> Array:
        return beam_profile(angle, self._beam_deg[index])

    def _hidden(self, points_m: Array) -> BoolArray:
        """(m, n) lamps inside the funnel that its rim hides: the rule of `LightSet`."""
        positions = self.lights.positions_m
        setback = self._rim_x - positions[:, 0]
        lateral = positions[:, 1:] - self._rim_centre
        recessed = (setback > 0.05) & (np.sum(lateral**2, axis=1) < self._rim_radius2)
        hidden = np.zeros((len(points_m), len(positions)), dtype=np.bool_)
        ahead = points_m[:, 0] - self._rim_x
        front = ahead > 0.0
        for index in np.flatnonzero(recessed):
            share = setback[index] / (setback[index] + np.maximum(ahead, 1e-9))
            crossing = lateral[index] * (1.0 - share)[:, None] + (points_m[:, 1:] - self._rim_centre) * share[:, None]
            hidden[:, index] = front & (np.sum(crossing**2, axis=1) > self._rim_radius2)
        return hidden
