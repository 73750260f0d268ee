"""Fits a detection model to a detector on rendered frames."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment, minimize

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.core.contracts import Detections, Detector
from auvdock.numeric.constants import HALF_SCORE_SNR
from auvdock.numeric.records import Records
from auvdock.optics.detection_model import Candidates, DetectionModelCfg, merge_close, veiled_share
from auvdock.optics.flash import FlashOptics
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.meeting import Candidate
from auvdock.optics.sensing import meet

__all__ = ["Observation", "fit_detection_model", "observe"]

_NEAR_PX = 3.0
_BRIGHT_DN = 150.0
_EDGE_PX = 12.0


@dataclass(frozen=True, eq=False)
class Observation:
    """One frame: the lights that are there and what the detector gave.

    Attributes:
        seen: the lights on the sensor.
        found: the detector's answer.
        size_px: width and height of the image.
    """

    seen: Candidates
    found: Detections
    size_px: tuple[int, int]


def observe(
    imager: UnderwaterCamera, detector: Detector, poses: Iterable[Array], rng: np.random.Generator
) -> list[Observation]:
    """Render one frame at each body pose (4, 4), with fresh noise and settled exposure, and run the detector on it."""
    observations: list[Observation] = []
    size = (imager.lit.camera.width_px, imager.lit.camera.height_px)
    flash = FlashOptics(imager.lit)
    for pose in poses:
        imager.reset(rng.spawn(1)[0])
        shot = imager.take(pose, 0.0)
        spots = flash.spots(shot.view)
        seen, _ = meet(imager.lit, shot.view, spots, shot.exposure_s, shot.gain)
        observations.append(Observation(seen, detector.detect(shot.frame), size))
    return observations


def fit_detection_model(name: str, source: str, observations: list[Observation]) -> DetectionModelCfg:
    """The model that explains the observations best.

    Merging first: the two lengths that tell best which pairs of bright lights were told apart. Then, on lights merged
    so, the detection curve by maximum likelihood, the spread of the centres, the scores, and what matches no light.

    Args:
        name: of the detector.
        source: what the observations are, for the record.
        observations: a few hundred frames that cover the ranges and waters of interest.
    """
    merge_px, merge_radii = _fit_merging(observations)
    merging = DetectionModelCfg(name, source, 1.0, 0.0, 1.0, 1.0, merge_px, merge_radii, 0.0, 0.0, 1.0, 0.0, 0.0)
    contrast: list[Array] = []
    around: list[Array] = []
    hits: list[BoolArray] = []
    errors: list[Array] = []
    blur: list[Array] = []
    gains: list[Array] = []
    wrong: list[BoolArray] = []
    alarms = 0
    for item in observations:
        lights = merge_close(item.seen, merging).lights
        match = _match(lights, item.found)
        present = lights["contrast_dn"] > 0.5
        hit = match >= 0
        contrast.append(lights["contrast_dn"][present])
        around.append(lights["surround_dn"][present])
        hits.append(hit[present])
        good = hit & present
        partner = match[good]
        snr = lights["contrast_dn"][good] / lights["noise_dn"][good]
        errors.append(item.found.centre_px[partner] - lights["pixel"][good])
        blur.append(lights["width_px"][good] * (100.0 / lights["contrast_dn"][good]) ** 2)
        score = np.clip(item.found.score[partner], 0.0, 0.999)
        gains.append(HALF_SCORE_SNR * score / (1.0 - score) / snr)
        wrong.append((item.found.class_id[partner] == 1) != lights["red"][good])
        alarms += _unexplained(item)
    c50, factor, slope, ceiling = _fit_curve(np.concatenate(contrast), np.concatenate(around), np.concatenate(hits))
    floor, noise = _fit_spread(np.concatenate(errors), np.concatenate(blur))
    gain = np.concatenate(gains)
    return DetectionModelCfg(
        name=name,
        source=source,
        contrast_50_dn=c50,
        surround_factor=factor,
        slope=slope,
        ceiling=ceiling,
        merge_px=merge_px,
        merge_radii=merge_radii,
        centre_floor_px=floor,
        centre_at_100=noise,
        score_gain=float(np.median(gain)) if len(gain) else 1.0,
        false_alarms=alarms / max(float(sum(veiled_share(item.seen) for item in observations)), 1.0),
        wrong_colour=float(np.mean(np.concatenate(wrong))) if len(gain) else 0.0,
    )


def _match(lights: Records[Candidate], found: Detections) -> IntArray:
    """Index (m,) of the detection that belongs to each light, -1 for none; one to one, nearest overall."""
    match = np.full(len(lights), -1, dtype=np.int64)
    if len(found) == 0 or len(match) == 0:
        return match
    distance = np.linalg.norm(lights["pixel"][:, None, :] - found.centre_px[None, :, :], axis=2)
    allowed = (_NEAR_PX + lights["radius_px"])[:, None]
    cost = np.where((distance < allowed) & (lights["contrast_dn"] > 0.5)[:, None], distance, 1e6)
    rows, columns = linear_sum_assignment(cost)
    for row, column in zip(rows, columns, strict=True):
        if cost[row, column] < 1e6:
            match[row] = column
    return match


def _unexplained(item: Observation) -> int:
    """Number of detections far from every light; at the border, where halos of lights outside reach in, none count."""
    seen, centre = item.seen.lights, item.found.centre_px
    inner = np.all((centre > _EDGE_PX) & (centre < np.array(item.size_px) - 1.0 - _EDGE_PX), axis=1)
    distance = np.linalg.norm(seen["pixel"][:, None, :] - centre[None, :, :], axis=2)
    far = np.all(distance > (3.0 * _NEAR_PX + 2.0 * seen["radius_px"])[:, None], axis=0)
    return int(np.count_nonzero(inner & far))


def _fit_merging(observations: list[Observation]) -> tuple[float, float]:
    gap: list[float] = []
    radii: list[float] = []
    apart: list[bool] = []
    for item in observations:
        seen, found = item.seen.lights, item.found
        bright = np.flatnonzero(seen["contrast_dn"] > _BRIGHT_DN)
        if len(bright) < 2 or len(found) == 0:
            continue
        distance = np.linalg.norm(seen["pixel"][:, None, :] - found.centre_px[None, :, :], axis=2)
        nearest = distance.argmin(axis=1)
        for position, i in enumerate(bright):
            for j in bright[position + 1 :]:
                d = float(np.linalg.norm(seen["pixel"][i] - seen["pixel"][j]))
                if d > 40.0:
                    continue
                both = nearest[i] != nearest[j] and distance[i, nearest[i]] < 0.4 * d + 0.5
                gap.append(d)
                radii.append(float(seen["radius_px"][i] + seen["radius_px"][j]))
                apart.append(bool(both and distance[j, nearest[j]] < 0.4 * d + 0.5))
    if len(gap) < 10 or all(apart):
        return 2.0, 1.0
    d, r, truth = np.array(gap), np.array(radii), np.array(apart)
    best = (len(truth), 2.0, 1.0)
    # From what optics alone cannot part: cores within 2 px, and saturated discs that touch.
    for merge_px in np.arange(2.0, 12.1, 0.5):
        for merge_radii in np.arange(1.0, 2.01, 0.1):
            wrong = int(np.count_nonzero((d > merge_px + merge_radii * r) != truth))
            if wrong < best[0]:
                best = (wrong, float(merge_px), float(round(merge_radii, 3)))
    return best[1], best[2]


def _fit_curve(contrast: Array, around: Array, hit: BoolArray) -> tuple[float, float, float, float]:
    bright = contrast > _BRIGHT_DN
    ceiling = float(np.mean(hit[bright])) if np.count_nonzero(bright) > 20 else 1.0
    ceiling = min(max(ceiling, 0.05), 1.0)
    log_c = np.log(np.maximum(contrast, 1e-3))

    def cost(x: Array) -> float:
        log_50 = np.log(math.exp(x[0]) + math.exp(x[1]) * around)
        p = ceiling / (1.0 + np.exp(np.clip(-math.exp(x[2]) * (log_c - log_50), -60.0, 60.0)))
        p = np.clip(p, 1e-6, 1.0 - 1e-6)
        return -float(np.sum(np.where(hit, np.log(p), np.log(1.0 - p))))

    starts = [
        (math.log(c), math.log(f), math.log(s)) for c in (5.0, 20.0, 60.0) for f in (0.1, 1.0) for s in (3.0, 8.0)
    ]
    fits = [minimize(cost, np.array(start), method="Nelder-Mead", options={"maxiter": 600}) for start in starts]
    best = fits[int(np.argmin([float(fit.fun) for fit in fits]))].x
    return math.exp(float(best[0])), math.exp(float(best[1])), min(math.exp(float(best[2])), 30.0), ceiling


def _fit_spread(errors: Array, blur: Array) -> tuple[float, float]:
    """Floor and factor by maximum likelihood under a t distribution with 3 degrees of freedom: mismatches stay out."""
    if len(errors) < 20:
        return 0.1, 1.0
    square, blur2 = np.sum(errors**2, axis=1), blur**2

    def cost(x: Array) -> float:
        variance = math.exp(2.0 * x[0]) + math.exp(2.0 * x[1]) * blur2
        return float(np.sum(np.log(variance) + 2.5 * np.log1p(square / (3.0 * variance))))

    best = minimize(cost, np.array([math.log(0.05), math.log(0.1)]), method="Nelder-Mead")
    # Bright lights can fit with no floor at all; eight-bit codes still leave some thousandths of a pixel.
    return max(math.exp(float(best.x[0])), 0.005), math.exp(float(best.x[1]))
