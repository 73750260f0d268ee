"""The anchor-free head, and what it says as boxes, scores and keypoints in px."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

from auvdock.networks.config import HeadCfg
from auvdock.networks.conv import Conv
from auvdock.networks.rfa import RFAConv

__all__ = ["Head", "Level", "decode", "expected_distance"]


class Level(NamedTuple):
    """What the head says of each cell of one level, before it is decoded."""

    box: Tensor
    """(batch, 4·bins, h, w): left, top, right, bottom, a distribution's logarithm each."""
    score: Tensor
    """(batch, classes, h, w): log-odds."""
    keypoints: Tensor
    """(batch, 3·keypoints, h, w): x, y, log-odds of visibility, for each keypoint."""


class Head(nn.Module):
    """Three branches for each level, of two 3×3 convolutions and a 1×1 convolution (YOLOv8-pose; paper B, figure 6).

    Boxes are distributions of the distances from the cell's centre to the box's sides (Li et al. 2020, arXiv
    2006.04388, section 3.2); there are no anchors and no score of objectness (Ge et al. 2021, arXiv 2107.08430).

    Args:
        cfg: numbers of classes, keypoints and bins, and which convolutions.
        channels: of each level's features.
        strides_px: of each level.
    """

    def __init__(self, cfg: HeadCfg, channels: Sequence[int], strides_px: Sequence[int]) -> None:
        """Make the branches of all levels."""
        super().__init__()
        whole: Callable[[int, int], nn.Module] = _rfa if cfg.convolution == "RFAConv" else _conv
        light = whole if cfg.class_convolution == "full" else _separable
        finest = channels[0]
        box = max(16, finest // 4, 4 * cfg.bins)
        score = max(finest, min(cfg.classes, 100))
        point = max(finest // 4, 3 * cfg.keypoints)
        self.strides_px = tuple(strides_px)
        self.bins = cfg.bins
        self.box = nn.ModuleList(_branch(whole, c, box, 4 * cfg.bins) for c in channels)
        self.score = nn.ModuleList(_branch(light, c, score, cfg.classes) for c in channels)
        self.keypoints = nn.ModuleList(_branch(whole, c, point, 3 * cfg.keypoints) for c in channels if cfg.keypoints)
        self._expect_few(cfg.classes)

    def forward(self, features: Sequence[Tensor]) -> list[Level]:
        """What each level says; `features` are (batch, channels, h, w), from fine to coarse."""
        levels: list[Level] = []
        for index, x in enumerate(features):
            keypoints = self.keypoints[index](x) if self.keypoints else x[:, :0]
            levels.append(Level(self.box[index](x), self.score[index](x), keypoints))
        return levels

    @torch.no_grad()
    def _expect_few(self, classes: int) -> None:
        """Begin with scores as if 5 objects lay in 640 × 640 px (after Lin et al. 2017, section 4.1)."""
        for branch, stride in zip(self.score, self.strides_px, strict=True):
            (*_, last) = branch.children()
            odds = 5.0 / classes / (640.0 / stride) ** 2
            for name, values in last.named_parameters():
                if name == "bias":
                    values.fill_(math.log(odds))


def expected_distance(logits: Tensor) -> Tensor:
    """Σᵢ i·softmax(logits)ᵢ over dimension 1: a distribution's mean in cells (Li et al. 2020, section 3.2)."""
    steps = torch.arange(logits.shape[1], device=logits.device, dtype=logits.dtype)
    return (logits.softmax(1).movedim(1, -1) * steps).sum(-1)


def decode(levels: Sequence[Level], strides_px: Sequence[int], bins: int) -> Tensor:
    """Boxes, scores and keypoints of all cells, in the picture's px.

    The layout is that of most exported YOLO models, so that theirs and ours can be read alike.

    Args:
        levels: as `Head` gives them.
        strides_px: of each level.
        bins: of a side's distribution.

    Returns:
        (batch, 4 + classes + 3·keypoints, cells): centre and size of the box, scores from 0 to 1, then x, y and
        visibility from 0 to 1 of each keypoint. A keypoint lies at (2·raw + cell)·stride, where a cell counts from its
        upper left corner.
    """
    found = [_decode(level, stride, bins) for level, stride in zip(levels, strides_px, strict=True)]
    return torch.cat(found, 2)


def _decode(level: Level, stride_px: int, bins: int) -> Tensor:
    batch, _, h, w = level.box.shape
    column = torch.arange(w, device=level.box.device, dtype=level.box.dtype).expand(h, w)
    row = torch.arange(h, device=level.box.device, dtype=level.box.dtype)[:, None].expand(h, w)
    cell = torch.stack((column, row)).reshape(2, h * w)
    sides = level.box.reshape(batch, 4, bins, h * w).transpose(1, 2)
    distance = expected_distance(sides)
    before, after = distance[:, :2], distance[:, 2:]
    centre = (cell + 0.5 + (after - before) / 2.0) * stride_px
    points = level.keypoints.reshape(batch, level.keypoints.shape[1] // 3, 3, h * w)
    places = (2.0 * points[:, :, :2] + cell) * stride_px
    seen = torch.cat((places, points[:, :, 2:].sigmoid()), 2).reshape(batch, level.keypoints.shape[1], h * w)
    score = level.score.reshape(batch, level.score.shape[1], h * w).sigmoid()
    return torch.cat((centre, (before + after) * stride_px, score, seen), 1)


def _branch(convolution: Callable[[int, int], nn.Module], c_in: int, hidden: int, c_out: int) -> nn.Sequential:
    return nn.Sequential(convolution(c_in, hidden), convolution(hidden, hidden), nn.Conv2d(hidden, c_out, 1))


def _conv(c_in: int, c_out: int) -> nn.Module:
    return Conv(c_in, c_out, 3)


def _rfa(c_in: int, c_out: int) -> nn.Module:
    return RFAConv(c_in, c_out)


def _separable(c_in: int, c_out: int) -> nn.Module:
    """Depthwise 3×3, then 1×1 (Howard et al. 2017; YOLOv10, Wang et al. 2024, section 3.2)."""
    return nn.Sequential(Conv(c_in, c_in, 3, groups=c_in), Conv(c_in, c_out))
