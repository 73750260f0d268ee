"""C2PSA, YOLOv11's attention over the whole picture."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import scaled_dot_product_attention

from auvdock.networks.conv import Conv

__all__ = ["C2PSA", "Attention"]

_HEAD_CHANNELS = 64


class Attention(nn.Module):
    """softmax(QKᵀ/√d) V + P(V) over all places of the picture (Vaswani et al. 2017, equation 1).

    Queries and keys have half the channels of the values, and a depthwise 3×3 convolution P of the values tells where
    they are, as in YOLOv10's partial self-attention (Wang et al. 2024, section 3.2).

    Args:
        channels: of x and y, (batch, channels, h, w); each head has 64 of them.
    """

    def __init__(self, channels: int) -> None:
        """Make projections for all heads at once."""
        super().__init__()
        self.heads = max(1, channels // _HEAD_CHANNELS)
        self.value_channels = channels // self.heads
        self.key_channels = self.value_channels // 2
        self.project = Conv(channels, channels + 2 * self.heads * self.key_channels, activation=None)
        self.position = Conv(channels, channels, 3, groups=channels, activation=None)
        self.join = Conv(channels, channels, activation=None)

    def forward(self, x: Tensor) -> Tensor:
        """Attend."""
        batch, channels, h, w = x.shape
        widths = (self.key_channels, self.key_channels, self.value_channels)
        heads = self.project(x).view(batch, self.heads, sum(widths), h * w).transpose(2, 3)
        query, key, value = heads.split(widths, 3)
        seen = scaled_dot_product_attention(query, key, value).transpose(2, 3).reshape(batch, channels, h, w)
        return self.join(seen + self.position(value.transpose(2, 3).reshape(batch, channels, h, w)))


class _Transformer(nn.Module):
    """x + attention, then x + two 1×1 convolutions."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.attention = Attention(channels)
        self.feed = nn.Sequential(Conv(channels, 2 * channels), Conv(2 * channels, channels, activation=None))

    def forward(self, x: Tensor) -> Tensor:
        x = x + self.attention(x)
        return x + self.feed(x)


class C2PSA(nn.Module):
    """Half of the channels go through attention, the other half stays (YOLOv11; Khanam and Hussain 2024).

    Args:
        channels: of x and y, (batch, channels, h, w).
        repeats: number of attention blocks in a row.
    """

    def __init__(self, channels: int, repeats: int = 1) -> None:
        """Make the blocks."""
        super().__init__()
        half = channels // 2
        self.split = Conv(channels, 2 * half)
        self.blocks = nn.Sequential(*(_Transformer(half) for _ in range(repeats)))
        self.join = Conv(2 * half, channels)

    def forward(self, x: Tensor) -> Tensor:
        """Split, attend on the second half, join."""
        kept, seen = self.split(x).chunk(2, 1)
        return self.join(torch.cat((kept, self.blocks(seen)), 1))
