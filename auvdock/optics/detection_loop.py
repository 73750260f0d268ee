"""A detector's answer to the lights of one frame, compiled: which are found, merged, and what it sees besides."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import BLUE, HALF_SCORE_SNR, RED

__all__ = ["drawn", "merge", "with_ghosts"]

_LEAST_DN = 1e-3


@compiled
def drawn(
    pixels: Array,
    levels: Array,
    red: BoolArray,
    noise: Array,
    chance: Array,
    flash: int,
    model: Array,
) -> tuple[IntArray, Array, Array, Array, IntArray]:
    """Which lights (k,) of m the detector finds, brightest first; their centres (k, 2), boxes (k, 4), scores, classes.

    `flash` is the rotating beacon's place, -1 for none; `model` is `DetectionModelCfg.numbers`.
    """
    contrast, surround, noise_dn, radius_px, width_px = levels[0], levels[1], levels[2], levels[3], levels[4]
    contrast_50, surround_factor, slope, ceiling = model[0], model[1], model[2], model[3]
    found, count = np.empty(len(contrast), dtype=np.int64), 0
    for i in range(len(contrast)):
        if contrast[i] <= _LEAST_DN:
            continue
        odds = ((contrast_50 + surround_factor * surround[i]) / contrast[i]) ** slope
        if i == flash:
            odds = (model[8] / contrast[i]) ** model[9]
        if (1.0 + odds) * chance[0, i] >= ceiling:
            continue
        place = count
        while place > 0 and contrast[found[place - 1]] < contrast[i]:
            found[place] = found[place - 1]
            place -= 1
        found[place] = i
        count += 1
    index = found[:count]
    centre_at_100, centre_floor_px, score_gain, wrong_colour = model[4], model[5], model[6], model[7]
    centre, xyxy = np.empty((count, 2)), np.empty((count, 4))
    score, class_id = np.empty(count), np.empty(count, dtype=np.int64)
    for k in range(count):
        i = index[k]
        spread = math.hypot(width_px[i] * centre_at_100 * 1e4 / contrast[i] ** 2, centre_floor_px)
        half = max(radius_px[i], width_px[i])
        for axis in range(2):
            centre[k, axis] = pixels[i, axis] + spread * noise[i, axis]
            xyxy[k, axis], xyxy[k, 2 + axis] = centre[k, axis] - half, centre[k, axis] + half
        snr = score_gain * contrast[i] / noise_dn[i]
        score[k] = snr / (snr + HALF_SCORE_SNR)
        class_id[k] = RED if red[i] != (chance[1, i] < wrong_colour) else BLUE
    return index, centre, xyxy, score, class_id


@compiled
def merge(pixels: Array, levels: Array, too_near: BoolArray) -> None:
    """`detection_model.merge_close` in place: places (m, 2), `Candidates.levels` (6, m), which are too close (m, m)."""
    count = len(pixels)
    lead = np.arange(count)
    for i in range(count):
        for j in range(i + 1, count):
            if too_near[i, j] and levels[0, i] > 0.0 and levels[0, j] > 0.0 and lead[i] != lead[j]:
                kept, gone = min(lead[i], lead[j]), max(lead[i], lead[j])
                for k in range(count):
                    if lead[k] == gone:
                        lead[k] = kept
    for group in range(count):
        first, members = -1, 0
        for k in range(count):
            if lead[k] == group:
                members += 1
                if first < 0 or levels[5, k] > levels[5, first]:
                    first = k
        if members < 2:
            continue
        x = y = weight = square = 0.0
        for k in range(count):
            if lead[k] == group:
                flux = levels[5, k]
                x, y, weight = x + flux * pixels[k, 0], y + flux * pixels[k, 1], weight + flux
                square += levels[3, k] * levels[3, k]
                if k != first:
                    levels[0, k] = 0.0
        pixels[first, 0], pixels[first, 1] = x / weight, y / weight
        levels[5, first], levels[3, first] = weight, math.sqrt(square)


@compiled
def with_ghosts(
    centre: Array,
    xyxy: Array,
    score: Array,
    class_id: IntArray,
    pixels: Array,
    at: IntArray,
    shift: Array,
    looks: Array,
    kinds: IntArray,
    width_px: int,
    height_px: int,
) -> tuple[Array, Array, Array, IntArray]:
    """Detections (k,) and behind them ghosts (g,) about the lights `at` of the frame's (m,), on the sensor."""
    real, count = len(score), len(score) + len(at)
    centres, boxes = np.empty((count, 2)), np.empty((count, 4))
    scores, classes = np.empty(count), np.empty(count, dtype=np.int64)
    for k in range(count):
        g = k - real
        scores[k] = score[k] if g < 0 else looks[g]
        classes[k] = class_id[k] if g < 0 else kinds[g]
        for axis in range(2):
            if g < 0:
                centres[k, axis] = centre[k, axis]
                boxes[k, axis], boxes[k, 2 + axis] = xyxy[k, axis], xyxy[k, 2 + axis]
                continue
            last = (width_px if axis == 0 else height_px) - 0.5
            place = min(max(pixels[at[g], axis] + shift[g, axis], -0.5), last)
            centres[k, axis], boxes[k, axis], boxes[k, 2 + axis] = place, place - 2.0, place + 2.0
    return centres, boxes, scores, classes
