"""Parameters and floating-point operations of a network, counted without computing anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.utils.flop_counter import FlopCounterMode

from auvdock.networks.config import NetworkCfg
from auvdock.networks.network import IMAGE_CHANNELS, Network

__all__ = ["NetworkSize", "measure_size"]

_GIGA = 1e-9


@dataclass(frozen=True)
class NetworkSize:
    """How large a network is, with its normalisations folded into the convolutions as it is used."""

    parameters: int
    """Weights and biases."""
    trained_parameters: int
    """The same before folding: what training changes."""
    gflops: float
    """10⁹ operations for a picture: all convolutions and matrix products, 2 for each multiply and add."""
    module_gflops: float
    """The same as a profiler sees it that hooks on layers: only those of `nn.Conv2d` and `nn.Linear`."""


def measure_size(cfg: NetworkCfg, height_px: int = 640, width_px: int = 640) -> NetworkSize:
    """Count.

    PyTorch's own counter sees the operations themselves. Papers use profilers that hook on layers, which miss matrix
    products and convolutions that a block calls as functions, and add some 2 % for normalisations.

    Args:
        cfg: the network.
        height_px: of the picture.
        width_px: of the picture.
    """
    with torch.device("meta"), torch.no_grad():  # shapes alone
        network = Network(cfg).eval()
        trained = _count(network)
        network.fold()
        image = torch.empty(1, IMAGE_CHANNELS, height_px, width_px)
        seen: list[int] = []
        hooks = [
            module.register_forward_hook(lambda block, _, y: seen.append(_operations(block, y)))
            for module in network.modules()
            if isinstance(module, nn.Conv2d | nn.Linear)
        ]
        with FlopCounterMode(display=False) as counter:
            network(image)
        for hook in hooks:
            hook.remove()
    return NetworkSize(_count(network), trained, _GIGA * counter.get_total_flops(), _GIGA * sum(seen))


def _count(network: nn.Module) -> int:
    return sum(values.numel() for values in network.parameters())


def _operations(block: Any, y: Tensor) -> int:  # noqa: ANN401 - a module's hook
    """2 for each weight and place of the output: a convolution's weights of one output channel, times its size."""
    per_value = block.weight[0].numel()
    return 2 * per_value * y.numel()
