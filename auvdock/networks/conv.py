"""Convolution, batch normalisation and activation: what the other blocks are made of."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn

__all__ = ["Conv"]


class Conv(nn.Module):
    """y = σ(BN(W * x)), without bias, padded so that stride 1 keeps an odd kernel's picture size.

    σ is SiLU (Elfwing et al. 2018); normalisation after Ioffe and Szegedy (2015), with the ε and the momentum with
    which the YOLO family is trained.

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, ⌈h/stride⌉, ⌈w/stride⌉).
        kernel: its side in px.
        stride: step in px.
        groups: number of groups that see only their own channels.
        activation: makes σ; None for none.
        padding: px; by default half the kernel, rounded down.
    """

    def __init__(
        self,
        c_in: int,
        c_out: int,
        kernel: int = 1,
        stride: int = 1,
        groups: int = 1,
        activation: Callable[[], nn.Module] | None = nn.SiLU,
        padding: int | None = None,
    ) -> None:
        """Make the three parts."""
        super().__init__()
        pad = (kernel - 1) // 2 if padding is None else padding
        self.conv = nn.Conv2d(c_in, c_out, kernel, stride, pad, groups=groups, bias=False)
        self.norm = nn.BatchNorm2d(c_out, eps=1e-3, momentum=0.03)
        self.activation = nn.Identity() if activation is None else activation()

    def forward(self, x: Tensor) -> Tensor:
        """Convolve, normalise, activate."""
        return self.activation(self.norm(self.conv(x)))

    @torch.no_grad()
    def fold(self) -> None:
        """Put the normalisation's running statistics into the convolution: W' = Wγ/√(v+ε), b' = β − mγ/√(v+ε).

        The result of `eval` mode stays the same; the block can be trained no further. A second call does nothing.
        """
        norm = self.norm
        if not isinstance(norm, nn.BatchNorm2d) or norm.running_mean is None or norm.running_var is None:
            return
        scale = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        self.conv.weight.mul_(scale[:, None, None, None])
        self.conv.bias = nn.Parameter(norm.bias - norm.running_mean * scale)
        self.norm = nn.Identity()
