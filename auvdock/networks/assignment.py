"""Which cells of the head learn which object: those that say it best (Feng et al. 2021, TOOD, arXiv 2108.07755)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from auvdock.networks.schedule import AssignmentCfg

__all__ = ["Pairs", "assign", "overlaps"]


class Pairs(NamedTuple):
    """Cells with the object that each learns."""

    picture: Tensor
    """(p,) of the batch."""
    cell: Tensor
    """(p,) of all levels."""
    target: Tensor
    """(p,) row of the object."""
    weight: Tensor
    """(p,) 0 to 1: the score that the cell shall give, and how much its box and keypoint count."""


def assign(
    scores: Tensor, boxes: Tensor, centres: Tensor, picture: Tensor, classes: Tensor, xyxy: Tensor, cfg: AssignmentCfg
) -> Pairs:
    """Give each object the cells of greatest t = s^α · u^β among those whose centre lies in its box.

    A cell that two objects want learns the one that it overlaps more. The weight is t over the object's greatest, times
    the greatest overlap of its cells.

    Args:
        scores: (batch, cells, classes), 0 to 1.
        boxes: (batch, cells, 4), left, top, right, bottom, px.
        centres: (cells, 2) px.
        picture: (n,) picture of each object.
        classes: (n,) its class.
        xyxy: (n, 4) its box, px.
        cfg: how many cells, α and β.
    """
    overlap = overlaps(xyxy[:, None], boxes[picture]).clamp(min=0.0)
    score = scores[picture, :, classes]
    fit = score**cfg.score_power * overlap**cfg.overlap_power
    inside = ((centres > xyxy[:, None, :2]) & (centres < xyxy[:, None, 2:])).all(2)
    best = torch.where(inside, fit, -1.0).topk(min(cfg.cells, fit.shape[1]), 1).indices
    chosen = torch.zeros_like(inside).scatter_(1, best, True) & inside
    # Of several objects that want one cell, the one of greatest overlap; of equal ones the first.
    wanted = torch.where(chosen, overlap, -1.0)
    greatest = wanted.new_full(scores.shape[:2], -1.0)
    greatest = greatest.scatter_reduce(0, picture[:, None].expand_as(wanted), wanted, "amax")
    chosen &= wanted == greatest[picture]
    top = torch.where(chosen, fit, 0.0).amax(1, keepdim=True).clamp(min=torch.finfo(fit.dtype).tiny)
    weight = fit / top * torch.where(chosen, overlap, 0.0).amax(1, keepdim=True)
    target, cell = chosen.nonzero(as_tuple=True)
    return Pairs(picture[target], cell, target, weight[target, cell])


def overlaps(a: Tensor, b: Tensor) -> Tensor:
    """Intersection over union (...,) of boxes (..., 4), left, top, right, bottom."""
    size = (torch.minimum(a[..., 2:], b[..., 2:]) - torch.maximum(a[..., :2], b[..., :2])).clamp(min=0.0)
    shared = size[..., 0] * size[..., 1]
    area_a = (a[..., 2] - a[..., 0]) * (a[..., 3] - a[..., 1])
    area_b = (b[..., 2] - b[..., 0]) * (b[..., 3] - b[..., 1])
    return shared / (area_a + area_b - shared).clamp(min=1e-9)
