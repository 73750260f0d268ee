"""A network's training on a data set's folder, from the first step or from where it was kept."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.strict import to_plain
from auvdock.dataset.frames import LabelledImage, read_split
from auvdock.dataset.store import read_json
from auvdock.dataset.training import TrainingCfg, for_classes, numbered_batch
from auvdock.metrics.detection import AveragePrecision, Found, Truth, average_precision, need_evaluator
from auvdock.networks.catalog import load_model
from auvdock.networks.extra import need_torch
from auvdock.perception.suppression import SuppressionCfg

if TYPE_CHECKING:
    from auvdock.networks.training import Trainer

__all__ = ["FINDING", "TrainingRun", "draw_curve", "truth_of"]

FINDING = SuppressionCfg(min_score=0.01)
"""Which candidates average precision is told of: nearly all."""


def truth_of(frame: LabelledImage, classes: int = 1) -> Truth:
    """A frame's labels as a network of one class is to find them."""
    labels = for_classes(frame.labels, classes)
    return Truth(labels.xyxy, labels.centre_px, labels.ignored)


@dataclass(frozen=True)
class Progress:
    """Where a training is."""

    step: int
    """Steps done."""
    losses: Sequence[float]
    """Parts of the loss of the last one."""
    score: AveragePrecision | None
    """On the validation split, if it was measured after this step."""


class TrainingRun:
    """One model, one data set, one folder.

    | File in the folder | Content |
    |---|---|
    | `checkpoint.pt` | all that going on needs |
    | `weights.pt` | the running mean's weights, for `auvdock export` |
    | `training.json` | model, schedule, seed, data, scores so far |
    | `losses.csv` | parts of the loss at each step |
    | `curve.png` | losses and AP over the steps |
    """

    def __init__(self, model: str, data: Path, out: Path, cfg: TrainingCfg, seed: int, device: str = "cpu") -> None:
        """Read the data set, and the checkpoint if there is one.

        Raises:
            ConfigError: no such model, a folder without what is needed, or with another training's checkpoint.
            AuvdockError: PyTorch or COCO's evaluator is missing.
        """
        network = load_model(model)
        need_torch()
        need_evaluator()
        import torch

        from auvdock.networks.training import PARTS, Trainer

        if device == "cuda" and not torch.cuda.is_available():
            raise ConfigError("device", device, "cpu: PyTorch sees no CUDA here")
        torch.set_num_threads(1)
        self._train, self._val = read_split(data, "train"), read_split(data, "val")
        self._classes, self._cfg, self._seed, self._out = network.head.classes, cfg, seed, out
        made = read_json(data / "recipe.json", "data")
        self.recipe: dict[str, Any] = {"model": model, "seed": seed, "training": to_plain(cfg), "data": made}
        """What is trained how on what."""
        self._trainer: Trainer = Trainer(network, cfg.schedule, seed, device)
        self._parts = PARTS
        self._history: list[list[float]] = []
        self._scores: list[list[float]] = []
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError("out", str(out), f"a folder that can be written ({error.strerror})") from error
        if self._checkpoint.exists():
            history, scores = self._trainer.restore(self._checkpoint, self._identity)
            self._history, self._scores = history.tolist(), scores.tolist()

    @property
    def done(self) -> int:
        """Steps done."""
        return self._trainer.done

    def run(self) -> Iterator[Progress]:
        """Train to the end of the schedule; tells of each step."""
        schedule = self._cfg.schedule
        while self.done < schedule.steps:
            batch = numbered_batch(self._train, self.done, schedule.batch, self._seed, self._classes, self._cfg.crop)
            self._history.append(self._trainer.step(batch))
            ended = self.done == schedule.steps
            score = None
            if ended or (schedule.validate_steps and self.done % schedule.validate_steps == 0):
                score = self._validate()
                self._scores.append([self.done, score.box_50, score.box, score.keypoint_50])
            if ended or self.done % schedule.keep_steps == 0:
                self._keep()
            yield Progress(self.done, self._history[-1], score)

    def _validate(self) -> AveragePrecision:
        from auvdock.networks.finder import find_objects

        images = (frame.image for frame in self._val)
        found = [
            Found(item.xyxy, _centres(item.xyxy, item.keypoints_px), item.scores)
            for item in find_objects(self._trainer.averaged, self._classes, images, FINDING)
        ]
        return average_precision([truth_of(frame, self._classes) for frame in self._val], found)

    def _keep(self) -> None:
        import torch

        history = torch.tensor(self._history, dtype=torch.float64)
        scores = torch.tensor(self._scores, dtype=torch.float64).reshape(-1, 4)
        try:
            self._trainer.keep(self._checkpoint, self._identity, history, scores)
            self._trainer.keep_averaged(self._out / "weights.pt")
            names = "box_50", "box", "keypoint_50"
            told = [{"step": int(row[0]), **dict(zip(names, row[1:], strict=True))} for row in self._scores]
            content = {**self.recipe, "steps": self.done, "validation": told}
            (self._out / "training.json").write_text(json.dumps(content, indent=1, sort_keys=True), encoding="utf-8")
            with (self._out / "losses.csv").open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(("step", *self._parts))
                writer.writerows([k + 1, *row] for k, row in enumerate(self._history))
            draw_curve(
                self._out / "curve.png", np.array(self._history), np.array(self._scores).reshape(-1, 4), self._parts
            )
        except OSError as error:
            raise ConfigError("out", str(self._out), f"a folder that can be written ({error.strerror})") from error

    @property
    def _checkpoint(self) -> Path:
        return self._out / "checkpoint.pt"

    @property
    def _identity(self) -> str:
        return json.dumps(self.recipe, sort_keys=True)


def draw_curve(path: Path, history: Array, scores: Array, parts: Sequence[str]) -> None:
    """Draw parts of the loss (steps, n), smoothed, and AP (m, 4) over the steps."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    width = max(1, len(history) // 50)
    for column, name in enumerate(parts):
        smooth = np.convolve(history[:, column], np.full(width, 1.0 / width), mode="valid")
        upper.plot(np.arange(width, len(history) + 1), smooth, label=name)
    upper.set_yscale("log")
    upper.set_ylabel("loss")
    upper.legend()
    for column, name in enumerate(("AP50 box", "AP50-95 box", "AP50 keypoint"), 1):
        lower.plot(scores[:, 0], scores[:, column], "o-", label=name)
    lower.set_xlabel("step")
    lower.set_ylabel("validation")
    lower.set_ylim(0.0, 1.0)
    lower.legend()
    figure.savefig(path)


def _centres(xyxy: Array, keypoints_px: Array) -> Array:
    """The first keypoint, or the middle of the box of a network without."""
    return keypoints_px[:, 0] if keypoints_px.shape[1] else (xyxy[:, :2] + xyxy[:, 2:]) / 2.0
