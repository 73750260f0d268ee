"""The blob detector: OpenCV's SimpleBlobDetector on the brightest channel (paper A's baseline b)."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np

from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections, Frame, RegionOfInterest
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative, Positive, at_least, at_most
from auvdock.numeric.constants import HALF_SCORE_SNR
from auvdock.perception.flux import spot_flux
from auvdock.perception.spots import brightest_channel, inside, light_class, noise_sigma

__all__ = ["BlobCfg", "BlobDetector"]


@dataclass(frozen=True)
class BlobCfg(Checked):
    """Settings of the blob detector."""

    min_threshold: NotNegative = 30.0
    """First grey level at which the image is cut."""
    max_threshold: Annotated[float, at_most(255.0)] = 255.0
    """Last grey level."""
    threshold_step: Annotated[float, at_least(1.0)] = 15.0
    """Step between levels."""
    min_area_px: Positive = 4.0
    """Smaller blobs are noise."""
    max_area_px: float = 2000.0
    """Larger blobs are haze."""
    min_circularity: float = 0.6
    """4π area / perimeter²."""
    min_convexity: float = 0.8
    """Area over the area of the convex hull."""
    min_distance_px: float = 4.0
    """Blobs closer than this are one."""
    max_lights: int = 32
    """Only the brightest blobs are kept."""
    flux: bool = False
    """Measure each light's flux as well."""

    def __post_init__(self) -> None:
        """Refuse empty ranges."""
        if self.min_threshold >= self.max_threshold:
            raise ConfigError("min_threshold", self.min_threshold, "less than max_threshold")
        if self.min_area_px >= self.max_area_px:
            raise ConfigError("min_area_px", self.min_area_px, "less than max_area_px")


class BlobDetector:
    """Finds round bright blobs that persist over several grey levels."""

    def __init__(self, cfg: BlobCfg | None = None) -> None:
        """Set OpenCV's detector up."""
        self._cfg = cfg = cfg or BlobCfg()
        params = cv2.SimpleBlobDetector.Params()
        params.minThreshold, params.maxThreshold = cfg.min_threshold, cfg.max_threshold
        params.thresholdStep = cfg.threshold_step
        params.minRepeatability = 2
        params.minDistBetweenBlobs = cfg.min_distance_px
        params.filterByColor, params.blobColor = True, 255
        params.filterByArea, params.minArea, params.maxArea = True, cfg.min_area_px, cfg.max_area_px
        params.filterByCircularity, params.minCircularity = True, cfg.min_circularity
        params.filterByConvexity, params.minConvexity = True, cfg.min_convexity
        params.filterByInertia = False
        self._detector = cv2.SimpleBlobDetector.create(params)

    def __reduce__(self) -> tuple[type[BlobDetector], tuple[BlobCfg]]:
        """OpenCV's part cannot be copied or pickled: it is made anew."""
        return BlobDetector, (self._cfg,)

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """Detect in the whole frame; with regions, keep what lies in them.

        Score = s / (s + 10) with s the brightness at the centre above its surroundings over the noise.
        """
        found = self._find(frame, regions)
        if not self._cfg.flux:
            return found
        return dataclasses.replace(found, flux=spot_flux(frame, found.centre_px))

    def _find(self, frame: Frame, regions: Sequence[RegionOfInterest]) -> Detections:
        level = brightest_channel(frame.image)
        keypoints = self._detector.detect(level)
        if not keypoints:
            return Detections.empty()
        sigma = noise_sigma(level)
        height, width = level.shape
        rows: list[tuple[float, float, float, float, float, float, float, int]] = []
        for keypoint in keypoints:
            u, v = keypoint.pt
            radius = max(keypoint.size / 2.0, 1.0)
            reach = int(np.ceil(radius)) + 3
            left, top = max(int(u) - reach, 0), max(int(v) - reach, 0)
            right, bottom = min(int(u) + reach + 1, width), min(int(v) + reach + 1, height)
            patch = level[top:bottom, left:right]
            contrast = float(patch.max()) - float(np.percentile(patch, 10))
            snr = contrast / sigma
            class_id = light_class(frame.image, left + 3, top + 3, max(right - 3, left + 4), max(bottom - 3, top + 4))
            score = snr / (snr + HALF_SCORE_SNR)
            rows.append((u - radius, v - radius, u + radius, v + radius, u, v, score, class_id))
        rows.sort(key=lambda row: (-row[6], row[5], row[4]))
        table = np.array(rows[: self._cfg.max_lights])
        found = Detections(table[:, :4], table[:, 4:6], table[:, 6], table[:, 7].astype(np.int64))
        return inside(found, regions) if regions else found
