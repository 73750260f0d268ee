"""A network as ONNX for pictures of any size, whole or in the two parts of `auvdock.networks.sparse`."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import onnxruntime
import torch
from torch import Tensor, nn
from torch.export import Dim

from auvdock.networks.network import IMAGE_CHANNELS, Network
from auvdock.networks.sparse import PATCH, PatchHead, ScorePart

__all__ = ["INPUT", "OUTPUT", "STRIDE_KEY", "export_onnx", "export_sparse", "greatest_difference"]

INPUT, OUTPUT = "images", "found"
"""Names of what goes in and what comes out."""
STRIDE_KEY = "stride_px"
"""In the file's metadata: height and width of a picture must be multiples of this."""

_OPSET = 18
_SAMPLE_STRIDES = 10, 12
_MOST_STRIDES = 256
_MOST_PATCHES = 4096


def export_onnx(network: Network) -> bytes:
    """A network, folded and in `eval` mode, that reads one picture of any height and width.

    In: `images`, (1, 3, h, w) float32, red, green and blue from 0 to 1; h and w are multiples of `Network.stride_px`.
    Out: `found`, (1, 4 + classes + 3·keypoints, cells), see `auvdock.networks.head.decode`.

    Args:
        network: it stays folded.

    Returns:
        What an .onnx file holds.
    """
    network.eval().fold()
    return _export_pictures(network, network.stride_px, [OUTPUT])


def export_sparse(network: Network) -> tuple[bytes, tuple[bytes, ...]]:
    """The same network as `ScorePart` and, for each level, a `PatchHead` for any number of patches.

    The first reads `images` and gives `scores` and `features0`, `features1`, ... of each level; the others read
    `patches` and `inside` and give `said`.

    Args:
        network: it stays folded; with standard convolutions in its head.
    """
    network.eval().fold()
    levels = range(len(network.levels))
    names = ["scores", *(f"features{level}" for level in levels)]
    scores = _export_pictures(ScorePart(network), network.stride_px, names)
    return scores, tuple(_export_patches(network, level) for level in levels)


def greatest_difference(network: Network, model: bytes, sizes_px: Iterable[tuple[int, int]]) -> float:
    """How far ONNX Runtime is from PyTorch at most, in any number that is found, in pictures of noise.

    Args:
        network: what was exported.
        model: as `export_onnx` gives it.
        sizes_px: height and width of each picture.
    """
    session = onnxruntime.InferenceSession(model)
    noise = torch.Generator().manual_seed(0)
    greatest = 0.0
    for size in sizes_px:
        image = torch.rand(1, IMAGE_CHANNELS, *size, generator=noise)
        with torch.no_grad():
            wanted = network(image)
        found = np.asarray(session.run(None, {INPUT: image.numpy()})[0])
        greatest = max(greatest, float(np.abs(found - wanted.numpy()).max()))
    return greatest


def _export_pictures(module: nn.Module, stride_px: int, outputs: Sequence[str]) -> bytes:
    sample = torch.zeros(1, IMAGE_CHANNELS, *(stride_px * count for count in _SAMPLE_STRIDES))
    names = "rows", "columns"
    sizes = {axis: stride_px * Dim(name, min=1, max=_MOST_STRIDES) for axis, name in enumerate(names, 2)}
    return _export(module, (sample,), [INPUT], outputs, (sizes,), {STRIDE_KEY: str(stride_px)})


def _export_patches(network: Network, level: int) -> bytes:
    head = PatchHead(network, level)
    patches = torch.zeros(3, network.channels[level], PATCH, PATCH)
    inside = torch.ones(3, 1, PATCH - 2, PATCH - 2)
    count = {0: Dim("count", min=1, max=_MOST_PATCHES)}
    return _export(head, (patches, inside), ["patches", "inside"], ["said"], (count, count), {})


def _export(
    module: nn.Module,
    sample: tuple[Tensor, ...],
    inputs: Sequence[str],
    outputs: Sequence[str],
    sizes: tuple[dict[int, Any], ...],
    metadata: dict[str, str],
) -> bytes:
    with _quiet(), torch.no_grad():
        program = torch.onnx.export(
            module.eval(),
            sample,
            input_names=inputs,
            output_names=outputs,
            dynamic_shapes=sizes,
            opset_version=_OPSET,
            dynamo=True,
            verbose=False,
        )
    assert program is not None
    program.model.metadata_props.update(metadata)
    return program.model_proto.SerializeToString()


@contextmanager
def _quiet() -> Generator[None]:
    """Without what the exporter says of its own future and of packages that it does not find."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)
