"""The rotating beacon in the `beacons` fidelity: how large, how long and how bright its spot is, without an image.

The renderer's light, lamp and pieces of the beam, is evaluated on a line through the lamp along the beam's image. Where
it is brightest the spot has its middle; about that, it is evaluated ahead, back and across. In codes above those at the
radius that a detector takes for background, the points of half the peak give the box, and the peak the contrast.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.beam_pieces import BeamPieces
from auvdock.optics.detection_model import Candidates, Flash, FlashModelCfg
from auvdock.optics.scene import LitScene
from auvdock.optics.sensor import SensorScale
from auvdock.optics.spots import FlashLines, Spots
from auvdock.optics.view import Beam, View

__all__ = ["FlashOptics", "measured_light", "with_flash"]

_BLUR_PX = 1.3
"""What lens and the detector's smoothing leave of a cusp: the brightness at this radius."""
_LINE_PX = np.arange(-24.0, 72.5, 1.5)
"""Where the brightest point is looked for along the beam."""
_DISC_RAD = 0.012
_MIN_DISC_PX = 4.0


class FlashOptics:
    """Lamp and beam of a scene's rotating beacon as one spot."""

    def __init__(self, lit: LitScene) -> None:
        """Tabulate the halo of the pieces."""
        self._lit = lit
        self._pieces: BeamPieces | None = None
        if lit.rotating is not None:
            least_rad = 1.4 * lit.lens.factor * lit.lens.rad_per_px
            self._pieces = BeamPieces(lit.lights.halo, lit.rotating.halo_row, least_rad)

    def spots(self, view: View) -> Spots:
        """Profiles of the lights in view, the beam counted to its lamp."""
        spots = self._lit.spots.spread(view.arrivals, view.inside)
        rotating, beam, pieces = self._lit.rotating, view.beam, self._pieces
        if rotating is None or beam is None or pieces is None:
            return spots
        place = np.flatnonzero(spots.rows["lamp"] == rotating.lamp)
        if len(place) == 0:
            return spots
        flash = self._lines(spots, int(place[0]), beam, pieces)
        # As a spot among others: the mean of the four directions.
        profile, lines = spots.profile.copy(), flash.lines
        profile[flash.place] = 0.25 * (lines[0] + lines[1]) + 0.5 * lines[2]
        return spots._replace(profile=profile, flash=flash)

    def _lines(self, spots: Spots, k: int, beam: Beam, tables: BeamPieces) -> FlashLines:
        rad_per_px, radii = self._lit.lens.rad_per_px, self._lit.spots.radii_px
        pieces = tables.light(beam)
        gauss = pieces.blob + pieces.ribbon
        light = beam.light_w_m2 * rad_per_px**2
        phi_px = 0.5 * (beam.edge_rad[1:] + beam.edge_rad[:-1])[:, None] / rad_per_px
        log_radii, log_lamp = np.log(radii), np.log(np.maximum(spots.profile[k], 1e-300))

        def level(along_px: Array, across_px: Array, blur_px: float) -> Array:
            """Irradiance per pixel at offsets (n,) from the lamp."""
            across2 = across_px * across_px
            beside = light @ tables.per_sr(pieces, ((along_px - phi_px) ** 2 + across2) * rad_per_px**2, gauss)
            own2 = along_px * along_px + across2 + blur_px**2
            return beside + np.exp(np.interp(0.5 * np.log(own2), log_radii, log_lamp))

        middle = float(_LINE_PX[np.argmax(level(_LINE_PX, np.zeros_like(_LINE_PX), _BLUR_PX))])
        along = np.concatenate([middle + radii, middle - radii, np.full_like(radii, middle)])
        lines = level(along, np.concatenate([np.zeros(2 * len(radii)), radii]), 0.1).reshape(3, -1)
        ray, far = beam.ray_camera, beam.along_camera
        way = far[:2] * ray[2] - ray[:2] * far[2]
        way = way / max(math.hypot(float(way[0]), float(way[1])), 1e-9)
        return FlashLines(k, middle, way, lines)


def measured_light(lit: LitScene, spots: Spots, seen: Candidates, exposure_s: float) -> tuple[Array, Array]:
    """What a detector measures as the flux of lights (m,), and its standard deviation by noise (m,), both in e/s.

    As `perception.flux`: light of the brightest channel within a disc of 12 mrad, over the mean of a ring from 1.4 to 2
    radii. Of a saturated spot it extrapolates the halo and misses most of the core: 0.12 + 0.9 of the light beside the
    core remains, from a saturated radius of 2.5 px on (fitted on rendered frames to a fifth).
    """
    radii, rings = lit.spots.radii_px, lit.spots.ring_px2
    disc_px = max(_DISC_RAD / lit.lens.rad_per_px, _MIN_DISC_PX)
    area = math.pi * disc_px**2
    inner = rings * (radii < disc_px)
    inner *= area / inner.sum()
    around = rings * ((radii > 1.4 * disc_px) & (radii < 2.0 * disc_px))
    around *= area / around.sum()
    channel = spots.rows["channel"].max(axis=1)
    level = np.maximum(spots.profile @ (inner - around) * channel, 1e-30)
    total_e = spots.profile @ (inner + around) * channel * exposure_s
    ring_px2 = math.pi * disc_px**2 * (2.0**2 - 1.4**2)
    noise = np.sqrt(total_e + lit.setup.imaging.read_noise_e**2 * area * (1.0 + area / ring_px2)) / exposure_s
    beside = 1.0 - np.minimum(spots.rows["core_w_m2"] * channel / level, 1.0)
    burnt = np.clip((seen.lights["radius_px"] - 1.0) / 1.5, 0.0, 1.0)
    return level * np.minimum(0.12 + 0.9 * beside, 1.0) ** burnt, noise


def with_flash(
    lit: LitScene, spots: Spots, seen: Candidates, scale: SensorScale, exposure_s: float, ways: FlashModelCfg
) -> Candidates:
    """The lights with everyone's flux, and with the flash as the detector meets it.

    Args:
        lit: the scene.
        spots: profiles of the lights, from `FlashOptics.spots`.
        seen: the lights, each by itself.
        scale: from electrons to codes.
        exposure_s: exposure time.
        ways: how the detector meets a flash.
    """
    light, noise = measured_light(lit, spots, seen, exposure_s)
    lines = spots.flash
    if lines is None:
        return _with_flux(seen, light, noise)
    k = lines.place
    electrons_s = spots.rows["channel"].max(axis=1)
    # The others' light where the detector sees background: on a circle about the flash.
    others = lit.spots.level_at(spots, seen.distance2_px2 + ways.background_px**2)[k] * electrons_s
    around_e = float(others.sum() - others[k]) * exposure_s
    top = _top(lines, electrons_s[k] * exposure_s, around_e, lit.spots.radii_px, scale, ways)
    flash, contrast_dn, background_dn = top
    lights = seen.lights.copy()
    contrast, pixels = lights["contrast_dn"], lights["pixel"]
    # To a detector the flash and what lies within it are one light; so are a bright light and a flash within that.
    reach_px = np.maximum(float(np.mean(flash.half_px)), 2.0 * lights["radius_px"])
    part = seen.distance2_px2[k] < reach_px**2
    part[k] = True
    members = np.flatnonzero(part)
    lead = int(members[np.argmax(lights["flux"][members])])
    if lead == k or 2.0 * lights["surround_dn"][k] < contrast[k]:
        contrast[k] = contrast_dn
    else:
        # It stands on the slope of another's halo.
        contrast[k] = min(contrast_dn, float(contrast[k]))
    lights["surround_dn"][k] = background_dn
    weight = light[members]
    if len(members) > 1 and weight.sum() > 0.0:
        pixels[lead] = weight @ pixels[members] / weight.sum()
        light[lead] = weight.sum()
        contrast[members[members != lead]] = 0.0
        if contrast[lead] < contrast_dn:
            contrast[lead] = contrast_dn
            flash = flash._replace(place=lead)
    return _with_flux(seen._replace(lights=lights, flash=flash), light, noise)


def _with_flux(seen: Candidates, light_e_s: Array, noise_e_s: Array) -> Candidates:
    lights = seen.lights.copy()
    lights["light_e_s"], lights["light_noise_e_s"] = light_e_s, noise_e_s
    return seen._replace(lights=lights, measures_flux=True)


def _top(
    lines: FlashLines, electrons: float, around_e: float, radii_px: Array, scale: SensorScale, ways: FlashModelCfg
) -> tuple[Flash, float, float]:
    """The part of a flash that is brighter than half of its peak, its contrast and the code of its background."""
    codes = np.minimum(scale.codes(lines.lines * electrons + around_e), 255.0)
    log_r = np.log(radii_px)
    rim = [float(np.interp(math.log(ways.background_px), log_r, line)) for line in codes]
    background = 0.25 * (rim[0] + rim[1]) + 0.5 * rim[2]
    contrast = float(np.interp(math.log(_BLUR_PX), log_r, codes[2])) - background
    half = background + 0.5 * (contrast + ways.floor_dn)
    reach = [float(radii_px[np.argmax(line < half)]) if line[-1] < half else ways.background_px for line in codes]
    ahead, back, across = (min(r, 1.5 * ways.background_px) for r in reach)
    # Of a weak spot noise leaves the top alone (fitted on rendered frames).
    kept = math.sqrt(max(1.0 - ways.floor_dn / max(contrast, 1e-9), 0.01))
    half_px = kept * np.hypot(0.5 * (ahead + back) * lines.way, across * lines.way[::-1])
    shift_px = (lines.middle_px + 0.5 * (ahead - back)) * lines.way
    return Flash(lines.place, half_px, shift_px), contrast, background
