"""A whole network: the graph's blocks one after the other, then the head."""

from __future__ import annotations

from torch import Tensor, nn

from auvdock.networks.build import make_block
from auvdock.networks.config import NetworkCfg
from auvdock.networks.conv import Conv
from auvdock.networks.head import Head, Level, decode

__all__ = ["IMAGE_CHANNELS", "Network"]

IMAGE_CHANNELS = 3
"""Red, green, blue."""


class Network(nn.Module):
    """A detector of boxes, classes and keypoints.

    Args:
        cfg: its graph and head.
    """

    def __init__(self, cfg: NetworkCfg) -> None:
        """Make all blocks with weights at random."""
        super().__init__()
        channels, strides = {"image": IMAGE_CHANNELS}, {"image": 1.0}
        self.blocks = nn.ModuleDict()
        self.inputs: dict[str, tuple[str, ...]] = {}
        before = "image"
        for layer in cfg.layers:
            inputs = layer.inputs or (before,)
            self.blocks[layer.name], channels[layer.name] = make_block(layer, [channels[name] for name in inputs])
            growth = 0.5 if layer.block == "Upsample" else layer.stride
            strides[layer.name] = strides[inputs[0]] * growth
            self.inputs[layer.name] = inputs
            before = layer.name
        self.levels = cfg.head.inputs
        self.stride_px = int(max(strides.values()))
        """Height and width of a picture must be multiples of this."""
        self.channels = tuple(channels[name] for name in self.levels)
        """Of each level's features, from fine to coarse."""
        self.head = Head(cfg.head, self.channels, [int(strides[name]) for name in self.levels])

    def features(self, images: Tensor) -> list[Tensor]:
        """What the head reads, from fine to coarse; see `forward` for the images."""
        made = {"image": images}
        for name, block in self.blocks.items():
            made[name] = block(*(made[source] for source in self.inputs[name]))
        return [made[name] for name in self.levels]

    def raw(self, images: Tensor) -> list[Level]:
        """What the head says before it is decoded: what is trained."""
        return self.head(self.features(images))

    def forward(self, images: Tensor) -> Tensor:
        """Find objects.

        Args:
            images: (batch, 3, h, w), red, green and blue from 0 to 1; h and w are multiples of `stride_px`.

        Returns:
            (batch, 4 + classes + 3·keypoints, cells), see `head.decode`.
        """
        return decode(self.raw(images), self.head.strides_px, self.head.bins)

    def fold(self) -> None:
        """Fold each normalisation into the convolution before it, for use without training (`Conv.fold`)."""
        for block in self.modules():
            if isinstance(block, Conv):
                block.fold()
