"""`auvdock train`: train a detection network on labelled frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from auvdock.cli.console import counting_progress, messages, output
from auvdock.cli.parsing import at_least, named_by_flag, parse
from auvdock.dataset.training import load_training_cfg
from auvdock.experiments.network_training import TrainingRun

__all__ = ["Train", "run"]


@dataclass(frozen=True)
class Train:
    """Train a network of the papers on a data set of `auvdock dataset`; needs auvdock[train].

    The same command gives the same weights on one machine. A training that was ended goes on after its last checkpoint
    when the command is given again.
    """

    model: str
    """A model of assets/networks/models.toml: paper_a_light, paper_b, yolo_d, ..."""
    data: Path
    """Folder of `auvdock dataset`."""
    out: Path
    """Folder for checkpoint, weights, scores and curve; a new one, or that of a training to go on with."""
    config: str = "default"
    """Schedule and crops: a preset, or a TOML file written as assets/networks/schedules/default.toml."""
    seed: int = 0
    """Decides the first weights and all crops."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where it computes; one thread on a CPU."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    args = parse(Train, argv, prog)
    at_least(0, seed=args.seed)
    with named_by_flag(**{"networks/schedule": "config", "file": "config"}):
        cfg = load_training_cfg(args.config)
    training = TrainingRun(args.model, args.data, args.out, cfg, args.seed, args.device)
    if training.done:
        messages().print(f"goes on after step {training.done} of {cfg.schedule.steps}", highlight=False)
    with counting_progress() as progress:
        task = progress.add_task("steps", total=cfg.schedule.steps, completed=training.done)
        for told in training.run():
            progress.advance(task)
            if told.score is not None:
                score = told.score
                messages().print(
                    f"step {told.step}: AP50 {score.box_50:.3f}, AP50-95 {score.box:.3f}, keypoints' AP50 "
                    f"{score.keypoint_50:.3f} on the validation split",
                    highlight=False,
                    soft_wrap=True,
                )
    output().print(f"wrote {args.out}", highlight=False, soft_wrap=True)
    return 0
