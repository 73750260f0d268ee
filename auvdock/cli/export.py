"""`auvdock export`: a trained network as an ONNX file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from auvdock.cli import exit_codes
from auvdock.cli.console import output
from auvdock.cli.parsing import parse
from auvdock.cli.saving import Saving
from auvdock.core.errors import ConfigError
from auvdock.dataset.store import read_json
from auvdock.networks.catalog import load_model
from auvdock.networks.config import HeadCfg
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
    training: Path | None = None
    """`training.json` of `auvdock train`: write the network's card, too, beside the ONNX file (NAME.toml). With it
    NAME.onnx is a detector: `--detector NAME.onnx`."""
    min_score: float = 0.25
    """In the card: less sure detections are dropped."""
    limits: str = "not told"
    """In the card: what the network is not good for."""
    json: bool = False
    """Print one JSON object and nothing else."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Export, argv, prog)
    cfg = load_model(args.model)
    trained = None if args.training is None else read_json(args.training, "training")
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
    checksum = hashlib.sha256(model).hexdigest()
    if trained is not None:
        card = _card(args, cfg.head, checksum, trained)
        saving.text(args.out.with_suffix(".toml"), card)
    error = saving.errors[0] if saving.errors else None
    told = {"bytes": len(model), "sha256": checksum, "greatest_difference": difference}
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


def _card(args: Export, head: HeadCfg, checksum: str, trained: Any) -> str:  # noqa: ANN401 - whatever the file holds
    """The card as TOML, see `perception.network_file.NetworkCardCfg`."""
    try:
        if trained["model"] != args.model:
            raise ConfigError(
                "training", str(args.training), f"the training of {args.model}, not of {trained['model']}"
            )
        schedule, last = trained["training"]["schedule"], trained["validation"][-1:]
        seen = trained["steps"] * schedule["batch"]
        side_px = trained["training"]["crop"]["size_px"]
        words = (
            f"{seen} of {schedule['crops']} crops of {side_px} px, {schedule['batch']} a step, AdamW "
            f"at {schedule['learning_rate']:g}, running mean {schedule['average_decay']:g}"
        )
        fields: dict[str, str | float] = {
            "model": args.model,
            "sha256": checksum,
            "classes": head.classes,
            "keypoints": head.keypoints,
            "min_score": args.min_score,
            "data": str(trained["data"]["command"]),
            "schedule": words,
            "seed": int(trained["seed"]),
            "limits": args.limits,
        }
        named = [(name, float(row[name])) for row in last for name in ("box_50", "box", "keypoint_50")]
        scores = {f"validation_{name}": round(value, 4) for name, value in named}
    except (KeyError, TypeError, ValueError, IndexError) as error:
        remedy = f"a file as `auvdock train` writes it ({error!r})"
        raise ConfigError("training", str(args.training), remedy) from error
    lines = [f"{name} = {json.dumps(value)}" for name, value in fields.items()]
    return "\n".join([*lines, "", "[scores]", *(f"{name} = {value}" for name, value in scores.items())]) + "\n"
