"""The detector of lamps as a real camera shows them: a pale core in a halo of the lamp's own colour.

An exposure that shows a lit station burns its lamps out: the lamp's own channel saturates tens of pixels about the
core, the others close to it, so that the core is white and the colour stands in a ring around it. What else is bright
(a funnel in daylight, a rim, a rope, a reflection) has no such ring. So a light is

1. a core: a spot of the mean channel above its grey opening, which leaves out whatever is wider than a core;
2. a hill of colour about it: on most rays away from the core, the excess of one channel over both others rises to a
   first summit and falls again, and the summits lie about equally far out; of a lamp too far away to burn out the
   summit is the core itself;
3. where several burn out, one of equals: neither core nor halo much weaker than the strongest; and none inside
   another's halo.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np

from auvdock.core.arrays import Array, Image, IntArray
from auvdock.core.checked import Checked
from auvdock.core.contracts import BLUE, RED, Detections, Frame, RegionOfInterest
from auvdock.core.limits import Count, Positive, Share, at_least
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import HALF_SCORE_SNR
from auvdock.perception.spots import inside, mean_channel, noise_sigma

__all__ = ["HaloCfg", "HaloDetector"]

_RAYS = 24
_SMOOTH_PX = 1.5
"""Of the cores at half resolution: a burnt-out core becomes a hill with one top."""
_HIGH = 3 * _RAYS // 4
"""Rank of the ray whose summit stands for all: a lamp on a white rim has colour on one side only."""
_WINDOW, _SHIFTS = 0.2, 5
"""A core's centroid is that of a Gaussian window of so many times the summits' distance, found in so many steps: what
is farther off may be a rim in daylight."""
_BURNT_PX = 2.0
"""A lamp whose summits lie so far out, at half resolution, has burnt out."""
_FALL = 0.7
"""Of its summit a hill must fall below this share to be one."""


@dataclass(frozen=True)
class HaloCfg(Checked):
    """Settings of the halo detector; ours. Lengths are in pixels of the image."""

    core_px: Annotated[int, at_least(6)] = 44
    """What is wider in every direction is no core."""
    halo_px: Annotated[int, at_least(6)] = 40
    """Farthest that a halo's colour is followed from the core."""
    min_contrast: Positive = 6.0
    """Codes of a core above its surroundings, and not less than six σ of the noise."""
    min_colour: Positive = 15.0
    """Codes by which the halo's channel exceeds both others at the summits."""
    spread: Positive = 0.2
    """Greatest standard deviation of the summits' distances, over their mean; one pixel of half the resolution more."""
    min_rays: Share = 0.5
    """Least share of the rays that have a summit half as high as the halo's."""
    equal: Share = 0.6
    """How weak a core may be beside the frame's strongest, and a halo beside the strongest of its colour, where two or
    more lamps of a colour burn out: what they light shines then as well. Lamps that do not may differ, as a ring and
    the far lamp above it do."""
    max_lights: Count = 32
    """Only the lights with the strongest cores are kept."""


class HaloDetector:
    """Finds pale cores in coloured halos."""

    def __init__(self, cfg: HaloCfg | None = None) -> None:
        """Keep the settings."""
        self._cfg = cfg or HaloCfg()
        self._kernel, self._narrow = (
            cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
            for side in (self._cfg.core_px // 2 | 1, self._cfg.core_px // 3 | 1)
        )
        angle = np.arange(_RAYS) * (2.0 * math.pi / _RAYS)
        self._ways = np.column_stack([np.cos(angle), np.sin(angle)])

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame; of that, only what lies in the given regions when there are any.

        A light's centre is the centroid of its core, by mean shift; its box has the core's size. Score =
        s / (s + 10) with s the core's height above its surroundings over the noise.
        """
        found = self._detect(frame.image)
        return inside(found, regions) if regions else found

    def _detect(self, image: Image) -> Detections:
        cfg = self._cfg
        half = np.asarray(cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        level = mean_channel(half)
        sigma = noise_sigma(level)
        smooth = cv2.GaussianBlur(level, (0, 0), _SMOOTH_PX)
        cores = np.asarray(cv2.morphologyEx(smooth, cv2.MORPH_TOPHAT, self._kernel), dtype=np.uint8)
        places = _tops(cores, max(cfg.min_contrast, 6.0 * sigma))
        if not len(places):
            return Detections.empty()
        height = cores[places[:, 1], places[:, 0]].astype(np.float64)
        hills = [_hills(_excess(half, k), places, self._ways, cfg.halo_px // 2, cfg.min_colour) for k in (BLUE, RED)]
        colour = np.column_stack([hill[:, 0] for hill in hills])
        kind: IntArray = colour.argmax(axis=1)
        summit, away, spread, rays = np.stack(hills)[kind, np.arange(len(places))].T
        good = (summit >= cfg.min_colour) & (rays >= cfg.min_rays) & (spread <= cfg.spread * away + 1.0)
        burnt = away >= _BURNT_PX
        for k in range(len(hills)):
            if np.count_nonzero(same := good & burnt & (kind == k)) > 1:
                good &= height >= cfg.equal * height[same].max()
                good &= (kind != k) | (summit >= cfg.equal * summit[same].max())
        if not good.any():
            return Detections.empty()
        chosen = _alone(places, spread / (away + 1.0), away, np.flatnonzero(good))
        chosen = chosen[np.argsort(-height[chosen], kind="stable")][: cfg.max_lights]
        sharp = np.asarray(cv2.morphologyEx(level, cv2.MORPH_TOPHAT, self._narrow), dtype=np.uint8)
        spots = _centroids(sharp, places[chosen], np.maximum(_WINDOW * away[chosen], 1.0))
        # Half-resolution pixel centres lie between those of the image.
        centre, radius = 2.0 * spots[:, :2] + 0.5, 2.0 * spots[:, 2:]
        strength = height[chosen] / sigma
        classes = np.where(kind[chosen] == 0, BLUE, RED)
        return Detections(
            np.hstack([centre - radius, centre + radius]), centre, strength / (strength + HALF_SCORE_SNR), classes
        )


def _excess(image: Image, kind: int) -> Image:
    """(h, w) codes by which the channel of a class of lights exceeds both others, lightly smoothed."""
    own, others = (2, (0, 1)) if kind == BLUE else (0, (1, 2))
    channels = cv2.split(image)
    excess = cv2.subtract(channels[own], cv2.max(channels[others[0]], channels[others[1]]))
    return np.asarray(cv2.GaussianBlur(excess, (0, 0), 1.0), dtype=np.uint8)


def _tops(level: Image, threshold: float) -> IntArray:
    """(n, 2) column and row of the highest pixel, of equals the first, within two pixels of itself."""
    highest = cv2.dilate(level, np.ones((5, 5), dtype=np.uint8))
    rows, columns = np.nonzero((level >= highest) & (level > threshold))
    return _first_of_each(np.column_stack([columns, rows]))


@compiled
def _first_of_each(places: IntArray) -> IntArray:
    """Places (n, 2) without those within two pixels of an earlier one: a level top counts once."""
    kept = np.empty_like(places)
    count = 0
    for i in range(len(places)):
        near = False
        for j in range(count):
            near |= abs(places[i, 0] - kept[j, 0]) <= 2 and abs(places[i, 1] - kept[j, 1]) <= 2
        if not near:
            kept[count] = places[i]
            count += 1
    return kept[:count]


@compiled
def _hills(excess: Image, places: IntArray, ways: Array, reach: int, floor: float) -> Array:
    """(n, 4) of the first hill of colour about each place, along rays.

    Height of the rays' summits, at their upper quartile; of the summits half as high, mean and standard deviation of
    their distances, and the share of the rays that have one.

    Args:
        excess: (h, w) codes.
        places: (n, 2) columns and rows.
        ways: (m, 2) unit vectors.
        reach: how far they are followed, px.
        floor: codes that a summit has at least.
    """
    out = np.zeros((len(places), 4))
    top, far = np.empty(len(ways)), np.empty(len(ways))
    for n in range(len(places)):
        for k in range(len(ways)):
            top[k], far[k] = 0.0, reach
            for r in range(reach + 1):
                x, y = round(places[n, 0] + r * ways[k, 0]), round(places[n, 1] + r * ways[k, 1])
                if x < 0 or y < 0 or x >= excess.shape[1] or y >= excess.shape[0]:
                    break
                if excess[y, x] > top[k]:
                    top[k], far[k] = excess[y, x], r
                elif top[k] >= floor and excess[y, x] < _FALL * top[k]:
                    break
        height = np.sort(top)[_HIGH]
        count, total, square = 0, 0.0, 0.0
        for k in range(len(ways)):
            if 2.0 * top[k] >= height >= floor:
                count, total, square = count + 1, total + far[k], square + far[k] * far[k]
        if count:
            mean = total / count
            out[n] = height, mean, math.sqrt(max(square / count - mean * mean, 0.0)), count / len(ways)
    return out


@compiled
def _alone(places: IntArray, unevenness: Array, away: Array, rows: IntArray) -> IntArray:
    """Of the rows (m,) those whose place lies in the halo of no other that has a more even one."""
    order = rows[np.argsort(unevenness[rows])]
    kept = np.empty_like(order)
    count = 0
    for i in order:
        clear = True
        for k in range(count):
            j = kept[k]
            gap = math.hypot(places[i, 0] - places[j, 0], places[i, 1] - places[j, 1])
            clear &= gap > 1.5 * away[j] + 1.0
        if clear:
            kept[count] = i
            count += 1
    return kept[:count]


@compiled
def _centroids(level: Image, places: IntArray, window: Array) -> Array:
    """(n, 3) column and row of the centroid about each place, and the radius of equal area of what is above half of it.

    Mean shift: what stands above 0.3 of the place's height is weighted by a Gaussian about the last centroid.

    Args:
        level: (h, w) cores above their surroundings.
        places: (n, 2) columns and rows.
        window: (n,) standard deviation of the Gaussian, px.
    """
    out = np.empty((len(places), 3))
    for n in range(len(places)):
        top = float(level[places[n, 1], places[n, 0]])
        x, y, area = float(places[n, 0]), float(places[n, 1]), 0
        reach = math.ceil(3.0 * window[n])
        for _ in range(_SHIFTS):
            total = column = row = 0.0
            area = 0
            left, upper = round(x), round(y)
            for v in range(max(upper - reach, 0), min(upper + reach + 1, level.shape[0])):
                for u in range(max(left - reach, 0), min(left + reach + 1, level.shape[1])):
                    weight = max(level[v, u] - 0.3 * top, 0.0)
                    weight *= math.exp(-0.5 * ((u - x) ** 2 + (v - y) ** 2) / window[n] ** 2)
                    total, column, row = total + weight, column + weight * u, row + weight * v
                    if level[v, u] > 0.5 * top:
                        area += 1
            if total <= 0.0:
                break
            x, y = column / total, row / total
        out[n] = x, y, math.sqrt(max(area, 1) / math.pi)
    return out
