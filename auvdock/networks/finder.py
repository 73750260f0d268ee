"""A network in PyTorch that finds objects in whole pictures, as its exported file does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import torch

from auvdock.core.arrays import Image
from auvdock.networks.network import Network
from auvdock.perception.decoding import Candidates
from auvdock.perception.network_pictures import network_input, network_objects
from auvdock.perception.suppression import SuppressionCfg

__all__ = ["find_objects"]


@torch.no_grad()
def find_objects(network: Network, classes: int, images: Iterable[Image], cfg: SuppressionCfg) -> Iterator[Candidates]:
    """What a network in `eval` mode finds in each picture (H, W, 3).

    Args:
        network: which.
        classes: its number of classes.
        images: RGB.
        cfg: least score, and which candidates are one.
    """
    device = next(network.parameters()).device
    for image in images:
        picture = torch.from_numpy(network_input(image, network.stride_px)).to(device)
        found = network(picture.contiguous(memory_format=torch.channels_last))[0]
        size = image.shape[1], image.shape[0]
        yield network_objects(found.cpu().numpy().astype(np.float64), classes, size, cfg)
