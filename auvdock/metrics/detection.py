"""How well a detector finds what is labelled: average precision, recall, and the distance of centres."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.errors import AuvdockError
from auvdock.perception.suppression import SuppressionCfg

__all__ = ["AveragePrecision", "Found", "Matches", "Truth", "average_precision", "match_centres", "need_evaluator"]

_MOST = 100


class Truth(NamedTuple):
    """Labels of a picture: boxes (n, 4), keypoints (n, 2), and which (n,) do not count."""

    xyxy: Array
    centre_px: Array
    ignored: BoolArray


class Found(NamedTuple):
    """What a detector says of a picture: boxes (m, 4), keypoints (m, 2) and scores (m,)."""

    xyxy: Array
    centre_px: Array
    score: Array


@dataclass(frozen=True)
class AveragePrecision:
    """As COCO's evaluator gives it; 0 to 1."""

    box_50: float
    """AP of boxes at IoU 0.5."""
    box: float
    """Mean over IoU 0.5, 0.55 ... 0.95."""
    keypoint_50: float
    """AP of keypoints at OKS 0.5: k such that keypoints half a box's side apart have it (`perception.suppression`)."""


class Matches(NamedTuple):
    """Labels that count, and what was found of them."""

    found: BoolArray
    """(n,)."""
    error_px: Array
    """(n,) distance of the centres; NaN where it was not found."""
    false_alarms: int
    """What is near no label, ignored ones included."""


def need_evaluator() -> None:
    """Tell in one line what to install where COCO's evaluator is missing.

    Raises:
        AuvdockError: it cannot be imported.
    """
    try:
        import_module("pycocotools")
    except ImportError as error:
        remedy = "pip install pycocotools"
        raise AuvdockError(
            f"average precision needs COCO's evaluator, which is not here ({error}); {remedy}"
        ) from error


def average_precision(truth: Sequence[Truth], found: Sequence[Found]) -> AveragePrecision:
    """AP over all pictures, of one class, by COCO's own evaluator (Lin et al. 2014).

    Args:
        truth: of each picture.
        found: of each picture, in the same order; all scores, the least ones too.

    Raises:
        AuvdockError: the evaluator is not installed.
    """
    need_evaluator()
    coco: Any = import_module("pycocotools.coco")
    cocoeval: Any = import_module("pycocotools.cocoeval")
    images = [{"id": k + 1} for k in range(len(truth))]
    annotations = [note for k, item in enumerate(truth) for note in _annotations(k + 1, item)]
    for number, note in enumerate(annotations, 1):
        note["id"] = number
    results = [note for k, item in enumerate(found) for note in _results(k + 1, item)]
    if not results:
        return AveragePrecision(0.0, 0.0, 0.0)
    with redirect_stdout(io.StringIO()):
        labels = coco.COCO()
        labels.dataset = {"images": images, "annotations": annotations, "categories": [{"id": 1, "name": "light"}]}
        labels.createIndex()
        said = labels.loadRes(results)
        boxes, points = (cocoeval.COCOeval(labels, said, kind) for kind in ("bbox", "keypoints"))
        boxes.params.maxDets = points.params.maxDets = [_MOST]
        points.params.kpt_oks_sigmas = np.array([SuppressionCfg.keypoint_constant / 2.0])
        for evaluation in (boxes, points):
            evaluation.params.areaRng, evaluation.params.areaRngLbl = [[0.0, 1e10]], ["all"]
            evaluation.evaluate()
            evaluation.accumulate()
    precision = boxes.eval["precision"]
    return AveragePrecision(_mean(precision[0]), _mean(precision), _mean(points.eval["precision"][0]))


def match_centres(truth: Truth, found: Found, min_score: float) -> Matches:
    """Give each detection, the surest first, the nearest label that is free and at most half a box's side away.

    Args:
        truth: of a picture.
        found: of the same.
        min_score: less sure ones are left out.
    """
    side = np.sqrt(np.prod(truth.xyxy[:, 2:] - truth.xyxy[:, :2], axis=1))
    error = np.full(len(truth.ignored), math.nan)
    false_alarms = 0
    for row in np.argsort(-found.score, kind="stable"):
        if found.score[row] < min_score:
            break
        distance = np.linalg.norm(truth.centre_px - found.centre_px[row], axis=1)
        near = distance <= side / 2.0
        free = np.flatnonzero(near & ~truth.ignored & np.isnan(error))
        if len(free):
            best = free[np.argmin(distance[free])]
            error[best] = distance[best]
        elif not (near & truth.ignored).any():
            false_alarms += 1
    counting = ~truth.ignored
    return Matches(~np.isnan(error[counting]), error[counting], false_alarms)


def _annotations(image_id: int, truth: Truth) -> list[dict[str, Any]]:
    notes: list[dict[str, Any]] = []
    for box, centre, ignored in zip(truth.xyxy, truth.centre_px, truth.ignored, strict=True):
        bbox = [*box[:2].tolist(), *(box[2:] - box[:2]).tolist()]
        note = {"image_id": image_id, "category_id": 1, "bbox": bbox, "area": bbox[2] * bbox[3]}
        notes.append({**note, "iscrowd": int(ignored), "keypoints": [*centre.tolist(), 2], "num_keypoints": 1})
    return notes


def _results(image_id: int, found: Found) -> list[dict[str, Any]]:
    results: list[dict[str, Any]] = []
    for box, centre, score in zip(found.xyxy, found.centre_px, found.score, strict=True):
        bbox = [*box[:2].tolist(), *(box[2:] - box[:2]).tolist()]
        note = {"image_id": image_id, "category_id": 1, "bbox": bbox, "keypoints": [*centre.tolist(), 2]}
        results.append({**note, "score": float(score)})
    return results


def _mean(precision: Array) -> float:
    """Over what there is; −1 stands for nothing to find."""
    there = precision[precision >= 0.0]
    return float(there.mean()) if there.size else 0.0
