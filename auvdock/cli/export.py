"""`auvdock export`: a trained network as an ONNX file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from auvdock.cli import exit_codes
from auvdock.cli.console import output
from auvdock.cli.parsing import parse
from auvdock.cli.saving import Saving
from auvdock.networks.catalog import load_model
from auvdock.networks.extra import need_torch

__all__ = ["Export", "run"]

_TRIED_STRIDES = (6, 6), (12, 20)


@dataclass(frozen=True)
class Export:
    """Write a network with its weights as ONNX for pictures of any size; needs auvdock[train]."""

    model: str
    """A model of assets/networks/models.toml: paper_a_light, paper_b, yolo_d, ..."""
    weights: Path
    """Its weights, a PyTorch file of tensors by name."""
    out: Path
    """Where to write the ONNX file."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Export, argv, prog)
    cfg = load_model(args.model)
    need_torch()
    from auvdock.networks.export import export_onnx, greatest_difference
    from auvdock.networks.network import Network
    from auvdock.networks.weights import load_weights

    network = Network(cfg)
    load_weights(network, args.weights)
    model = export_onnx(network)
    sizes = [(network.stride_px * rows, network.stride_px * columns) for rows, columns in _TRIED_STRIDES]
    difference = greatest_difference(network, model, sizes)
    saving = Saving()
    saving.attempt(args.out, lambda path: path.write_bytes(model))
    error = saving.errors[0] if saving.errors else None
    told = {"bytes": len(model), "sha256": hashlib.sha256(model).hexdigest(), "greatest_difference": difference}
    if args.json:
        print(json.dumps({"model": args.model, "out": str(args.out), **told, "recording_error": error}))
    elif saving.written:
        output().print(
            f"{args.out}: {len(model)} bytes, SHA-256 {told['sha256']}; ONNX Runtime is within {difference:.1g} of "
            "PyTorch in all that it finds",
            highlight=False,
            soft_wrap=True,
        )
    return saving.finish(exit_codes.DONE)
