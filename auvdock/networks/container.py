"""CONTAINER: context from the whole picture and from the neighbourhood, mixed by a learned share."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import scaled_dot_product_attention

__all__ = ["Container"]

_HEAD_CHANNELS = 32
_FEED_EXPANSION = 4


class Container(nn.Module):
    """y = (α A(x) + β A) V W₂ + x, then y + MLP(y) (Gao et al. 2021, arXiv 2106.01401; paper C, section 3.3.2).

    A(x) is attention over all places, A the affinity of neighbours that is the same everywhere: a depthwise 3×3
    convolution. α = σ(s), β = 1 - α with a learned s, and a depthwise 3×3 convolution before it tells places apart, as
    the authors of CONTAINER publish the block.

    Args:
        channels: of x and y, (batch, channels, h, w); each head of A(x) has 32 of them.
    """

    def __init__(self, channels: int) -> None:
        """Make the affinities and the two-layer perceptron."""
        super().__init__()
        hidden = _FEED_EXPANSION * channels
        self.heads = max(1, channels // _HEAD_CHANNELS)
        self.position = nn.Conv2d(channels, channels, 3, padding=1, groups=channels)
        self.norm = nn.BatchNorm2d(channels)
        self.project = nn.Conv2d(channels, 3 * channels, 1)
        self.near = nn.Conv2d(channels, channels, 3, padding=1, groups=channels)
        self.share = nn.Parameter(torch.zeros(1))
        self.join = nn.Conv2d(channels, channels, 1)
        self.feed = nn.Sequential(
            nn.BatchNorm2d(channels), nn.Conv2d(channels, hidden, 1), nn.GELU(), nn.Conv2d(hidden, channels, 1)
        )

    def forward(self, x: Tensor) -> Tensor:
        """Mix both contexts, then each place by itself."""
        batch, channels, h, w = x.shape
        x = x + self.position(x)
        projected = self.project(self.norm(x))
        heads = projected.view(batch, 3, self.heads, channels // self.heads, h * w).transpose(3, 4)
        far = scaled_dot_product_attention(heads[:, 0], heads[:, 1], heads[:, 2])
        far = far.transpose(2, 3).reshape(batch, channels, h, w)
        share = torch.sigmoid(self.share)
        x = x + self.join(share * far + (1.0 - share) * self.near(projected[:, 2 * channels :]))
        return x + self.feed(x)
