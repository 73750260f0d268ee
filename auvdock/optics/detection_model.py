"""How a detector answers to lights: found or missed, merged, how precisely, and what it sees that is not there.

The parameters are fitted on rendered frames (`optics.detection_fit`), one file per detector in `assets/detection`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from auvdock.assets import asset
from auvdock.core.arrays import Array, BoolArray
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections
from auvdock.core.limits import NotNegative, Positive, Share
from auvdock.core.strict import load_toml
from auvdock.optics.detection_loop import drawn, merge, with_ghosts
from auvdock.optics.light_loop import close, crowded, veiled

__all__ = [
    "Candidates",
    "DetectionModelCfg",
    "Flash",
    "FlashModelCfg",
    "draw_among",
    "draw_detections",
    "load_detection_model",
    "merge_close",
    "veiled_share",
]

_HAZE_PX = 20.0
_GHOST_FLUX = 0.3
"""Flux of haze that breaks into spots, over that of the dimmest light (ours)."""


@dataclass(frozen=True)
class FlashModelCfg(Checked):
    """Behaviour of a detector towards a rotating beacon: a light whose halo and beam decide about size and shape.

    Found with probability 1 / (1 + (C_50 / C)^slope), C the code of its peak above the code at `background_px`. The
    defaults were fitted to the threshold detector on 720 rendered frames: "pool", "clear" and "lake", night and
    "mild" daylight, 6 to 50 m, the beam up to 45° off.
    """

    contrast_50_dn: Positive = 8.6
    """Contrast at which half of the flashes are found."""
    slope: Positive = 13.0
    """Steepness in ln C."""
    background_px: Positive = 25.0
    """What is broader than this the detector takes for background."""
    floor_dn: Positive = 8.0
    """Contrast above which it sees light at all: the box is about what is brighter than half-way from there to the
    peak."""
    box_scale: Positive = 1.0
    """Size of the box over the size of the part that is brighter than half of the peak."""
    centre_shift: NotNegative = 0.65
    """Shift of the centre along the beam over the shift of the box's middle."""
    centre_spread: NotNegative = 0.06
    """Standard deviation of the centre per axis over the box's mean half side, at a contrast of ten times the noise."""
    flux_spread: NotNegative = 0.015
    """Standard deviation of ln(flux), beyond shot noise."""


_FLASH = FlashModelCfg()


@dataclass(frozen=True)
class DetectionModelCfg(Checked):
    """Behaviour of one detector.

    A light is found with probability ceiling / (1 + (C_50 / C)^slope), C its contrast in codes above its surroundings,
    C_50 = contrast_50_dn + surround_factor × the surroundings' code: a bright neighbourhood hides lights.
    """

    name: str
    """The detector."""
    source: str
    """What it was fitted on."""
    contrast_50_dn: Positive
    """Contrast at which half of the lights are found in dark surroundings."""
    surround_factor: NotNegative
    """Rise of that contrast per code of the surroundings."""
    slope: Positive
    """Steepness in ln C."""
    ceiling: Share
    """Probability of finding a light of any contrast."""
    merge_px: NotNegative
    """Two point-like lights closer than this are one."""
    merge_radii: NotNegative
    """In addition this many times the sum of the radii of their saturated discs."""
    centre_floor_px: NotNegative
    """Standard deviation of a bright light's centre, per axis."""
    centre_at_100: NotNegative
    """In addition this many widths of the spot at a contrast of 100; falls with the square of contrast, for a dim light
    has noise as well as the slope of its neighbours' halos against it."""
    score_gain: Positive
    """Score = s / (s + 10) with s this times contrast over noise."""
    false_alarms: NotNegative
    """Mean number of detections per frame that belong to no light when all lights are veiled: haze that breaks into
    spots. It falls with the share of lights that are; see `veiled_share`."""
    wrong_colour: Share
    """Share of detections of the wrong class."""
    flash: FlashModelCfg | None = None
    """Towards a rotating beacon; None: the defaults of `FlashModelCfg`."""

    @cached_property
    def numbers(self) -> Array:
        """(12,) what compiled code takes: finding (4), measuring (4), finding a rotating beacon (2), merging (2)."""
        ways = self.flash or _FLASH
        found = self.contrast_50_dn, self.surround_factor, self.slope, self.ceiling
        measured = self.centre_at_100, self.centre_floor_px, self.score_gain, self.wrong_colour
        merged = self.merge_px, self.merge_radii
        return np.array([*found, *measured, ways.contrast_50_dn, ways.slope, *merged])


class Flash(NamedTuple):
    """The rotating beacon as a candidate.

    Attributes:
        place: index among the candidates.
        half_px: (2,) half sides of the box about the part brighter than half of the peak.
        shift_px: (2,) from the lamp to the middle of that box.
    """

    place: int
    half_px: Array
    shift_px: Array


class Candidates(NamedTuple):
    """Lights on the sensor as a detector meets them.

    Attributes:
        pixels: (m, 2) positions.
        levels: (6, m) code at the centre above the code of its surroundings, in the light's brightest channel; code of
            those surroundings; standard deviation of the code there; radius of the saturated disc in px, 0 without one;
            width of the spot in px; weight of the light in a merged centre. Each row has a name of its own, too.
        distance2_px2: (m, m) squared distances between them.
        red: (m,) whether red is its brightest channel: class `RED` (1), else `BLUE` (0).
        flash: the rotating beacon among them, None if it is not in view.
        light_e_s: (m,) what a detector measures as flux, photo-electrons per second; None without a rotating beacon.
        light_noise_e_s: (m,) its standard deviation by shot and read noise.
    """

    pixels: Array
    levels: Array
    distance2_px2: Array
    red: BoolArray
    flash: Flash | None = None
    light_e_s: Array | None = None
    light_noise_e_s: Array | None = None

    @property
    def contrast_dn(self) -> Array:
        """(m,) code at the centre above that of the surroundings."""
        return self.levels[0]

    @property
    def surround_dn(self) -> Array:
        """(m,) code of the surroundings."""
        return self.levels[1]

    @property
    def noise_dn(self) -> Array:
        """(m,) standard deviation of the code at the centre."""
        return self.levels[2]

    @property
    def radius_px(self) -> Array:
        """(m,) radius of the saturated disc."""
        return self.levels[3]

    @property
    def width_px(self) -> Array:
        """(m,) width of the spot."""
        return self.levels[4]

    @property
    def flux(self) -> Array:
        """(m,) weight in a merged centre."""
        return self.levels[5]


def load_detection_model(name: str) -> DetectionModelCfg:
    """The fitted model of a detector.

    Raises:
        ConfigError: no model was fitted for a detector of that name.
    """
    return load_toml(DetectionModelCfg, asset("detection", name))


def draw_detections(
    seen: Candidates, model: DetectionModelCfg, size_px: tuple[int, int], rng: np.random.Generator
) -> Detections:
    """What the detector gives for one frame; brightest first, so that the order tells nothing of the layout.

    Args:
        seen: the lights on the sensor.
        model: the detector.
        size_px: width and height of the image.
        rng: source of the draws.
    """
    counts = crowded(seen.levels, seen.distance2_px2, model.numbers)
    return draw_among(seen, counts, model, size_px, rng)


def draw_among(
    seen: Candidates,
    counts: tuple[int, bool],
    model: DetectionModelCfg,
    size_px: tuple[int, int],
    rng: np.random.Generator,
) -> Detections:
    """As `draw_detections`, where it is known how many lights are veiled and whether any two are too close."""
    (hidden, near), m = counts, len(seen.pixels)
    chance, noise = rng.random((2, m)), rng.standard_normal((m, 2))
    rate = model.false_alarms * hidden / max(m, 1)
    alarms = rng.poisson(rate) if rate > 0.0 else 0
    merged = merge_close(seen, model) if near else seen
    flash, ways = seen.flash, model.flash or _FLASH
    index, centre, xyxy, score, class_id = drawn(
        merged.pixels,
        merged.levels,
        merged.red,
        noise,
        chance,
        flash.place if flash is not None else -1,
        model.numbers,
    )
    if flash is not None and flash.place in index:
        place = int(np.flatnonzero(index == flash.place)[0])
        half = np.maximum(0.5 * (xyxy[place, 2:] - xyxy[place, :2]), ways.box_scale * flash.half_px)
        noise_over_contrast = 10.0 * float(merged.noise_dn[flash.place] / merged.contrast_dn[flash.place])
        spread_px = ways.centre_spread * noise_over_contrast * float(half.mean())
        centre[place] += ways.centre_shift * flash.shift_px + spread_px * rng.standard_normal(2)
        xyxy[place, :2], xyxy[place, 2:] = centre[place] - half, centre[place] + half
    flux = None
    if merged.light_e_s is not None and merged.light_noise_e_s is not None:
        draws = rng.standard_normal((2, len(index)))
        light = merged.light_e_s[index] * np.exp(ways.flux_spread * draws[0])
        flux = np.maximum(light + merged.light_noise_e_s[index] * draws[1], 0.0)
    if alarms:
        # About the lights whose haze they are.
        at, shift = rng.integers(0, m, alarms), rng.normal(0.0, _HAZE_PX, (alarms, 2))
        looks, kinds = rng.uniform(0.2, 0.5, alarms), rng.integers(0, 2, alarms)
        centre, xyxy, score, class_id = with_ghosts(
            centre, xyxy, score, class_id, seen.pixels, at, shift, looks, kinds, *size_px
        )
        if flux is not None:
            flux = np.concatenate([flux, np.full(alarms, _GHOST_FLUX * (float(flux.min()) if len(flux) else 1.0))])
    return Detections(xyxy, centre, score, class_id, flux)


def veiled_share(seen: Candidates) -> float:
    """Share of lights whose surroundings outshine their contrast by 50 codes or more."""
    return veiled(seen.levels) / max(len(seen.pixels), 1)


def merge_close(seen: Candidates, model: DetectionModelCfg) -> Candidates:
    """Lights too close to be told apart become the brightest of them, at their common centre of light.

    Lights that have been merged into another keep their place with contrast 0.
    """
    pixels, levels = seen.pixels.copy(), seen.levels.copy()
    merge(pixels, levels, close(seen.distance2_px2, seen.radius_px, model.numbers))
    return seen._replace(pixels=pixels, levels=levels)
