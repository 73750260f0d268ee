"""Joining features of several levels, plainly and by BiFPN's learned weights."""

from __future__ import annotations

import torch
from torch import Tensor, nn

__all__ = ["Concat", "WeightedConcat"]

_EPSILON = 1e-4


class Concat(nn.Module):
    """All channels of the inputs, (batch, cᵢ, h, w) each, one after the other."""

    def forward(self, *inputs: Tensor) -> Tensor:
        """Join."""
        return torch.cat(inputs, 1)


class WeightedConcat(nn.Module):
    """Fast normalised fusion Iᵢ → wᵢIᵢ/(ε + Σⱼwⱼ), wᵢ ≥ 0 (Tan et al. 2020, section 3.3; paper C, equation 5).

    The first two are joined as channels, further ones are added to the second, as equation 7 does with a level's own
    features on both ways. YOLOv11's neck joins levels of different width, and paper C's BiFPN rows add no parameters,
    so nothing was there that would have made all widths equal.

    Args:
        count: number of inputs, two or more.
    """

    def __init__(self, count: int) -> None:
        """Begin with equal weights."""
        super().__init__()
        self.weights = nn.Parameter(torch.ones(count))

    def forward(self, *inputs: Tensor) -> Tensor:
        """(batch, c₁ + c₂, h, w)."""
        weights = self.weights.relu()
        shares = weights / (_EPSILON + weights.sum())
        first, second, *others = (share * x for share, x in zip(shares, inputs, strict=True))
        return torch.cat((first, sum(others, second)), 1)
