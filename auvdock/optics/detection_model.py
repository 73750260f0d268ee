"""How a detector answers to lights: found or missed, merged, how precisely, and what it sees that is not there.

The parameters are fitted on rendered frames (`optics.detection_fit`), one file per detector in `assets/detection`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from auvdock.assets import asset
from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections
from auvdock.core.limits import NotNegative, Positive, Share
from auvdock.core.strict import load_toml
from auvdock.numeric.records import Records
from auvdock.optics.answer import Answer, DetectionLaw, Ghosts, add_ghosts, answer, count_veiled, merge
from auvdock.optics.meeting import Candidate

__all__ = [
    "Candidates",
    "DetectionModelCfg",
    "Flash",
    "FlashModelCfg",
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
    def law(self) -> Records[DetectionLaw]:
        """What compiled code takes: one row."""
        ways = self.flash or _FLASH
        return DetectionLaw(
            self.contrast_50_dn,
            self.surround_factor,
            self.slope,
            self.ceiling,
            self.centre_at_100,
            self.centre_floor_px,
            self.score_gain,
            self.wrong_colour,
            ways.contrast_50_dn,
            ways.slope,
            self.merge_px,
            self.merge_radii,
        ).packed()


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
        lights: (m,) each of them.
        distance2_px2: (m, m) squared distances between them.
        flash: the rotating beacon among them, None if it is not in view.
        measures_flux: their flux is known, as it is beside a rotating beacon.
    """

    lights: Records[Candidate]
    distance2_px2: Array
    flash: Flash | None = None
    measures_flux: bool = False


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
    m, flash = len(seen.lights), seen.flash
    chance, noise = rng.random((2, m)), rng.standard_normal((m, 2))
    centre, xyxy, score, class_id, which, veiled = answer(
        seen.lights, seen.distance2_px2, model.law, chance, noise, -1 if flash is None else flash.place
    )
    rate = model.false_alarms * veiled / max(m, 1)
    alarms = rng.poisson(rate) if rate > 0.0 else 0
    ways = model.flash or _FLASH
    if flash is not None and flash.place in which:
        place, light = int(np.flatnonzero(which == flash.place)[0]), Candidate.read(seen.lights, flash.place)
        half = np.maximum(0.5 * (xyxy[place, 2:] - xyxy[place, :2]), ways.box_scale * flash.half_px)
        spread_px = ways.centre_spread * (10.0 * (light.noise_dn / light.contrast_dn)) * float(half.mean())
        centre[place] += ways.centre_shift * flash.shift_px + spread_px * rng.standard_normal(2)
        xyxy[place, :2], xyxy[place, 2:] = centre[place] - half, centre[place] + half
    flux = None
    if seen.measures_flux:
        draws = rng.standard_normal((2, len(which)))
        light_e_s = seen.lights["light_e_s"][which] * np.exp(ways.flux_spread * draws[0])
        flux = np.maximum(light_e_s + seen.lights["light_noise_e_s"][which] * draws[1], 0.0)
    if alarms:
        # About the lights whose haze they are.
        at, shift = rng.integers(0, m, alarms), rng.normal(0.0, _HAZE_PX, (alarms, 2))
        ghosts = Ghosts(at, shift, rng.uniform(0.2, 0.5, alarms), rng.integers(0, 2, alarms))
        found = Answer(centre, xyxy, score, class_id)
        centre, xyxy, score, class_id = add_ghosts(found, ghosts, seen.lights, *size_px)
        if flux is not None:
            flux = np.concatenate([flux, np.full(alarms, _GHOST_FLUX * (float(flux.min()) if len(flux) else 1.0))])
    return Detections(xyxy, centre, score, class_id, flux)


def veiled_share(seen: Candidates) -> float:
    """Share of lights whose surroundings outshine their contrast by 50 codes or more."""
    return count_veiled(seen.lights) / max(len(seen.lights), 1)


def merge_close(seen: Candidates, model: DetectionModelCfg) -> Candidates:
    """Lights too close to be told apart become the brightest of them, at their common centre of light.

    Lights that have been merged into another keep their place with contrast 0.
    """
    lights = seen.lights.copy()
    merge(lights, seen.distance2_px2, model.law)
    return seen._replace(lights=lights)
