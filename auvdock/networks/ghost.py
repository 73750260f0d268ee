"""GhostConv: half of the channels by cheap depthwise filters."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from auvdock.networks.conv import Conv

__all__ = ["GhostConv"]


class GhostConv(nn.Module):
    """y = [p, Φ(p)] with p = σ(BN(W * x)) (Han et al. 2020, equations 2 and 3; paper A, section 5.2, module 1).

    Φ is a depthwise 5×5 convolution, so that the second half of the channels costs 25 weights each.

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, ⌈h/stride⌉, ⌈w/stride⌉); even.
        kernel: side of W in px.
        stride: step of W in px.
    """

    def __init__(self, c_in: int, c_out: int, kernel: int = 1, stride: int = 1) -> None:
        """Make both convolutions."""
        super().__init__()
        half = c_out // 2
        self.primary = Conv(c_in, half, kernel, stride)
        self.ghosts = Conv(half, half, 5, groups=half)

    def forward(self, x: Tensor) -> Tensor:
        """Primary channels, then their ghosts."""
        y = self.primary(x)
        return torch.cat((y, self.ghosts(y)), 1)
