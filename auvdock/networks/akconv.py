"""AKConv: a convolution with any number of sampling places, moved by what it sees."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import grid_sample

from auvdock.networks.conv import Conv

__all__ = ["AKConv", "initial_places"]


def initial_places(count: int) -> Tensor:
    """Rows and columns in px of the places before they are moved: rows of ⌊√count⌉, the last as long as is left.

    Returns:
        (count, 2), from the upper left one, which is (0, 0) (Zhang et al. 2023, arXiv 2311.11587, algorithm 1).
    """
    columns = round(count**0.5)
    return torch.tensor([divmod(place, columns) for place in range(count)], dtype=torch.float32)


class AKConv(nn.Module):
    """y(p) = σ(BN(Σₙ wₙ x(p·stride + pₙ + Δpₙ))), read between pixels (Zhang et al. 2023; paper C, section 3.3.1).

    Δpₙ comes from a 3×3 convolution of x that begins at nothing; places outside the picture read its border. With 4
    places it is the size that paper C's table 5 tells.

    Args:
        c_in: channels of x, (batch, c_in, h, w).
        c_out: channels of y, (batch, c_out, ⌈h/stride⌉, ⌈w/stride⌉).
        stride: step in px.
        count: number of places.
    """

    places: Tensor

    def __init__(self, c_in: int, c_out: int, stride: int = 1, count: int = 4) -> None:
        """Make the moves' convolution and the places' weights."""
        super().__init__()
        self.stride, self.count = stride, count
        self.moves = nn.Conv2d(c_in, 2 * count, 3, stride, 1)
        for values in self.moves.parameters():
            nn.init.zeros_(values)
        self.weigh = Conv(c_in * count, c_out)
        self.register_buffer("places", initial_places(count), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """Move the places, read them, weigh them."""
        batch, c_in, height, width = x.shape
        moves = self.moves(x)
        h, w = moves.shape[2:]
        moves = moves.view(batch, self.count, 2, h, w)
        row = self.stride * torch.arange(h, device=x.device, dtype=x.dtype)[:, None]
        column = self.stride * torch.arange(w, device=x.device, dtype=x.dtype)
        rows = moves[:, :, 0] + row + self.places[:, 0, None, None]
        columns = moves[:, :, 1] + column + self.places[:, 1, None, None]
        # grid_sample counts from -1 to 1 over the picture's outer edges; (0, 0) is the middle of the first pixel.
        grid = torch.stack(((2.0 * columns + 1.0) / width - 1.0, (2.0 * rows + 1.0) / height - 1.0), -1)
        read = grid_sample(x, grid.view(batch, self.count * h, w, 2), "bilinear", "border", align_corners=False)
        return self.weigh(read.view(batch, c_in * self.count, h, w))
