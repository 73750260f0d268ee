"""C2f, YOLOv8's cross-stage partial block, and its bottleneck."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn

from auvdock.networks.conv import Conv

__all__ = ["Bottleneck", "C2f", "bottlenecks", "c2f"]


class Bottleneck(nn.Module):
    """Two convolutions, the second 3×3: y = x + W₂W₁x with a shortcut (He et al. 2016, figure 2).

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, h, w); a shortcut needs as many as x has.
        shortcut: whether x is added.
        expansion: channels between the two as a share of c_out.
        first_kernel: side of W₁ in px.
    """

    def __init__(self, c_in: int, c_out: int, shortcut: bool, expansion: float = 1.0, first_kernel: int = 3) -> None:
        """Make the convolutions."""
        super().__init__()
        hidden = int(c_out * expansion)
        self.first = Conv(c_in, hidden, first_kernel)
        self.second: nn.Module = Conv(hidden, c_out, 3)
        self.shortcut = shortcut

    def forward(self, x: Tensor) -> Tensor:
        """Both, and x."""
        y = self.second(self.first(x))
        return x + y if self.shortcut else y


class C2f(nn.Module):
    """Cross-stage partial fusion of YOLOv8 (Jocher et al. 2023; after CSPNet, Wang et al. 2020, and ELAN, 2022).

    A 1×1 convolution makes two halves; the second goes through the inner blocks one after the other, and both halves
    and what each block gives are joined by another 1×1 convolution.

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, h, w).
        inner: makes an inner block from its number of channels.
        repeats: number of inner blocks.
        expansion: a half's channels as a share of c_out.
    """

    def __init__(
        self, c_in: int, c_out: int, inner: Callable[[int], nn.Module], repeats: int = 1, expansion: float = 0.5
    ) -> None:
        """Make the convolutions and the inner blocks."""
        super().__init__()
        half = int(c_out * expansion)
        self.split = Conv(c_in, 2 * half)
        self.blocks = nn.ModuleList(inner(half) for _ in range(repeats))
        self.join = Conv((2 + repeats) * half, c_out)

    def forward(self, x: Tensor) -> Tensor:
        """Split, go through the blocks, join."""
        parts = list(self.split(x).chunk(2, 1))
        for block in self.blocks:
            parts.append(block(parts[-1]))
        return self.join(torch.cat(parts, 1))


def c2f(c_in: int, c_out: int, repeats: int, shortcut: bool, expansion: float) -> C2f:
    """YOLOv8's own: with bottlenecks that keep their channels (paper A, figure 11, left).

    Args:
        c_in: channels of x.
        c_out: channels of y.
        repeats: number of bottlenecks.
        shortcut: whether they add what they are given.
        expansion: a half's channels as a share of c_out.
    """

    def inner(channels: int) -> nn.Module:
        return Bottleneck(channels, channels, shortcut)

    return C2f(c_in, c_out, inner, repeats, expansion)


def bottlenecks(c_in: int, c_out: int, repeats: int, shortcut: bool) -> nn.Sequential:
    """Bottlenecks in a row that halve their channels: Darknet-53's stages (Redmon and Farhadi 2018, table 1).

    Both convolutions are 3×3, as in the YOLOv3 of 103.7 M parameters that Ultralytics publish; Redmon's first is 1×1.

    Args:
        c_in: channels of x; as many as c_out where there are several.
        c_out: channels of y.
        repeats: how many.
        shortcut: whether they add what they are given; needs c_in = c_out.
    """
    return nn.Sequential(*(Bottleneck(c_in, c_out, shortcut, expansion=0.5) for _ in range(repeats)))
