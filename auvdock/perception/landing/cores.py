"""The detector of near lights: cores, found from the brightest level downwards.

A light a few metres off is a saturated disc in a halo that is wider than the gap to its neighbour. Its core stands out
all the same, in the mean of the colour channels, of which the lamp's own saturates long before the others: cut just
below the peak, every light is a component of its own. The cuts then go down; a component that holds no light found
above is a further, dimmer one. The lights of a landing station are equals, so what
is much dimmer than the brightest is none of them: a lit tag, a glint, the platform's edge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import cv2
import numpy as np

from auvdock.core.arrays import Array, Image, IntArray
from auvdock.core.checked import Checked
from auvdock.core.contracts import BLUE, RED, Detections, Frame, RegionOfInterest
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, OpenShare, at_least
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import HALF_SCORE_SNR
from auvdock.perception.components import components_and_peaks
from auvdock.perception.spots import inside, mean_channel, noise_sigma

__all__ = ["CoreCfg", "CoreDetector"]

_HALO_PX = 12
_BORDER_PX = 4


@dataclass(frozen=True)
class CoreCfg(Checked):
    """Settings of the core detector; ours."""

    levels: tuple[OpenShare, ...] = (0.97, 0.92, 0.86, 0.79, 0.71, 0.62, 0.53)
    """Cuts, as shares of the brightest code above the median; the last is how dim a light may be beside the
    brightest."""
    prominence: OpenShare = 0.06
    """How far a light's peak stands above the cut at which it comes off its neighbours, as the same share."""
    min_contrast: Annotated[float, at_least(1.0)] = 12.0
    """An image whose brightest code is less above its median holds no light, nor one less than eight σ of the noise."""
    min_area_px: Count = 1
    """Smaller components, at half the resolution, are noise."""
    max_aspect: Annotated[float, at_least(1.0)] = 1.8
    """A component longer than this times its width is two lights grown together, or none."""
    max_lights: Count = 16
    """Only the brightest components are kept."""

    def __post_init__(self) -> None:
        """Refuse cuts that do not fall."""
        if not self.levels or any(a <= b for a, b in pairwise(self.levels)):
            raise ConfigError("levels", self.levels, "falling shares between 0 and 1")


class CoreDetector:
    """Finds the cores of near lights."""

    def __init__(self, cfg: CoreCfg | None = None) -> None:
        """Keep the settings."""
        self._cfg = cfg or CoreCfg()

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame; of that, only what lies in the given regions when there are any.

        A light's centre is the centroid, weighted by brightness, of its core and of what little of the halo closes
        around it; its box is that of the core at the cut at which it was found. Cores cut off by the image's edge have
        no centre and are left out. Score = s / (s + 10) with s the peak above the median over the noise.
        """
        found = self._detect(frame.image)
        return inside(found, regions) if regions else found

    def _detect(self, image: Image) -> Detections:
        cfg = self._cfg
        half = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        small = mean_channel(np.asarray(half, dtype=np.uint8))
        base, peak = _median(small[::2, ::2], 0), float(small.max())
        sigma = noise_sigma(small)
        if peak - base < max(cfg.min_contrast, 8.0 * sigma):
            return Detections.empty()
        left, top, right, bottom = _bounds(small, base + cfg.levels[-1] * (peak - base))
        height, width = small.shape
        small = np.ascontiguousarray(small[top:bottom, left:right])
        # One pixel of each component that was taken: at a lower cut the rest of it is where that is.
        taken: list[tuple[int, int]] = []
        boxes: list[Array] = []
        centres: list[Array] = []
        peaks: list[float] = []
        for share in cfg.levels:
            cut = base + share * (peak - base)
            marks = np.array(taken, dtype=np.int64).reshape(-1, 2)
            found = (records.tolist() for records in components_and_peaks(small, cut, marks))
            for (x, y, w, h, area), (highest, column, row, old) in zip(*found, strict=True):
                if old or area < cfg.min_area_px:
                    continue
                if share < cfg.levels[0] and highest - cut < cfg.prominence * (peak - base):
                    continue
                taken.append((column, row))
                x, y = x + left, y + top
                cut_off = x == 0 or y == 0 or x + w == width or y + h == height
                if cut_off or max(w, h) > cfg.max_aspect * min(w, h) + 2.0:
                    continue
                box = np.array([x, y, x + w, y + h]) * 2
                centres.append(_centre(image, box, cut))
                boxes.append(box - 0.5)
                peaks.append(highest - base)
            if len(peaks) >= cfg.max_lights:
                break
        return _detections(image, boxes, centres, np.array(peaks) / sigma, cfg.max_lights)


def _bounds(level: Image, cut: float) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) of what is above a cut, two pixels wider."""
    _, mask = cv2.threshold(level, cut, 255, cv2.THRESH_BINARY)
    x, y, w, h = cv2.boundingRect(mask)
    return max(x - 2, 0), max(y - 2, 0), x + w + 2, y + h + 2


def _centre(image: Image, box: IntArray, cut: float) -> Array:
    """(2,) centroid of what closes within a box and a border of a few pixels, or at least of what is above the cut."""
    x0, y0, x1, y1 = box.tolist()
    x0, y0 = max(x0 - _BORDER_PX, 0), max(y0 - _BORDER_PX, 0)
    column, row = _centroid(mean_channel(image[y0 : y1 + _BORDER_PX, x0 : x1 + _BORDER_PX]), cut)
    if math.isnan(column):
        return 0.5 * (box[:2] + box[2:] - 1).astype(np.float64)
    return np.array([x0 + column, y0 + row])


@compiled
def _centroid(patch: Image, cut: float) -> tuple[float, float]:
    """Column and row of the centroid of what closes within a patch, or at least of what is above the cut; or nan."""
    rim = max(patch[0].max(), patch[-1].max(), patch[:, 0].max(), patch[:, -1].max())
    ground = min(float(rim), cut)
    total = column = row = 0.0
    for y in range(patch.shape[0]):
        for x in range(patch.shape[1]):
            weight = max(patch[y, x] - ground, 0.0)
            total += weight
            column += weight * x
            row += weight * y
    return column / total, row / total


def _median(image: Image, channel: int) -> float:
    """Median of one channel of an image of 8 bits, from its histogram."""
    counts = cv2.calcHist([image], [channel], None, [256], [0.0, 256.0]).ravel()
    total = np.cumsum(counts)
    size = image.shape[0] * image.shape[1]
    low, high = np.searchsorted(total, [(size + 1) // 2, size // 2 + 1]).tolist()
    return 0.5 * (low + high)


def _class(patch: Image, ground: Array) -> int:
    """Whether there is more red or more blue in a patch than in the image as a whole."""
    red, _, blue, _ = cv2.mean(patch)
    return RED if red - ground[0] > blue - ground[2] else BLUE


def _detections(image: Image, boxes: list[Array], centres: list[Array], snr: Array, most: int) -> Detections:
    if not boxes:
        return Detections.empty()
    order: IntArray = np.argsort(-snr, kind="stable")[:most]
    xyxy = np.array(boxes)[order]
    # A core is white; the colour is in the halo around it.
    rim = (xyxy[:, 2:] - xyxy[:, :2]).max(axis=1, keepdims=True) + _HALO_PX
    around = np.maximum(np.hstack([xyxy[:, :2] - rim, xyxy[:, 2:] + rim]).round().astype(int), 0)
    loose = np.ascontiguousarray(image[::8, ::8])
    ground = np.array([_median(loose, channel) for channel in range(3)])
    classes = np.array([_class(image[y0:y1, x0:x1], ground) for x0, y0, x1, y1 in around.tolist()], dtype=np.int64)
    strength = snr[order]
    return Detections(xyxy, np.array(centres)[order], strength / (strength + HALF_SCORE_SNR), classes)
