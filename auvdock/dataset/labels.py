"""What a label says, and the classes that labels are of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from auvdock.core.arrays import Array, Image
from auvdock.numeric.constants import BLUE, RED

__all__ = ["CLASSES", "TAG", "Label", "LabelledFrame", "Reason", "clipped", "shown_share"]

TAG = 2
"""Class id of an AprilTag; lights are of `BLUE` or `RED`, as everywhere."""
CLASSES = {BLUE: "blue", RED: "red", TAG: "tag"}
"""Names of the classes."""

Reason = Literal["", "dim", "mirror", "stranger", "edge"]
"""Why a label is ignored, neither positive nor negative; nothing for one that counts."""


@dataclass(frozen=True)
class Label:
    """One thing in a frame; pixel centres have integer coordinates.

    Attributes:
        class_id: one of `CLASSES`.
        xyxy: left, upper, right and lower border of its box, within the image.
        centre_px: its keypoint: where the lamp's light is centred, or the middle of the tag.
        ignored: why it does not count; "" if it does.
        lamps: names of the lamps that are one box, the owner first; "tag" of a tag.
        range_m: distance of the owner.
        c_range: its attenuation lengths c · range, at the light's own wavelength.
        snr: contrast of its peak over the noise of a pixel.
        side_px: longer side of the box before floor, cap and the image's border.
        corners_px: (4, 2) a tag's corners, as `TagDetection.corners_px`; nothing for a light.
    """

    class_id: int
    xyxy: tuple[float, float, float, float]
    centre_px: tuple[float, float]
    ignored: Reason
    lamps: tuple[str, ...]
    range_m: float
    c_range: float
    snr: float
    side_px: float
    corners_px: tuple[tuple[float, float], ...] = ()

    @property
    def visibility(self) -> int:
        """As COCO's keypoints have it: 2 is visible, 1 there but not to be relied on."""
        return 1 if self.ignored else 2


@dataclass(frozen=True, eq=False)
class LabelledFrame:
    """A frame, what is in it and how it came about.

    Attributes:
        image: (H, W, 3) uint8, RGB.
        labels: what is in it.
        facts: kind of scene, water, c · range and the like; plain data.
    """

    image: Image
    labels: tuple[Label, ...]
    facts: dict[str, Any]


def clipped(xyxy: Array, width_px: int, height_px: int) -> Array:
    """Boxes (..., 4) cut at the borders of an image."""
    high = np.array([width_px, height_px, width_px, height_px]) - 0.5
    cut: Array = np.clip(xyxy, -0.5, high)
    return cut


def shown_share(xyxy: Array, width_px: int, height_px: int) -> float:
    """Share of a box (4,) that lies within an image."""
    cut = clipped(xyxy, width_px, height_px)
    whole = (xyxy[2] - xyxy[0]) * (xyxy[3] - xyxy[1])
    return float((cut[2] - cut[0]) * (cut[3] - cut[1]) / max(float(whole), 1e-9))
