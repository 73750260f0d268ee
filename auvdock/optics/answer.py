"""A detector's answer to the lights of one frame, compiled: what it tells apart, finds and sees besides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import BLUE, HALF_SCORE_SNR, RED
from auvdock.numeric.records import Record, Records
from auvdock.optics.meeting import Candidate

__all__ = ["Answer", "DetectionLaw", "Ghosts", "add_ghosts", "answer", "count_veiled", "merge"]

_LEAST_DN = 1e-3
_VEILED_DN = 50.0
_GHOST_PX = 2.0
"""Half side of the box about haze."""


@dataclass(frozen=True)
class DetectionLaw(Record):
    """`DetectionModelCfg` as compiled code takes it; its docstrings say what the numbers are."""

    contrast_50_dn: float
    surround_factor: float
    slope: float
    ceiling: float
    centre_at_100: float
    centre_floor_px: float
    score_gain: float
    wrong_colour: float
    flash_50_dn: float
    """Contrast at which half of a rotating beacon's flashes are found."""
    flash_slope: float
    merge_px: float
    merge_radii: float


class Answer(NamedTuple):
    """What a detector finds, brightest first.

    Attributes:
        centre: (k, 2) pixels.
        xyxy: (k, 4) boxes.
        score: (k,) between 0 and 1.
        class_id: (k,) `BLUE` or `RED`.
    """

    centre: Array
    xyxy: Array
    score: Array
    class_id: IntArray


class Ghosts(NamedTuple):
    """Detections that belong to no light.

    Attributes:
        at: (g,) light about which each lies.
        shift: (g, 2) from there in px.
        score: (g,).
        class_id: (g,).
    """

    at: IntArray
    shift: Array
    score: Array
    class_id: IntArray


@compiled
def answer(
    lights: Records[Candidate], distance2: Array, law: Records[DetectionLaw], chance: Array, noise: Array, flash: int
) -> tuple[Array, Array, Array, IntArray, IntArray, int]:
    """Which lights (m,) the detector finds, and where.

    Args:
        lights: on the sensor.
        distance2: (m, m) squared distances between them in px².
        law: one row, the detector.
        chance: (2, m) even draws, for finding a light and for its colour.
        noise: (m, 2) normal draws, for its centre.
        flash: the rotating beacon's place among the lights, -1 for none.

    Returns:
        Those found as the four parts of `Answer`, where each is among the lights (k,), and how many lights are veiled.
    """
    merged = lights.copy()
    merge(merged, distance2, law)
    found = _find(merged, law[0], chance[0], flash)
    count = len(found)
    centre, xyxy = np.empty((count, 2)), np.empty((count, 4))
    score, class_id = np.empty(count), np.empty(count, dtype=np.int64)
    for k in range(count):
        light = merged[found[k]]
        at_100_px = light.width_px * law[0].centre_at_100
        sigma = math.hypot(at_100_px * 1e4 / light.contrast_dn**2, law[0].centre_floor_px)
        half = max(light.radius_px, light.width_px)
        for axis in range(2):
            centre[k, axis] = light.pixel[axis] + sigma * noise[found[k], axis]
            xyxy[k, axis], xyxy[k, 2 + axis] = centre[k, axis] - half, centre[k, axis] + half
        snr = law[0].score_gain * light.contrast_dn / light.noise_dn
        score[k] = snr / (snr + HALF_SCORE_SNR)
        class_id[k] = RED if light.red != (chance[1, found[k]] < law[0].wrong_colour) else BLUE
    return centre, xyxy, score, class_id, found, count_veiled(lights)


@compiled
def count_veiled(lights: Records[Candidate]) -> int:
    """How many lights have surroundings that outshine their contrast by 50 codes or more."""
    count = 0
    for i in range(len(lights)):
        if lights[i].surround_dn > lights[i].contrast_dn + _VEILED_DN:
            count += 1
    return count


@compiled
def merge(lights: Records[Candidate], distance2: Array, law: Records[DetectionLaw]) -> None:
    """Make one of those lights (m,) that are too near (m, m) to be told apart, in place, as `merge_close` says."""
    count = len(lights)
    lead = np.arange(count)
    alone = True
    for i in range(count):
        for j in range(i + 1, count):
            limit = law[0].merge_px + law[0].merge_radii * (lights[i].radius_px + lights[j].radius_px)
            shown = lights[i].contrast_dn > 0.0 and lights[j].contrast_dn > 0.0
            if distance2[i, j] < limit * limit and shown and lead[i] != lead[j]:
                alone = False
                kept, gone = min(lead[i], lead[j]), max(lead[i], lead[j])
                for k in range(count):
                    if lead[k] == gone:
                        lead[k] = kept
    if not alone:
        for group in range(count):
            _join(lights, lead, group)


@compiled
def _join(lights: Records[Candidate], lead: IntArray, group: int) -> None:
    """Put the lights of a group into the brightest of them."""
    first, members = -1, 0
    for k in range(len(lights)):
        if lead[k] == group:
            members += 1
            if first < 0 or lights[k].flux > lights[first].flux:
                first = k
    if members < 2:
        return
    x = y = weight = square = 0.0
    for k in range(len(lights)):
        if lead[k] == group:
            flux, pixel = lights[k].flux, lights[k].pixel
            x, y, weight = x + flux * pixel[0], y + flux * pixel[1], weight + flux
            square += lights[k].radius_px * lights[k].radius_px
            if k != first:
                lights[k].contrast_dn = 0.0
    pixel = lights[first].pixel
    pixel[0], pixel[1] = x / weight, y / weight
    lights[first].flux, lights[first].radius_px = weight, math.sqrt(square)


@compiled
def _find(lights: Records[Candidate], law: DetectionLaw, chance: Array, flash: int) -> IntArray:
    """(k,) which lights (m,) are found, brightest first."""
    found, count = np.empty(len(lights), dtype=np.int64), 0
    for i in range(len(lights)):
        contrast = lights[i].contrast_dn
        if contrast <= _LEAST_DN:
            continue
        odds = ((law.contrast_50_dn + law.surround_factor * lights[i].surround_dn) / contrast) ** law.slope
        if i == flash:
            odds = (law.flash_50_dn / contrast) ** law.flash_slope
        if (1.0 + odds) * chance[i] >= law.ceiling:
            continue
        place = count
        while place > 0 and lights[found[place - 1]].contrast_dn < contrast:
            found[place] = found[place - 1]
            place -= 1
        found[place] = i
        count += 1
    return found[:count]


@compiled
def add_ghosts(found: Answer, ghosts: Ghosts, lights: Records[Candidate], width_px: int, height_px: int) -> Answer:
    """What is found (k,) and behind it ghosts (g,), kept on the sensor."""
    real = len(found.score)
    count = real + len(ghosts.at)
    centre, xyxy = np.empty((count, 2)), np.empty((count, 4))
    score, class_id = np.empty(count), np.empty(count, dtype=np.int64)
    centre[:real], xyxy[:real], score[:real], class_id[:real] = found.centre, found.xyxy, found.score, found.class_id
    score[real:], class_id[real:] = ghosts.score, ghosts.class_id
    for g in range(len(ghosts.at)):
        for axis in range(2):
            last = (width_px if axis == 0 else height_px) - 0.5
            place = min(max(lights[ghosts.at[g]].pixel[axis] + ghosts.shift[g, axis], -0.5), last)
            k = real + g
            centre[k, axis], xyxy[k, axis], xyxy[k, 2 + axis] = place, place - _GHOST_PX, place + _GHOST_PX
    return Answer(centre, xyxy, score, class_id)
