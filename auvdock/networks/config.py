"""A network as data: its blocks in order, and its head; and changes of it, which an ablation is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Literal

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError, located
from auvdock.core.limits import Count, OpenShare, at_least
from auvdock.core.strict import merge

__all__ = ["BlockName", "ChangeCfg", "HeadCfg", "InsertCfg", "LayerCfg", "NetworkCfg", "ReplaceCfg"]

BlockName = Literal[
    "AKConv",
    "Bottlenecks",
    "C2PSA",
    "C2f",
    "C2f_DC",
    "C3",
    "C3k2",
    "CSPPC",
    "Concat",
    "Container",
    "Conv",
    "GhostConv",
    "SPPF",
    "Upsample",
    "WeightedConcat",
]
"""Blocks that a graph may name; `auvdock.networks.build` makes them."""


@dataclass(frozen=True)
class LayerCfg(Checked):
    """One block of a graph. A block reads the settings that it has; others may stay from the block that it replaces."""

    block: BlockName
    """Which."""
    name: str
    """By which other layers and the head ask for what it gives."""
    inputs: tuple[str, ...] = ()
    """Names of the layers that it reads; by default the one before."""
    channels: Annotated[int, at_least(0)] = 0
    """Channels that it gives, where it does not keep their number."""
    kernel: Count = 3
    """Side of a convolution's kernel in px."""
    stride: Count = 1
    """Step of a convolution in px."""
    repeats: Count = 1
    """Number of inner blocks."""
    shortcut: bool = True
    """Whether inner bottlenecks add what they are given."""
    expansion: OpenShare = 0.5
    """Channels of a half as a share of those given (C2f and what is made like it)."""
    deep: bool = False
    """C3 inside C3k2, in place of a bottleneck."""


@dataclass(frozen=True)
class HeadCfg(Checked):
    """The anchor-free head: for each cell of each level a box, the classes and keypoints."""

    inputs: tuple[str, ...]
    """Names of the layers that it reads, from fine to coarse."""
    classes: Count = 1
    """How many kinds of objects."""
    keypoints: Annotated[int, at_least(0)] = 1
    """Keypoints of an object."""
    bins: Annotated[int, at_least(2)] = 16
    """Distances in cells, 0 to bins - 1, over which each side of a box has a distribution."""
    class_convolution: Literal["full", "separable"] = "full"
    """3×3 convolutions of the class branch: whole ones (YOLOv8), or depthwise and 1×1 (YOLOv10, YOLOv11)."""
    convolution: Literal["standard", "RFAConv"] = "standard"
    """3×3 convolutions of all branches that are whole."""


@dataclass(frozen=True)
class NetworkCfg(Checked):
    """A whole network."""

    source: str
    """Whose it is, and where that is told."""
    layers: tuple[LayerCfg, ...]
    """In the order in which they are run."""
    head: HeadCfg
    """What reads them at the end."""

    def __post_init__(self) -> None:
        """Refuse names that are given twice or asked for before they are there."""
        known: set[str] = set()
        for index, layer in enumerate(self.layers):
            if layer.name in known:
                raise ConfigError(f"layers[{index}].name", layer.name, "a name that no other layer has")
            _refuse_unknown(layer.inputs, known | {"image"}, f"layers[{index}].inputs")
            known.add(layer.name)
        _refuse_unknown(self.head.inputs, known, "head.inputs")

    def changed(self, change: ChangeCfg) -> NetworkCfg:
        """The network with some blocks replaced, some put in and the head set otherwise.

        Raises:
            ConfigError: a layer that the network does not have, or a setting that does not fit.
        """
        names = {layer.name for layer in self.layers}
        layers = list(self.layers)
        for index, swap in enumerate(change.replace):
            _refuse_unknown(swap.layers, names, f"replace[{index}].layers")
            with located(f"replace[{index}].settings."):
                layers = [merge(layer, swap.settings) if layer.name in swap.layers else layer for layer in layers]
        for index, new in enumerate(change.insert):
            _refuse_unknown((new.after,), names, f"insert[{index}].after")
            layers = _inserted(layers, new)
        with located("head."):
            head = merge(self.head, change.head)
        return replace(self, layers=tuple(layers), head=head)


@dataclass(frozen=True)
class ReplaceCfg(Checked):
    """Other settings, most often another block, for some layers."""

    layers: tuple[str, ...]
    """Their names."""
    settings: Mapping[str, Any]
    """Fields of `LayerCfg`; those not named stay."""


@dataclass(frozen=True)
class InsertCfg(Checked):
    """A new layer; all that read the one before it read it in its place."""

    after: str
    """Name of the layer before it."""
    layer: LayerCfg
    """The new one."""


@dataclass(frozen=True)
class ChangeCfg(Checked):
    """One line of an ablation."""

    source: str
    """Whose it is, and what was left open there."""
    replace: tuple[ReplaceCfg, ...] = ()
    """Layers set otherwise."""
    insert: tuple[InsertCfg, ...] = ()
    """Layers put in."""
    head: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Fields of `HeadCfg` set otherwise."""


def _refuse_unknown(names: tuple[str, ...], known: set[str], field: str) -> None:
    for name in names:
        if name not in known:
            raise ConfigError(field, name, f"layers that come before: {', '.join(sorted(known))}")


def _inserted(layers: list[LayerCfg], new: InsertCfg) -> list[LayerCfg]:
    position = next(index for index, layer in enumerate(layers) if layer.name == new.after) + 1
    renamed = [
        replace(layer, inputs=tuple(new.layer.name if name == new.after else name for name in layer.inputs))
        for layer in layers[position:]
    ]
    return [*layers[:position], new.layer, *renamed]
