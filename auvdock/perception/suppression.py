"""One detection a light: suppression by overlap of boxes and by closeness of keypoints (paper B, section 3.2.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array, IntArray, check_shape
from auvdock.core.checked import Checked
from auvdock.core.limits import Positive, Share, above

__all__ = ["SuppressionCfg", "box_overlap", "keypoint_similarity", "suppress"]

_HALF_SIDE = 0.5 / math.sqrt(2.0 * math.log(2.0))


@dataclass(frozen=True)
class SuppressionCfg(Checked):
    """Thresholds of algorithm 1. Paper B gives λ_conf alone; the others are ours."""

    min_score: Share = 0.1
    """λ_conf: less sure detections are dropped."""
    max_overlap: Annotated[float, above(0.0)] = 0.5
    """λ_iou: of two boxes with this overlap or more the surer one stays; above 1 none is dropped for it."""
    max_similarity: Annotated[float, above(0.0)] = 0.5
    """λ_oks: of two detections whose keypoints are as similar or more the surer one stays; above 1 none is dropped."""
    keypoint_constant: Positive = _HALF_SIDE
    """k of equation 2: keypoints half a box's side √area apart have similarity 1/2. The trainers in wide use take k = 2
    for a single keypoint, where lights further apart than a box are still the same."""


def suppress(xyxy: Array, scores: Array, keypoints_px: Array, cfg: SuppressionCfg) -> IntArray:
    """Paper B's algorithm 1: take the surest, drop all that are too like it, and again.

    A detection stays iff its IoU and its OKS with each surer one that stays are below their thresholds. Halos give
    boxes of different size about one light, whose IoU is small and whose OKS is not.

    Args:
        xyxy: (n, 4) boxes, left, top, right, bottom, px; n may be 0.
        scores: (n,).
        keypoints_px: (n, k, 2); k may be 0, then overlap alone decides.
        cfg: thresholds.

    Returns:
        Rows (m,) of those that stay, surest first; of equally sure ones the first stays.
    """
    check_shape("xyxy", xyxy, (len(scores), 4))
    check_shape("keypoints_px", keypoints_px, (len(scores), None, 2))
    order = np.argsort(-scores, kind="stable")
    order = order[scores[order] >= cfg.min_score]
    kept: list[int] = []
    while len(order):
        surest, order = order[0], order[1:]
        kept.append(int(surest))
        like = box_overlap(xyxy[surest], xyxy[order]) >= cfg.max_overlap
        if keypoints_px.shape[1]:
            box = xyxy[surest]
            area_px2 = float((box[2] - box[0]) * (box[3] - box[1]))
            similarity = keypoint_similarity(keypoints_px[surest], keypoints_px[order], area_px2, cfg.keypoint_constant)
            like |= similarity >= cfg.max_similarity
        order = order[~like]
    return np.array(kept, dtype=np.int64)


def box_overlap(box: Array, boxes: Array) -> Array:
    """Intersection over union (n,) of a box (4,) with others (n, 4), all left, top, right, bottom; 0 for empty ones."""
    size = np.minimum(box[2:], boxes[:, 2:]) - np.maximum(box[:2], boxes[:, :2])
    shared = np.prod(np.maximum(size, 0.0), axis=1)
    union = np.prod(box[2:] - box[:2]) + np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) - shared
    return np.divide(shared, union, out=np.zeros_like(shared), where=union > 0.0)


def keypoint_similarity(points: Array, others: Array, area_px2: float, constant: float) -> Array:
    """OKS (n,): mean over keypoints of exp(-d² / (2 s² k²)), s² = area of the box (paper B, equation 2; COCO).

    Args:
        points: (k, 2) of the detection that stays, px.
        others: (n, k, 2).
        area_px2: of the box of the one that stays.
        constant: k of the equation, the same for each keypoint.
    """
    squared = np.sum((others - points) ** 2, axis=2)
    with np.errstate(over="ignore"):  # a box without area is like what lies on it alone
        return np.exp(-squared / np.maximum(2.0 * area_px2 * constant**2, np.finfo(float).tiny)).mean(axis=1)
