"""The threshold detector: brightness above background, connected components, centroids (paper A's baseline a).

The published baseline binarises globally. Haze and halo make that useless in turbid water, so the threshold here
stands on an estimate of background and noise; and since neighbouring lights grow together at a low level, each
component is cut again at higher levels until it stops falling apart.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections, Frame, RegionOfInterest
from auvdock.core.limits import Count, Positive
from auvdock.numeric.constants import HALF_SCORE_SNR
from auvdock.perception.components import components
from auvdock.perception.flux import DISC_RAD, spot_flux
from auvdock.perception.spots import background, brightest_channel, crop_of, inside, light_class, noise_sigma

__all__ = ["ThresholdCfg", "ThresholdDetector"]

_MAX_DEPTH = 6
_CUTS = (0.1, 0.2, 0.35, 0.5, 0.75, 0.9)
"""Levels between floor and peak at which a component is cut again; the low ones free a dim light by a bright one."""
_LARGE_PX = 300
"""A box smaller than this holds no second, dimmer light: the low levels are left out."""


@dataclass(frozen=True)
class ThresholdCfg(Checked):
    """Settings of the threshold detector."""

    noise_factor: Positive = 6.0
    """Threshold above the background in σ of the noise."""
    min_contrast: Positive = 8.0
    """Threshold above the background in grey levels, at least."""
    min_area_px: Count = 3
    """Smaller components are noise."""
    background_px: Count = 40
    """What is broader than this is background; more than the largest core, less than the spacing of the lights matters
    little."""
    max_lights: Count = 32
    """Only the components of greatest contrast are kept."""
    flux: bool = False
    """Measure each light's flux as well."""
    flux_disc_rad: Positive = DISC_RAD
    """Radius of the disc in which it is measured: a lone, blurred light asks for more, close neighbours for less."""


@dataclass(frozen=True)
class _Spot:
    left: int
    top: int
    right: int
    bottom: int
    u: float
    v: float
    peak: float


class ThresholdDetector:
    """Finds bright spots."""

    def __init__(self, cfg: ThresholdCfg | None = None) -> None:
        """Keep the settings."""
        self._cfg = cfg or ThresholdCfg()

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame, or only in the given regions when there are any.

        A light's centre is the centroid, weighted by brightness above the level at which it was cut out, of the part
        brighter than half of its peak. Score = s / (s + 10) with s the peak above background over the noise.
        """
        found = self._find(frame, regions)
        if not self._cfg.flux:
            return found
        return dataclasses.replace(found, flux=spot_flux(frame, found.centre_px, self._cfg.flux_disc_rad))

    def _find(self, frame: Frame, regions: Sequence[RegionOfInterest]) -> Detections:
        if not regions:
            return self._detect(frame.image, 0, 0)
        height, width = frame.image.shape[:2]
        parts: list[Detections] = []
        for region in regions:
            left, top, right, bottom = crop_of(region, height, width)
            if right - left >= 16 and bottom - top >= 16:
                found = self._detect(np.ascontiguousarray(frame.image[top:bottom, left:right]), left, top)
                parts.append(inside(found, (region,)))
        parts = [part for part in parts if len(part)]
        if not parts:
            return Detections.empty()
        return inside(
            Detections(
                np.vstack([part.xyxy for part in parts]),
                np.vstack([part.centre_px for part in parts]),
                np.concatenate([part.score for part in parts]),
                np.concatenate([part.class_id for part in parts]),
            ),
            regions,
        )

    def _detect(self, image: Image, left: int, top: int) -> Detections:
        cfg = self._cfg
        level = brightest_channel(image)
        sigma = noise_sigma(level)
        contrast = np.asarray(cv2.subtract(level, background(level, cfg.background_px)), dtype=np.uint8)
        threshold = max(cfg.min_contrast, cfg.noise_factor * sigma)
        spots: list[_Spot] = []
        for x, y, w, h, _ in self._components(contrast, threshold):
            self._split(contrast[y : y + h, x : x + w], threshold, x, y, 3.0 * sigma, spots)
        if not spots:
            return Detections.empty()
        spots.sort(key=lambda spot: (-spot.peak, spot.v, spot.u))
        spots = spots[: cfg.max_lights]
        boxes = np.array([[s.left, s.top, s.right, s.bottom] for s in spots], dtype=np.float64)
        centres = np.array([[s.u, s.v] for s in spots])
        snr = np.array([s.peak for s in spots]) / sigma
        classes = np.array([light_class(image, s.left, s.top, s.right, s.bottom) for s in spots], dtype=np.int64)
        offset = np.array([left, top], dtype=np.float64)
        return Detections(boxes + np.tile(offset, 2) - 0.5, centres + offset, snr / (snr + HALF_SCORE_SNR), classes)

    def _components(self, contrast: Image, threshold: float) -> list[tuple[int, int, int, int, int]]:
        """(x, y, width, height, area) of the components above a threshold."""
        found = components(contrast, threshold)
        too_large = contrast.size + 1
        if len(found) > 2000:
            # A threshold drowned in noise: keep the largest, the rest is no light.
            found = found[np.argsort(-found["area"], kind="stable")[:2000]]
            too_large = contrast.size / 2
        return [box for box in found.tolist() if self._cfg.min_area_px <= box[4] < too_large]

    def _split(
        self, patch: Image, floor: float, x: int, y: int, prominence: float, spots: list[_Spot], depth: int = 0
    ) -> None:
        """Cut a component at higher levels; where it falls apart go on with its parts, else take it as one light."""
        peak = float(patch.max())
        if depth < _MAX_DEPTH and patch.size >= 36:
            for fraction in _CUTS if patch.size >= _LARGE_PX else _CUTS[-3:]:
                level = floor + fraction * (peak - floor)
                if peak - level <= prominence:
                    break
                parts = [
                    (px, py, w, h)
                    for px, py, w, h, _ in self._components(patch, level)
                    if float(patch[py : py + h, px : px + w].max()) > level + prominence
                ]
                if len(parts) > 1:
                    for px, py, w, h in parts:
                        self._split(
                            patch[py : py + h, px : px + w], level, x + px, y + py, prominence, spots, depth + 1
                        )
                    return
        spots.append(_measure(patch, floor, peak, x, y))


def _measure(patch: Image, floor: float, peak: float, x: int, y: int) -> _Spot:
    """Centroid of the part brighter than half-way from the floor to the peak."""
    level = floor + 0.5 * (peak - floor)
    weight = np.maximum(patch.astype(np.float64) - level, 0.0)
    columns, rows = weight.sum(axis=0), weight.sum(axis=1)
    total = float(columns.sum())
    lit_columns, lit_rows = np.flatnonzero(columns), np.flatnonzero(rows)
    return _Spot(
        left=x + int(lit_columns[0]),
        top=y + int(lit_rows[0]),
        right=x + int(lit_columns[-1]) + 1,
        bottom=y + int(lit_rows[-1]) + 1,
        u=x + float(columns @ np.arange(len(columns))) / total,
        v=y + float(rows @ np.arange(len(rows))) / total,
        peak=peak,
    )
