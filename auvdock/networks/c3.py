"""C3, YOLOv5's cross-stage partial block, and C3k2, YOLOv11's."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from auvdock.networks.c2f import Bottleneck, C2f
from auvdock.networks.conv import Conv

__all__ = ["C3", "c3k2"]


class C3(nn.Module):
    """y = W₃[m(W₁x), W₂x]: bottlenecks on one of two branches (CSPNet, Wang et al. 2020; YOLOv5, Jocher 2020).

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, h, w).
        repeats: number of bottlenecks.
        shortcut: whether they add what they are given.
        first_kernel: side in px of each bottleneck's first convolution: 1 in YOLOv5, 3 in YOLOv11.
    """

    def __init__(self, c_in: int, c_out: int, repeats: int = 1, shortcut: bool = True, first_kernel: int = 1) -> None:
        """Make the two branches and what joins them."""
        super().__init__()
        hidden = c_out // 2
        self.main = Conv(c_in, hidden)
        self.aside = Conv(c_in, hidden)
        self.blocks = nn.Sequential(*(Bottleneck(hidden, hidden, shortcut, 1.0, first_kernel) for _ in range(repeats)))
        self.join = Conv(2 * hidden, c_out)

    def forward(self, x: Tensor) -> Tensor:
        """Both branches, joined."""
        return self.join(torch.cat((self.blocks(self.main(x)), self.aside(x)), 1))


def c3k2(c_in: int, c_out: int, repeats: int, shortcut: bool, expansion: float, deep: bool) -> C2f:
    """C2f with the inner blocks of YOLOv11 (Khanam and Hussain 2024, arXiv 2410.17725; paper A, figure 11).

    Args:
        c_in: channels of x.
        c_out: channels of y.
        repeats: number of inner blocks.
        shortcut: whether bottlenecks add what they are given.
        expansion: a half's channels as a share of c_out.
        deep: a C3 of two bottlenecks as inner block ("C3k"), in place of a bottleneck that halves its channels.
    """

    def inner(channels: int) -> nn.Module:
        if deep:
            return C3(channels, channels, 2, shortcut, first_kernel=3)
        return Bottleneck(channels, channels, shortcut, expansion=0.5)

    return C2f(c_in, c_out, inner, repeats, expansion)
