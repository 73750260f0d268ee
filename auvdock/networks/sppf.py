"""SPPF: context from several distances by pooling."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from auvdock.networks.conv import Conv

__all__ = ["SPPF"]


class SPPF(nn.Module):
    """Spatial pyramid pooling (He et al. 2015) with three equal max pools one after the other (YOLOv5, Jocher 2020).

    Pools of 5 px in a row see 5, 9 and 13 px, as the parallel pools of the original do.

    Args:
        c_in: channels of x, (batch, c_in, h, w); half of them are pooled.
        c_out: channels of y, (batch, c_out, h, w).
        kernel: side of each pool in px.
    """

    def __init__(self, c_in: int, c_out: int, kernel: int = 5) -> None:
        """Make the convolutions and the pool."""
        super().__init__()
        self.reduce = Conv(c_in, c_in // 2)
        self.pool = nn.MaxPool2d(kernel, 1, kernel // 2)
        self.join = Conv(4 * (c_in // 2), c_out)

    def forward(self, x: Tensor) -> Tensor:
        """Reduce, pool thrice, join all four."""
        parts = [self.reduce(x)]
        for _ in range(3):
            parts.append(self.pool(parts[-1]))
        return self.join(torch.cat(parts, 1))
