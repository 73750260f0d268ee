"""Batches of numbered crops: what a training step sees is decided by its number, so that a training can be resumed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from auvdock.assets import asset
from auvdock.core.checked import Checked
from auvdock.core.strict import load_toml, merge, names_file, read_toml
from auvdock.dataset.crops import CropCfg, crop
from auvdock.dataset.frames import FrameLabels, LabelledImage
from auvdock.dataset.labels import TAG
from auvdock.networks.schedule import ScheduleCfg
from auvdock.networks.targets import Batch, Targets

__all__ = ["TrainingCfg", "for_classes", "load_training_cfg", "numbered_batch"]

_CORNER = 0.5
"""From pixels counted from the first one's middle to those counted from the picture's corner."""


@dataclass(frozen=True)
class TrainingCfg(Checked):
    """Schedule and crops of a training."""

    schedule: ScheduleCfg
    """How it is trained."""
    crop: CropCfg
    """On what."""


def load_training_cfg(name: str = "default") -> TrainingCfg:
    """A preset by name ("default"), or a TOML file ("mine.toml") of what differs from that preset.

    Raises:
        ConfigError: no such preset, or a file that does not fit.
    """
    if names_file(name):
        return merge(load_training_cfg(), read_toml(Path(name)))
    return load_toml(TrainingCfg, asset("networks/schedules", name))


def for_classes(labels: FrameLabels, classes: int) -> FrameLabels:
    """Labels as a network of so many classes learns them: one is lights of any colour, two lights and tags, more all.

    A network without tags takes them for background.
    """
    if classes > TAG:
        return labels
    is_tag = labels.class_id == TAG
    kept = np.ones_like(is_tag) if classes > 1 else ~is_tag
    return FrameLabels(is_tag.astype(np.int64), *labels[1:]).select(kept)


def numbered_batch(
    frames: Sequence[LabelledImage], step: int, count: int, seed: int, classes: int, cfg: CropCfg
) -> Batch:
    """The `count` crops of a step: crop i of a training is of frame i of all frames shuffled again and again.

    Args:
        frames: of the training split.
        step: its number, from 0.
        count: crops.
        seed: of the training.
        classes: of the network.
        cfg: how crops are taken.
    """
    taken: list[LabelledImage] = []
    for number in range(step * count, (step + 1) * count):
        round_, place = divmod(number, len(frames))
        order = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0, round_))).permutation(len(frames))
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1, number)))
        frame = frames[int(order[place])]
        taken.append(crop(LabelledImage(frame.image, for_classes(frame.labels, classes)), rng, cfg))
    labels = [item.labels for item in taken]
    targets = Targets(
        np.concatenate([np.full(len(found.class_id), k, dtype=np.int64) for k, found in enumerate(labels)]),
        np.concatenate([found.class_id for found in labels]),
        np.concatenate([found.xyxy for found in labels]) + _CORNER,
        np.concatenate([found.centre_px for found in labels])[:, None] + _CORNER,
        np.concatenate([found.ignored for found in labels]),
    )
    return Batch(np.stack([item.image for item in taken]), targets)
