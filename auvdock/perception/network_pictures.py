"""What goes into a detection network and what comes out of it, in this package's terms.

A network counts pixels from the picture's corner: the middle of the first one is (0.5, 0.5); here it is (0, 0).
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
from auvdock.perception.decoding import Candidates, read_candidates
from auvdock.perception.suppression import SuppressionCfg, suppress

__all__ = ["network_input", "network_objects"]

_CORNER = 0.5


def network_input(image: Image, stride_px: int) -> NDArray[np.float32]:
    """(1, 3, h, w) from 0 to 1 of a picture (H, W, 3): h and w are multiples of the stride.

    The last row and column are repeated to the right and below, so that nothing moves. Zeros there would be an edge,
    in which a network sees lights.
    """
    height, width = image.shape[:2]
    below, right = -height % stride_px, -width % stride_px
    padded = cv2.copyMakeBorder(image, 0, below, 0, right, cv2.BORDER_REPLICATE)
    blob = cv2.dnn.blobFromImage(padded, 1.0 / 255.0)
    return np.asarray(blob, dtype=np.float32)


def network_objects(
    found: Array, classes: int, size_px: tuple[int, int], cfg: SuppressionCfg, most: int | None = None
) -> Candidates:
    """One candidate an object, surest first; those whose middle lies outside the picture are left out.

    Args:
        found: (4 + classes + 3·k, cells), see `decoding.read_candidates`.
        classes: how many.
        size_px: width and height of the picture before it was padded.
        cfg: least score, and which candidates are one.
        most: candidates at most.
    """
    there = read_candidates(found, classes, cfg.min_score)
    kept = suppress(there.xyxy, there.scores, there.keypoints_px, cfg)
    xyxy, points = there.xyxy[kept] - _CORNER, there.keypoints_px[kept] - _CORNER
    middle = points[:, 0] if points.shape[1] else (xyxy[:, :2] + xyxy[:, 2:]) / 2.0
    high = np.array(size_px) - _CORNER
    inside = np.flatnonzero(((middle >= -_CORNER) & (middle <= high)).all(axis=1))[:most]
    box = np.clip(xyxy[inside], -_CORNER, np.tile(high, 2))
    return Candidates(box, there.scores[kept][inside], there.classes[kept][inside], points[inside])
