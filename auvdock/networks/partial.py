"""Partial convolution, and CSPPC, the C2f block that is made of it."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from auvdock.networks.c2f import C2f

__all__ = ["PartialConv", "csppc"]

_SHARE = 4


class PartialConv(nn.Module):
    """A 3×3 convolution of the first quarter of the channels; the others stay (FasterNet, Chen et al. 2023).

    It costs h·w·k²·(c/4)², a sixteenth of a whole convolution (its section 3.2; paper A, section 5.2, module 2).

    Args:
        channels: of x and y, (batch, channels, h, w).
    """

    def __init__(self, channels: int) -> None:
        """Make the convolution."""
        super().__init__()
        self.seen = channels // _SHARE
        self.conv = nn.Conv2d(self.seen, self.seen, 3, padding=1, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        """Convolve the first channels."""
        return torch.cat((self.conv(x[:, : self.seen]), x[:, self.seen :]), 1)


def csppc(c_in: int, c_out: int, repeats: int) -> C2f:
    """C2f whose bottlenecks are two partial convolutions, without norm, activation or shortcut (paper A, figure 9).

    The figure leaves that open; this reading gives the sizes of the paper's table 8.

    Args:
        c_in: channels of x.
        c_out: channels of y.
        repeats: number of bottlenecks.
    """

    def inner(channels: int) -> nn.Module:
        return nn.Sequential(PartialConv(channels), PartialConv(channels))

    return C2f(c_in, c_out, inner, repeats)
