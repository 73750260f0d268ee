"""What training makes small: scores, boxes, the distributions of their sides, and keypoints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, cross_entropy

from auvdock.networks.assignment import Pairs, assign, overlaps
from auvdock.networks.head import Head, Level, expected_distance
from auvdock.networks.schedule import ScheduleCfg

__all__ = ["Losses", "Objects", "losses"]

_HALF_SIDE = 0.5 / math.sqrt(2.0 * math.log(2.0))
"""k of the keypoints' similarity: half of it is left half a box's side away, as in `perception.suppression`."""
_EDGE = 0.01


class Objects(NamedTuple):
    """`targets.Targets` as tensors."""

    picture: Tensor
    classes: Tensor
    xyxy: Tensor
    keypoints_px: Tensor
    ignored: Tensor


class Losses(NamedTuple):
    """Parts of the loss, each a mean that does not depend on how many objects there are, without their weights."""

    box: Tensor
    score: Tensor
    distribution: Tensor
    keypoint: Tensor

    def total(self, cfg: ScheduleCfg) -> Tensor:
        """Σ weight · part."""
        weights = cfg.loss
        return (
            weights.box * self.box
            + weights.score * self.score
            + weights.distribution * self.distribution
            + weights.keypoint * self.keypoint
        )


class _Cells(NamedTuple):
    """All levels' cells in one row."""

    sides: Tensor
    """(batch, cells, 4, bins) logarithms of distributions."""
    scores: Tensor
    """(batch, cells, classes) log-odds."""
    points: Tensor
    """(batch, cells, k, 3) raw."""
    corner: Tensor
    """(cells, 2) upper left corner of each cell, in cells of its level."""
    stride_px: Tensor
    """(cells, 1)."""


def losses(head: Head, levels: Sequence[Level], objects: Objects, cfg: ScheduleCfg) -> Losses:
    """Compare what the head says of a batch with what is there.

    - Scores: cross entropy against the assigned weights (`assignment.assign`); cells that touch an ignored object and
      learn no other are left out.
    - Boxes: 1 − CIoU (Zheng et al. 2020, arXiv 1911.08287).
    - Distributions: cross entropy of the two bins beside the true distance (Li et al. 2020, equation 6).
    - Keypoints: 1 − OKS + |Δ|₁/side. OKS alone is flat near 0, where a fix of a fraction of a pixel is won.

    Each is weighted by the pairs' weights and divided by their sum over the batch.

    Args:
        head: which said it.
        levels: what it said.
        objects: what is there.
        cfg: assignment.
    """
    cells = _flat(head, levels)
    middle = cells.corner + 0.5
    distance = expected_distance(cells.sides.flatten(0, 2)).reshape(cells.sides.shape[:3])
    boxes = torch.cat((middle - distance[..., :2], middle + distance[..., 2:]), 2) * cells.stride_px
    counting = ~objects.ignored
    wanted = Objects(*(values[counting] for values in objects))
    scores = cells.scores
    with torch.no_grad():
        where = assign(
            scores.sigmoid(),
            boxes,
            middle * cells.stride_px,
            wanted.picture,
            wanted.classes,
            wanted.xyxy,
            cfg.assignment,
        )
        aim = torch.zeros_like(scores)
        aim[where.picture, where.cell, wanted.classes[where.target]] = where.weight
        counts = _counting_cells(cells, objects, where)
        share = where.weight / where.weight.sum().clamp(min=1.0)
        whole = where.weight.sum().clamp(min=1.0)
    crossed = binary_cross_entropy_with_logits(scores, aim, reduction="none")
    score = (crossed * counts[..., None]).sum() / whole
    stride = cells.stride_px[where.cell]
    found, true = boxes[where.picture, where.cell], wanted.xyxy[where.target]
    box = (share * (1.0 - _complete_overlap(found, true))).sum()
    true_cells = true / stride
    ends = torch.cat((middle[where.cell] - true_cells[:, :2], true_cells[:, 2:] - middle[where.cell]), 1)
    distribution = (share * _distribution_loss(cells.sides[where.picture, where.cell], ends)).sum()
    raw = cells.points[where.picture, where.cell, :, :2]
    points = (2.0 * raw + cells.corner[where.cell][:, None]) * stride[:, None]
    keypoint = (share * _keypoint_loss(points, wanted.keypoints_px[where.target], true)).sum()
    return Losses(box, score, distribution, keypoint)


def _flat(head: Head, levels: Sequence[Level]) -> _Cells:
    parts: list[_Cells] = []
    for level, stride in zip(levels, head.strides_px, strict=True):
        batch, _, h, w = level.box.shape
        row, column = torch.meshgrid(torch.arange(h), torch.arange(w), indexing="ij")
        corner = torch.stack((column, row), 2).reshape(h * w, 2).to(level.box)
        sides = level.box.reshape(batch, 4, head.bins, h * w).permute(0, 3, 1, 2)
        scores = level.score.flatten(2).transpose(1, 2)
        points = level.keypoints.reshape(batch, level.keypoints.shape[1] // 3, 3, h * w).permute(0, 3, 1, 2)
        parts.append(_Cells(sides, scores, points, corner, corner.new_full((h * w, 1), float(stride))))
    batched = [torch.cat(values, 1) for values in list(zip(*parts, strict=True))[:3]]
    single = [torch.cat(values, 0) for values in list(zip(*parts, strict=True))[3:]]
    return _Cells(*batched, *single)


def _counting_cells(cells: _Cells, objects: Objects, where: Pairs) -> Tensor:
    """(batch, cells) 0 for cells that touch an ignored object and learn no other, else 1."""
    low, high = cells.corner * cells.stride_px, (cells.corner + 1.0) * cells.stride_px
    counts = cells.scores.new_ones(cells.scores.shape[:2])
    box = objects.xyxy[objects.ignored][:, None]
    touched = ((low < box[..., 2:]) & (high > box[..., :2])).all(2)
    row, cell = touched.nonzero(as_tuple=True)
    counts[objects.picture[objects.ignored][row], cell] = 0.0
    counts[where.picture, where.cell] = 1.0
    return counts


def _complete_overlap(a: Tensor, b: Tensor) -> Tensor:
    """CIoU (p,) = IoU − d²/c² − αv: d between the centres, c the diagonal of both, v how the shapes differ."""
    overlap = overlaps(a, b)
    hull = torch.maximum(a[:, 2:], b[:, 2:]) - torch.minimum(a[:, :2], b[:, :2])
    apart = (a[:, :2] + a[:, 2:] - b[:, :2] - b[:, 2:]) / 2.0
    size_a, size_b = (a[:, 2:] - a[:, :2]).clamp(min=1e-6), b[:, 2:] - b[:, :2]
    turn = torch.atan2(size_b[:, 0], size_b[:, 1]) - torch.atan2(size_a[:, 0], size_a[:, 1])
    shape = 4.0 / math.pi**2 * turn**2
    with torch.no_grad():
        alpha = shape / (1.0 - overlap + shape).clamp(min=1e-9)
    return overlap - (apart**2).sum(1) / (hull**2).sum(1).clamp(min=1e-9) - alpha * shape


def _distribution_loss(sides: Tensor, distance: Tensor) -> Tensor:
    """(p,) mean over sides (p, 4, bins) of the cross entropy with the bins beside the distances (p, 4), in cells."""
    bins = sides.shape[2]
    aim = distance.clamp(0.0, bins - 1 - _EDGE)
    below = aim.floor()
    flat, low = sides.flatten(0, 1), below.long().flatten()
    left = cross_entropy(flat, low, reduction="none").reshape(aim.shape)
    right = cross_entropy(flat, low + 1, reduction="none").reshape(aim.shape)
    return (left * (below + 1.0 - aim) + right * (aim - below)).mean(1)


def _keypoint_loss(found: Tensor, true: Tensor, xyxy: Tensor) -> Tensor:
    """(p,) of keypoints (p, k, 2); 0 without any."""
    if not found.shape[1]:
        return found.new_zeros(len(found))
    area = ((xyxy[:, 2] - xyxy[:, 0]) * (xyxy[:, 3] - xyxy[:, 1])).clamp(min=1.0)[:, None]
    off = found - true
    unlike = 1.0 - torch.exp(-(off**2).sum(2) / (2.0 * area * _HALF_SIDE**2))
    return (unlike + off.abs().sum(2) / area.sqrt()).mean(1)
