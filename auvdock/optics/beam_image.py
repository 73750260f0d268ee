"""Draws the rotating beacon's beam beside its lamp: the streak that one sees of it from the side.

The unscattered light shows the beam sharp: a ribbon along a great circle, Gaussian across, evaluated per pixel of the
coarse grid of `Lens`. What scattering makes of the pieces (`optics.beam_pieces`) is broad and is evaluated on every
second row and column of the grid.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.transforms import cross
from auvdock.optics.beam_pieces import BeamPieces, PieceLight
from auvdock.optics.lens import Lens
from auvdock.optics.lights_image import coloured
from auvdock.optics.radiometry import LightSet
from auvdock.optics.rotating_light import Beam
from auvdock.optics.water import WaterCfg

__all__ = ["BeamImage"]

_ENTRIES = 384
_RIBBON = 256
_LEAST_E = 0.05
"""Electrons in a pixel that are not worth drawing: a hundredth of the read noise."""


class BeamImage:
    """The beam of one rotating beacon on one camera's sensor."""

    def __init__(self, lens: Lens, lights: LightSet, lamp: int, water: WaterCfg) -> None:
        """Precompute rays and the angles at which the pieces' tables are made."""
        self._shape = lens.shape
        # Tables are read at the fourth root of the squared chord: fine near the centre, wide outside.
        self._scale = np.float32((_ENTRIES - 1) / math.sqrt(2.0))
        index = np.arange(_ENTRIES) / float(self._scale)
        self._angle2 = (2.0 * np.arcsin(np.minimum(index**2 / 2.0, 1.0))) ** 2
        self._least_rad = 0.7 * lens.factor * lens.rad_per_px
        self._pieces = BeamPieces(water, 2.0 * self._least_rad)
        rays = lens.rays.astype(np.float32)
        self._rays = rays
        self._few_shape = (-(-lens.shape[0] // 2), -(-lens.shape[1] // 2))
        self._few = np.ascontiguousarray(cv2.resize(rays.reshape(*lens.shape, 3), self._few_shape[::-1]).reshape(-1, 3))
        self._few /= np.linalg.norm(self._few, axis=1, keepdims=True)
        self._solid_angle = lens.solid_angle_sr.astype(np.float32)
        self._pixel_sr = lens.rad_per_px**2
        self._channel = lights.electrons_per_j[lamp] * lens.aperture_m2

    def add(self, image: NDArray[np.float32], beam: Beam, exposure_s: float) -> None:
        """Add electrons per image pixel of the beam to the coarse grid (h, w, 3)."""
        pieces = self._pieces.light(beam)
        floor = _LEAST_E / (float(self._channel.max()) * exposure_s * self._pixel_sr)
        radiance = self._blobs(beam, pieces, floor)
        sharp = self._ribbon(beam, pieces.ribbon * beam.light_w_m2, floor)
        if sharp is not None:
            radiance = sharp if radiance is None else np.add(radiance, sharp, dtype=np.float32)
        if radiance is not None:
            radiance *= self._solid_angle
            image += coloured(radiance, (self._channel * exposure_s).astype(np.float32))

    def _blobs(self, beam: Beam, pieces: PieceLight, floor: float) -> NDArray[np.float32] | None:
        """(h, w) radiance of the Gaussians and halos about the pieces."""
        tables = self._pieces.per_sr(pieces, self._angle2, pieces.blob)
        tables *= beam.light_w_m2[:, None]
        index = np.flatnonzero(tables[:, 0] > floor)
        if len(index) == 0:
            return None
        chord2 = 2.0 - 2.0 * (beam.rays_camera[index].astype(np.float32) @ self._few.T)
        np.maximum(chord2, 0.0, out=chord2)
        np.sqrt(chord2, out=chord2)
        np.sqrt(chord2, out=chord2)
        chord2 *= self._scale
        entry = chord2.astype(np.int32)
        np.minimum(entry, _ENTRIES - 2, out=entry)
        chord2 -= entry
        entry += (np.arange(len(index), dtype=np.int32) * _ENTRIES)[:, None]
        flat = tables[index].astype(np.float32).ravel()
        lower = flat.take(entry)
        entry += 1
        value = flat.take(entry)
        value -= lower
        value *= chord2
        value += lower
        few = value.sum(axis=0).reshape(self._few_shape)
        return np.asarray(cv2.resize(few, self._shape[::-1], interpolation=cv2.INTER_LINEAR), dtype=np.float32)

    def _ribbon(self, beam: Beam, light: Array, floor: float) -> NDArray[np.float32] | None:
        """(h, w) radiance of the sharp part: light per angle along, spread as a Gaussian across."""
        edge = beam.edge_rad
        span = float(edge[-1])
        grid = np.linspace(0.0, span, _RIBBON)
        # Linear in the running sum, so that the light of each piece is kept.
        running = np.interp(grid, edge, np.concatenate([[0.0], np.cumsum(light)]))
        along = np.append(np.diff(running) * ((_RIBBON - 1) / span), 0.0)
        width = np.maximum(np.interp(grid, 0.5 * (edge[1:] + edge[:-1]), beam.width_rad), self._least_rad)
        along /= math.sqrt(2.0 * math.pi) * width
        if float(along.max()) < floor:
            return None
        frame = np.array([beam.ray_camera, beam.along_camera, cross(beam.ray_camera, beam.along_camera)])
        local = self._rays @ frame.T.astype(np.float32)
        place = np.arctan2(local[:, 1], local[:, 0])
        place *= np.float32((_RIBBON - 1) / span)
        place += np.float32(0.5)
        before = place < 0.0
        entry = place.astype(np.int32)
        np.clip(entry, 0, _RIBBON - 1, out=entry)
        shown = local[:, 2] * local[:, 2]
        shown *= (-0.5 / width**2).astype(np.float32).take(entry)
        np.exp(shown, out=shown)
        shown *= along.astype(np.float32).take(entry)
        shown[before] = 0.0
        return np.asarray(shown.reshape(self._shape), dtype=np.float32)
