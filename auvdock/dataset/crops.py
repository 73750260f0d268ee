"""Square crops at native resolution for training, with their labels; NumPy alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np

from auvdock.core.arrays import Array, Image
from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import NotNegative, Positive, Share, at_least, at_most, between
from auvdock.dataset.frames import FrameLabels, LabelledImage
from auvdock.dataset.labels import clipped
from auvdock.dataset.rules import LabelRules

__all__ = ["CropCfg", "batches", "crop", "crops"]

_BORDER_PX = 6.0
"""A light that a crop is taken for lies at least so far inside it."""


@dataclass(frozen=True)
class CropCfg(Checked):
    """How crops are taken and changed."""

    size_px: Annotated[int, between(32, 2048)] = 192
    """Side of a crop."""
    near_share: Share = 0.85
    """Of crops that hold a light drawn at random, where there is one; the others lie anywhere."""
    zoom_log: Annotated[float, at_least(0.0), at_most(1.0)] = 0.25
    """Greatest magnitude of the logarithm of the zoom."""
    flips: bool = True
    """Mirror half of them left to right and half upside down."""
    channel_gain: tuple[Positive, Positive] = (0.7, 1.3)
    """Of each channel by itself; (1, 1) changes none."""
    edge_share: Share = LabelRules.edge_share
    """Share of a box that must lie in the crop; else it is ignored."""
    floor_px: NotNegative = LabelRules.floor_px
    """Least side of a box in the crop."""

    def __post_init__(self) -> None:
        """Refuse gains out of order."""
        if self.channel_gain[0] > self.channel_gain[1]:
            raise ConfigError("channel_gain", self.channel_gain, "the smaller value first")


def batches(
    frames: Sequence[LabelledImage], count: int, rng: np.random.Generator, cfg: CropCfg | None = None
) -> Iterator[tuple[Image, list[FrameLabels]]]:
    """Without end: `count` crops (count, S, S, 3) uint8 of frames drawn at random, and the labels of each."""
    taken = crops(frames, rng, cfg)
    while True:
        chosen = [next(taken) for _ in range(count)]
        yield np.stack([item.image for item in chosen]), [item.labels for item in chosen]


def crops(
    frames: Sequence[LabelledImage], rng: np.random.Generator, cfg: CropCfg | None = None
) -> Iterator[LabelledImage]:
    """Crops without end; each frame comes once before any comes again.

    Raises:
        ValueError: no frames.
    """
    if not frames:
        raise ValueError("crops need at least one frame")
    while True:
        for index in rng.permutation(len(frames)):
            yield crop(frames[int(index)], rng, cfg or CropCfg())


def crop(frame: LabelledImage, rng: np.random.Generator, cfg: CropCfg) -> LabelledImage:
    """A crop of a frame.

    Outside the image its border is repeated. Of a light that the crop cuts the label is ignored.
    """
    image, labels = frame
    height, width = image.shape[:2]
    zoom = math.exp(float(rng.uniform(-cfg.zoom_log, cfg.zoom_log)))
    side = cfg.size_px / zoom
    counting = np.flatnonzero(~labels.ignored)
    if len(counting) and rng.random() < cfg.near_share:
        inner = 1.0 - 2.0 * _BORDER_PX / side
        low = labels.centre_px[rng.choice(counting)] - side * (0.5 + inner * (rng.random(2) - 0.5))
    else:
        low = rng.random(2) * np.maximum(np.array([width, height]) - side, 0.0)
    low = np.clip(low, -0.5, np.maximum(np.array([width, height]) - side, 0.0) - 0.5)
    flip = rng.random(2) < 0.5 if cfg.flips else np.zeros(2, dtype=np.bool_)
    # Crop from frame: x' = a x + b, mirrored where a < 0.
    a = np.where(flip, -zoom, zoom)
    b = np.where(flip, cfg.size_px - 0.5 + low * zoom, -0.5 - low * zoom)
    taken = _taken(image, a, b, cfg.size_px)
    gain = rng.uniform(*cfg.channel_gain, 3)
    if cfg.channel_gain != (1.0, 1.0):
        taken = cv2.LUT(taken, np.clip(np.rint(np.arange(256.0)[:, None] * gain), 0, 255).astype(np.uint8)[None])
    return LabelledImage(np.asarray(taken, dtype=np.uint8), _moved(labels, a, b, cfg))


def _taken(image: Image, a: Array, b: Array, size: int) -> Image:
    matrix = np.array([[a[0], 0.0, b[0]], [0.0, a[1], b[1]]])
    warped = cv2.warpAffine(image, matrix, (size, size), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(warped, dtype=np.uint8)


def _moved(labels: FrameLabels, a: Array, b: Array, cfg: CropCfg) -> FrameLabels:
    """The labels in a crop; those outside it are left out."""
    size = cfg.size_px
    ends = np.stack([labels.xyxy[:, :2] * a + b, labels.xyxy[:, 2:] * a + b])
    low, high = ends.min(axis=0), ends.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, cfg.floor_px)
    box = np.hstack([middle - half, middle + half])
    cut = clipped(box, size, size)
    area = (cut[:, 2] - cut[:, 0]) * (cut[:, 3] - cut[:, 1])
    share = area / np.maximum(4.0 * half[:, 0] * half[:, 1], 1e-9)
    centre = labels.centre_px * a + b
    inside = np.all((centre >= -0.5) & (centre <= size - 0.5), axis=1)
    kept = share > 0.0
    ignored = labels.ignored | (share < cfg.edge_share) | ~inside
    return FrameLabels(
        labels.class_id[kept],
        cut[kept],
        np.clip(centre, -0.5, size - 0.5)[kept],
        ignored[kept],
        labels.c_range[kept],
    )
