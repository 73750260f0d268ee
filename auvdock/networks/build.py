"""Blocks by their names in a graph."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from torch import nn

from auvdock.networks.akconv import AKConv
from auvdock.networks.bifpn import Concat, WeightedConcat
from auvdock.networks.c2f import bottlenecks, c2f
from auvdock.networks.c2psa import C2PSA
from auvdock.networks.c3 import C3, c3k2
from auvdock.networks.config import BlockName, LayerCfg
from auvdock.networks.container import Container
from auvdock.networks.conv import Conv
from auvdock.networks.dynamic import c2f_dynamic
from auvdock.networks.ghost import GhostConv
from auvdock.networks.partial import csppc
from auvdock.networks.sppf import SPPF

__all__ = ["make_block"]

_SINGLE: Mapping[BlockName, Callable[[LayerCfg, int], nn.Module]] = {
    "AKConv": lambda a, c: AKConv(c, a.channels, a.stride),
    "C2PSA": lambda a, c: C2PSA(c, a.repeats),
    "Bottlenecks": lambda a, c: bottlenecks(c, a.channels, a.repeats, a.shortcut),
    "C2f": lambda a, c: c2f(c, a.channels, a.repeats, a.shortcut, a.expansion),
    "C2f_DC": lambda a, c: c2f_dynamic(c, a.channels, a.repeats, a.shortcut),
    "C3": lambda a, c: C3(c, a.channels, a.repeats, a.shortcut),
    "C3k2": lambda a, c: c3k2(c, a.channels, a.repeats, a.shortcut, a.expansion, a.deep),
    "CSPPC": lambda a, c: csppc(c, a.channels, a.repeats),
    "Container": lambda _, c: Container(c),
    "Conv": lambda a, c: Conv(c, a.channels, a.kernel, a.stride),
    "GhostConv": lambda a, c: GhostConv(c, a.channels, a.kernel, a.stride),
    "SPPF": lambda a, c: SPPF(c, a.channels),
    "Upsample": lambda _, __: nn.Upsample(scale_factor=2.0, mode="nearest"),
}


def make_block(layer: LayerCfg, channels: Sequence[int]) -> tuple[nn.Module, int]:
    """The block of a layer.

    Args:
        layer: its settings.
        channels: of each of its inputs.

    Returns:
        The block, and how many channels it gives.
    """
    if layer.block == "Concat":
        return Concat(), sum(channels)
    if layer.block == "WeightedConcat":
        return WeightedConcat(len(channels)), sum(channels[:2])
    return _SINGLE[layer.block](layer, channels[0]), layer.channels or channels[0]
