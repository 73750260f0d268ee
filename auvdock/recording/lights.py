"""Frames and what perception marks on them, as Rerun's columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from auvdock.recording import paths
from auvdock.recording.batch import PIXEL_CORNER, Batch
from auvdock.recording.palette import CANDIDATE, IDENTIFIED, LOST, class_colours

if TYPE_CHECKING:
    from auvdock.core.contracts import Percept

__all__ = ["write_images", "write_lights"]


def write_lights(frames: Batch, percepts: Sequence[Percept]) -> None:
    """Write detections, tracks, bearings and how many there are, of percepts at the batch's times."""
    _write_detections(frames, percepts)
    _write_tracks(frames, percepts)
    _write_bearings(frames, percepts)
    counts = [(len(percept.detections), len(percept.tracks), percept.array_count) for percept in percepts]
    frames.scalars(paths.LIGHT_COUNTS, np.array(counts, dtype=np.float64))


def write_images(batch: Batch, jpegs: Sequence[bytes | None]) -> None:
    """Write images at the batch's times, None where there is none."""
    images = [(index, jpeg) for index, jpeg in enumerate(jpegs) if jpeg is not None]
    if images:
        blobs = [np.frombuffer(jpeg, dtype=np.uint8) for _, jpeg in images]
        columns = rr.EncodedImage.columns(blob=blobs, media_type=["image/jpeg"] * len(blobs))
        batch.select(np.array([index for index, _ in images])).send(paths.IMAGE, columns)


def _write_detections(frames: Batch, percepts: Sequence[Percept]) -> None:
    xyxy = np.concatenate([percept.detections.xyxy for percept in percepts]) + PIXEL_CORNER
    colours = class_colours(np.concatenate([percept.detections.class_id for percept in percepts]))
    boxes = rr.Boxes2D.columns(
        centers=(xyxy[:, :2] + xyxy[:, 2:]) / 2.0, half_sizes=(xyxy[:, 2:] - xyxy[:, :2]) / 2.0, colors=colours
    )
    frames.send(paths.DETECTIONS, boxes.partition([len(percept.detections) for percept in percepts]))


def _write_tracks(frames: Batch, percepts: Sequence[Percept]) -> None:
    tracks = [track for percept in percepts for track in percept.tracks]
    centres = np.array([track.centre_px for track in tracks]).reshape(-1, 2) + PIXEL_CORNER
    labels = [f"#{track.track_id}" if track.beacon_id is None else f"B{track.beacon_id}" for track in tracks]
    colours = [LOST if track.missed else (CANDIDATE if track.beacon_id is None else IDENTIFIED) for track in tracks]
    points = rr.Points2D.columns(positions=centres, labels=labels, colors=np.array(colours, dtype=np.uint32))
    frames.send(paths.TRACKS, points.partition([len(percept.tracks) for percept in percepts]))


def _write_bearings(frames: Batch, percepts: Sequence[Percept]) -> None:
    named = [
        [(bearing, name) for bearing, name in ((percept.long_range, "far"), (percept.entrance, "entrance")) if bearing]
        for percept in percepts
    ]
    flat = [pair for pairs in named for pair in pairs]
    centres = np.array([bearing.centre_px for bearing, _ in flat]).reshape(-1, 2) + PIXEL_CORNER
    points = rr.Points2D.columns(positions=centres, labels=[name for _, name in flat])
    frames.send(paths.BEARINGS, points.partition([len(pairs) for pairs in named]))
