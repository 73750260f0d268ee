"""Paper A's table 7, detection of lights: detectors beside each other on rendered test frames."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import Detector, Frame
from auvdock.dataset.config import load_dataset_cfg
from auvdock.dataset.frames import LabelledImage, read_split, stream_frames
from auvdock.dataset.training import for_classes
from auvdock.experiments.network_training import FINDING, truth_of
from auvdock.metrics.detection import AveragePrecision, Found, average_precision, match_centres
from auvdock.perception.detectors import make_detector
from auvdock.perception.network_file import network_names, read_network

__all__ = ["BANDS", "PAPER", "ROWS", "DetectorScore", "evaluation_frames", "score_detector"]

ROWS = ("threshold", "blob", *network_names())
"""Detectors that are compared."""
PAPER = {"yolov8n_pose": (0.911, 0.975), "yolov11n_pose": (0.903, 0.974), "paper_a_light": (0.909, 0.974)}
"""AP50 of boxes and of keypoints in paper A's table 7, on its own pictures; it has no row for threshold and blob."""
BANDS = (0.0, 2.0, 5.0, 9.0, 14.0, 18.0)
"""Borders of the bands of c · range."""
SEED = 1
"""Of the frames that are rendered: `auvdock dataset --seed 1`, split test."""


@dataclass(frozen=True)
class DetectorScore:
    """One detector on the test frames."""

    detector: str
    """Its name."""
    frames: int
    """Test frames."""
    lights: int
    """Lights in them that count."""
    precision: AveragePrecision
    """By COCO's evaluator, from scores of 0.01 on."""
    recall: float
    """Share of the lights that it finds at the score from which it flies."""
    band_recall: tuple[float | None, ...]
    """The same in each band of `BANDS`; None without lights."""
    false_alarms: float
    """A frame, at that score."""
    median_error_px: float
    """Of the centres of what was found."""
    p95_error_px: float
    """95th percentile of them."""
    median_ms: float
    """Time for a frame, with one thread."""


def evaluation_frames(folder: Path | None, count: int) -> list[LabelledImage]:
    """The first test frames of a data set's folder, or rendered ones.

    Raises:
        ConfigError: a folder without such frames.
        GraphicsError: no OpenGL context can be had to render any.
    """
    source: Iterable[LabelledImage]
    source = stream_frames(load_dataset_cfg(), SEED, "test") if folder is None else read_split(folder, "test")
    return list(islice(source, count))


def score_detector(
    name: str, frames: Sequence[LabelledImage], told: Callable[[], object] = lambda: None
) -> DetectorScore:
    """Run a detector on labelled frames and compare.

    Args:
        name: of the detector.
        frames: pictures and labels.
        told: called after each frame.

    Raises:
        ConfigError: no such detector.
        AuvdockError: COCO's evaluator is not installed.
    """
    detector, flying = _detector(name)
    truths = [truth_of(frame) for frame in frames]
    found: list[Found] = []
    seconds: list[float] = []
    for frame in frames:
        answer, spent = _timed(detector, frame)
        found.append(answer)
        seconds.append(spent)
        told()
    matches = [match_centres(truth, item, flying) for truth, item in zip(truths, found, strict=True)]
    seen = np.concatenate([match.found for match in matches])
    error = np.concatenate([match.error_px for match in matches])[seen]
    c_range = np.concatenate([_counting_ranges(frame) for frame in frames])
    return DetectorScore(
        name,
        len(frames),
        len(seen),
        average_precision(truths, found),
        float(seen.mean()) if len(seen) else 0.0,
        _by_band(seen, c_range),
        sum(match.false_alarms for match in matches) / len(frames),
        float(np.median(error)) if len(error) else 0.0,
        float(np.percentile(error, 95.0)) if len(error) else 0.0,
        1e3 * float(np.median(seconds)),
    )


def _detector(name: str) -> tuple[Detector, float]:
    """A detector that tells of all it can, and the score from which it flies."""
    if name not in network_names():
        return make_detector(name), 0.0
    detector = make_detector(name, min_score=FINDING.min_score, max_lights=100)
    return detector, read_network(name).card.min_score


def _timed(detector: Detector, frame: LabelledImage) -> tuple[Found, float]:
    height, width = frame.image.shape[:2]
    # Detectors read the picture alone; these fields of view have no distortion at any size.
    vertical_deg = math.degrees(2.0 * math.atan(height / width))
    optics = CameraCfg(width_px=width, height_px=height, horizontal_fov_deg=90.0, vertical_fov_deg=vertical_deg)
    camera = make_camera(optics, np.zeros(3), *np.eye(3)[[0, 2]])
    shot = Frame(np.ascontiguousarray(frame.image), 0.0, camera)
    began = time.perf_counter()
    answer = detector.detect(shot)
    spent = time.perf_counter() - began
    return Found(answer.xyxy, answer.centre_px, answer.score), spent


def _counting_ranges(frame: LabelledImage) -> Array:
    """(n,) c · range of the lights that count, in the order of `truth_of`."""
    labels = for_classes(frame.labels, 1)
    return labels.c_range[~labels.ignored]


def _by_band(seen: BoolArray, c_range: Array) -> tuple[float | None, ...]:
    shares: list[float | None] = []
    for low, high in pairwise(BANDS):
        within = seen[(c_range >= low) & (c_range < high)]
        shares.append(float(within.mean()) if len(within) else None)
    return tuple(shares)
