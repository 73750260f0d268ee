"""Dynamic convolution, and the C2f block that has it."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import conv2d

from auvdock.networks.c2f import Bottleneck, C2f

__all__ = ["DynamicConv", "c2f_dynamic"]

_EXPERTS = 4


class DynamicConv(nn.Module):
    """a = σ(MLP(GAP(x))), y = Σᵢ aᵢ (x * Wᵢ), then normalisation and SiLU (paper B, equation 1).

    The kernels are mixed before the picture is convolved, once for each picture, which gives the same y at the cost of
    one convolution (CondConv, Yang et al. 2019, equation 1). Paper B names neither M nor the MLP: M = 4 and one linear
    layer with a sigmoid give the growth in size of its table 4.

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, h, w).
        kernel: side of the kernels in px, odd.
        experts: M, number of kernels.
    """

    def __init__(self, c_in: int, c_out: int, kernel: int = 3, experts: int = _EXPERTS) -> None:
        """Make the kernels and what weighs them."""
        super().__init__()
        self.routing = nn.Linear(c_in, experts)
        self.kernels = nn.Parameter(torch.empty(experts, c_out, c_in, kernel, kernel))
        for expert in self.kernels:
            nn.init.kaiming_uniform_(expert, a=math.sqrt(5.0))
        self.norm = nn.BatchNorm2d(c_out, eps=1e-3, momentum=0.03)
        self.activation = nn.SiLU()

    def forward(self, x: Tensor) -> Tensor:
        """Mix each picture's kernel, convolve each with its own."""
        batch, c_in, h, w = x.shape
        experts, c_out, _, kernel, _ = self.kernels.shape
        shares = torch.sigmoid(self.routing(x.mean((2, 3))))
        mixed = (shares @ self.kernels.view(experts, -1)).view(batch * c_out, c_in, kernel, kernel)
        y = conv2d(x.reshape(1, batch * c_in, h, w), mixed, padding=kernel // 2, groups=batch)
        return self.activation(self.norm(y.view(batch, c_out, h, w)))


def c2f_dynamic(c_in: int, c_out: int, repeats: int, shortcut: bool) -> C2f:
    """C2f_DC: the second 3×3 convolution of each bottleneck is dynamic (paper B, section 3.2.1 and figure 6).

    Args:
        c_in: channels of x.
        c_out: channels of y.
        repeats: number of bottlenecks.
        shortcut: whether they add what they are given.
    """

    def inner(channels: int) -> nn.Module:
        block = Bottleneck(channels, channels, shortcut)
        block.second = DynamicConv(channels, channels)
        return block

    return C2f(c_in, c_out, inner, repeats)
