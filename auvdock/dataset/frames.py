"""Labelled frames in memory: read from a data set's folder, or rendered as they are asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from auvdock.core.arrays import Array, BoolArray, Image, IntArray
from auvdock.core.errors import ConfigError
from auvdock.dataset.config import DatasetCfg
from auvdock.dataset.plan import Split, plan_scenes
from auvdock.dataset.render import render_scene
from auvdock.dataset.store import SHARDS, label_record, read_json

__all__ = ["FrameLabels", "LabelledImage", "read_frame", "read_split", "stream_frames"]


class FrameLabels(NamedTuple):
    """What is in a picture; pixel centres have integer coordinates.

    Attributes:
        class_id: (n,) of `labels.CLASSES`.
        xyxy: (n, 4) boxes.
        centre_px: (n, 2) keypoints.
        ignored: (n,) neither positive nor negative.
        c_range: (n,) attenuation lengths.
    """

    class_id: IntArray
    xyxy: Array
    centre_px: Array
    ignored: BoolArray
    c_range: Array

    def select(self, kept: BoolArray) -> FrameLabels:
        """Some of the labels, `kept` (n,)."""
        return FrameLabels(
            self.class_id[kept], self.xyxy[kept], self.centre_px[kept], self.ignored[kept], self.c_range[kept]
        )


class LabelledImage(NamedTuple):
    """A picture (H, W, 3), uint8, RGB, and what is in it."""

    image: Image
    labels: FrameLabels


def read_split(folder: Path, split: Split) -> list[LabelledImage]:
    """All frames of a split of a finished data set, scene by scene; from its shards, mapped, where there are any.

    Raises:
        ConfigError: a file that is missing or not as `auvdock dataset` writes it, or a split without frames.
    """
    frames: list[LabelledImage] = []
    for path in sorted((folder / "scenes").glob(f"{split}_*.json")):
        record = read_json(path, "data")
        shard = _shard(folder / SHARDS / f"{path.stem}.npy", len(record["frames"]))
        for index, frame in enumerate(record["frames"]):
            image = read_frame(folder / split / "images" / f"{frame['name']}.png") if shard is None else shard[index]
            frames.append(LabelledImage(image, _arrays(frame["labels"])))
    if not frames:
        raise ConfigError("data", str(folder), f"the folder of a data set with frames of the split {split!r}")
    return frames


def stream_frames(cfg: DatasetCfg, seed: int, split: Split = "train") -> Iterator[LabelledImage]:
    """Frames without end, rendered one after the other: those of an endless data set of that seed.

    Raises:
        GraphicsError: surfaces are to be seen and no OpenGL context can be had.
    """
    each = cfg.scenes.conditions * cfg.scenes.frames
    shares = [float(name == split) for name in ("train", "val", "test")]
    for number in count(1):
        for frame in render_scene(cfg, plan_scenes(cfg, number * each, seed, shares)[-1]):
            yield LabelledImage(frame.image, _arrays([label_record(label) for label in frame.labels]))


def read_frame(path: Path) -> Image:
    """An image file (H, W, 3), RGB.

    Raises:
        ConfigError: it is missing or no image.
    """
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        raise ConfigError("data", str(path), "an image file that can be read")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _shard(path: Path, frames: int) -> Image | None:
    """(n, H, W, 3) frames of a scene, mapped; None without that file."""
    if not path.exists():
        return None
    try:
        shard = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise ConfigError("data", str(path), f"a shard as `auvdock dataset` writes it ({error})") from error
    if shard.dtype != np.uint8 or shard.ndim != 4 or shard.shape[0] != frames or shard.shape[3] != 3:
        raise ConfigError("data", str(path), f"a shard of {frames} frames (H, W, 3) in uint8")
    return shard


def _arrays(labels: Sequence[Mapping[str, Any]]) -> FrameLabels:
    return FrameLabels(
        np.array([label["class_id"] for label in labels], dtype=np.int64),
        np.array([label["xyxy"] for label in labels], dtype=np.float64).reshape(-1, 4),
        np.array([label["centre_px"] for label in labels], dtype=np.float64).reshape(-1, 2),
        np.array([bool(label["ignored"]) for label in labels], dtype=np.bool_),
        np.array([label["c_range"] for label in labels], dtype=np.float64),
    )
