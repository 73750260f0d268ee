"""The rotating beacon in the `beacons` fidelity: how large, how long and how bright its spot is, without an image.

The renderer's light, lamp and pieces of the beam, is evaluated on three lines from the lamp: ahead along the beam's
image, back from it, and across. In codes above those at the radius that a detector takes for background, the lines'
points of half the peak give the box; the peak is the contrast.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.optics.detection_model import Candidates, Flash
from auvdock.optics.rotating_light import Beam
from auvdock.optics.scene import LitScene
from auvdock.optics.sensor import SensorScale
from auvdock.optics.spots import SpotModel, Spots

__all__ = ["FlashShape", "beam_profiles", "flash_shape", "measured_light"]

_DISC_RAD = 0.012
_MIN_DISC_PX = 4.0


class FlashShape(NamedTuple):
    """A flash and its contrast.

    Attributes:
        flash: box and place.
        contrast_dn: code of the peak above the background.
        background_dn: code of the background.
    """

    flash: Flash
    contrast_dn: float
    background_dn: float


def beam_profiles(beam: Beam, spots: SpotModel, rad_per_px: float) -> Array:
    """(3, k) irradiance per pixel of the beam's pieces at `SpotModel.radii_px` ahead, back and across."""
    radii = spots.radii_px * rad_per_px
    phi = 0.5 * (beam.edge_rad[1:] + beam.edge_rad[:-1])
    size2 = np.hypot(0.7 * np.diff(beam.edge_rad), beam.width_rad) ** 2
    apart2 = np.array([(radii - phi[:, None]) ** 2, (radii + phi[:, None]) ** 2, radii**2 + phi[:, None] ** 2])
    row, weight = spots.table.row_of(beam.scattering_depth)
    scattered = -np.expm1(-beam.scattering_depth)
    place = np.log(np.sqrt(apart2 + size2[:, None])) - math.log(radii[0])
    place = np.clip(place / math.log(radii[1] / radii[0]), 0.0, len(radii) - 1.0)
    column = place.astype(np.int64)
    low = spots.rows[row[:, None], column] * (1.0 - weight[:, None])
    low += spots.rows[row[:, None] + 1, column] * weight[:, None]
    sharp = (1.0 - scattered) * rad_per_px**2 / (2.0 * math.pi * size2)
    gauss = np.exp(-0.5 * apart2 / size2[:, None]) * sharp[:, None]
    return ((low * scattered[:, None] + gauss) * beam.light_w_m2[:, None]).sum(axis=1)


def flash_shape(
    profiles: Array,
    around_e: float,
    radii_px: Array,
    background_px: float,
    scale: SensorScale,
    index: int,
    pixel: Array,
    beam: Beam,
    camera: Camera,
) -> FlashShape:
    """Box and contrast of a flash.

    Args:
        profiles: (3, k) its light in electrons per pixel at `radii_px`: ahead, back, across.
        around_e: light of the other lamps there, electrons per pixel.
        radii_px: (k,).
        background_px: radius at which the detector sees background.
        scale: from electrons to codes.
        index: its place among the candidates.
        pixel: (2,) the lamp on the sensor.
        beam: gives the direction in the image.
        camera: the camera.
    """
    codes = np.minimum(scale.codes(profiles + around_e), 255.0)
    log_r = np.log(radii_px)
    edge = np.array([np.interp(math.log(background_px), log_r, line) for line in codes])
    # The detector's background is the darkest part of a window about the spot.
    background = float(edge.min())
    peak = float(codes[:, 0].max())
    half = background + 0.5 * (peak - background)
    reach = [float(radii_px[np.argmax(line < half)]) if (line < half).any() else background_px for line in codes]
    ahead, back, across = (min(r, 1.5 * background_px) for r in reach)
    near = beam.ray_camera + 0.01 * beam.along_camera
    way = camera.project(near[None, :])[0] - pixel
    way = way / max(float(np.linalg.norm(way)), 1e-9)
    half_along = 0.5 * (ahead + back)
    half_px = np.hypot(half_along * way, across * way[::-1])
    return FlashShape(Flash(index, half_px, 0.5 * (ahead - back) * way), peak - background, background)


def measured_light(lit: LitScene, spots: Spots, seen: Candidates, exposure_s: float) -> tuple[Array, Array]:
    """What a detector measures as the flux of lights (m,), and its standard deviation by noise (m,), both in e/s.

    As `perception.flux`: light of the brightest channel within a disc of 12 mrad, over the mean of a ring from 1.4 to 2
    radii. The other lights' halos count as they would there, by their curvature across the disc alone.
    """
    radii, rings = lit.spots.radii_px, lit.spots.ring_px2
    disc_px = max(_DISC_RAD / lit.lens.rad_per_px, _MIN_DISC_PX)
    area = math.pi * disc_px**2
    inner = rings * (radii < disc_px)
    inner *= area / inner.sum()
    around = rings * ((radii > 1.4 * disc_px) & (radii < 2.0 * disc_px))
    if around.sum() == 0.0:
        around = rings * (np.abs(radii - 1.7 * disc_px) == np.abs(radii - 1.7 * disc_px).min())
    around *= area / around.sum()
    channel = spots.channel.max(axis=1)
    level = spots.profile @ (inner - around) * channel
    total_e = spots.profile @ (inner + around) * channel * exposure_s
    ring_px2 = math.pi * disc_px**2 * (2.0**2 - 1.4**2)
    noise = np.sqrt(total_e + lit.cfg.read_noise_e**2 * area * (1.0 + area / ring_px2)) / exposure_s
    return np.maximum(level, 0.0), noise
