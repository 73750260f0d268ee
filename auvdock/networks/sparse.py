"""A network in two parts: scores everywhere, boxes and keypoints only about the best cells.

A box or keypoint branch sees 5 × 5 cells, by two 3×3 convolutions and one of 1×1. So it can be run on patches of that
size in place of the whole picture, and most cells hold nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn.functional import conv2d, pad

from auvdock.networks.conv import Conv
from auvdock.networks.network import Network

__all__ = ["PATCH", "PatchHead", "ScorePart", "cut_patches"]

PATCH = 5
"""Side of a patch in cells."""


class ScorePart(nn.Module):
    """Backbone, neck and class branches.

    Args:
        network: whose they are.
    """

    def __init__(self, network: Network) -> None:
        """Take the network's own parts."""
        super().__init__()
        self.network = network

    def forward(self, images: Tensor) -> tuple[Tensor, ...]:
        """Scores of all cells from 0 to 1, (batch, classes, cells), and the features of each level; see `Network`."""
        features = self.network.features(images)
        scores = [branch(x).flatten(2) for branch, x in zip(self.network.head.score, features, strict=True)]
        return torch.cat(scores, 2).sigmoid(), *features


class PatchHead(nn.Module):
    """Box and keypoint branches of one level on patches.

    Args:
        network: whose they are, with standard convolutions in its head.
        level: index of the level, 0 for the finest.
    """

    def __init__(self, network: Network, level: int) -> None:
        """Take the network's own branches."""
        super().__init__()
        head = network.head
        branches = [head.box[level], *([head.keypoints[level]] if head.keypoints else [])]
        self.branches = nn.ModuleList(_PatchBranch(*branch.children()) for branch in branches)

    def forward(self, patches: Tensor, inside: Tensor) -> Tensor:
        """What the branches say of each patch's middle cell.

        Args:
            patches: (n, channels, 5, 5) features about n cells, 0 outside the picture.
            inside: (n, 1, 3, 3), 1 for the cells in the middle of a patch that lie in the picture, else 0: between two
                convolutions, too, the whole head has 0 outside.

        Returns:
            (n, 4·bins + 3·keypoints), as in `head.Level`.
        """
        return torch.cat([branch(patches, inside) for branch in self.branches], 1).flatten(1)


def cut_patches(features: Tensor, cells: Sequence[tuple[int, int]]) -> tuple[Tensor, Tensor]:
    """Patches of one level's features about some cells, and which of their cells lie in the picture.

    Args:
        features: (1, channels, h, w).
        cells: row and column of each.

    Returns:
        `patches` and `inside` as `PatchHead` wants them.
    """
    margin = PATCH // 2
    padded = pad(features, (margin,) * 4)
    there = pad(torch.ones_like(features[:, :1]), (1,) * 4)
    patches = [padded[0, :, row : row + PATCH, column : column + PATCH] for row, column in cells]
    inside = [there[0, :, row : row + PATCH - 2, column : column + PATCH - 2] for row, column in cells]
    return torch.stack(patches), torch.stack(inside)


class _PatchBranch(nn.Module):
    """A branch of the head on patches."""

    def __init__(self, first: nn.Module, second: nn.Module, last: nn.Module) -> None:
        super().__init__()
        if not (isinstance(first, Conv) and isinstance(second, Conv)):
            raise TypeError(f"patches need standard convolutions in the head, not {type(first).__name__}")
        self.first, self.second, self.last = first, second, last

    def forward(self, patches: Tensor, inside: Tensor) -> Tensor:
        return self.last(_unpadded(self.second, inside * _unpadded(self.first, patches)))


def _unpadded(block: Conv, x: Tensor) -> Tensor:
    """The block where its picture gets smaller by the kernel's margin."""
    return block.activation(block.norm(conv2d(x, block.conv.weight, block.conv.bias)))
