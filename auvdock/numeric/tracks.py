"""Tracks of lights, as the tracker keeps them and all that reads them does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record

__all__ = ["Track", "window_of"]


@dataclass
class Track(Record):
    """One light over time; the axes of the image share their variances."""

    centre_px: Annotated[Array, 2]
    """u, v."""
    velocity_px_s: Annotated[Array, 2]
    """u̇, v̇."""
    p00_px2: float
    """Variance of either coordinate."""
    p01_px2_s: float
    """Covariance of a coordinate and its rate."""
    p11_px2_s2: float
    """Variance of either rate."""
    track_id: int
    """Unique since the tracker's last reset."""
    class_id: int
    """`constants.BLUE` or `constants.RED`."""
    beacon_id: int
    """Beacon that it was authenticated as, -1 for none."""
    missed: int
    """Frames in a row without a detection."""
    hits: int
    """Detections in all."""
    detection: int
    """Row of this frame's detection, -1 for none."""


@compiled
def window_of(scores: Array) -> tuple[int, float]:
    """In how many frames of the window a track was seen, and the sum of its scores (window,) there; 0 is not seen."""
    occurrences, total = 0, 0.0
    for k in range(len(scores)):
        total += scores[k]
        if scores[k] != 0.0:
            occurrences += 1
    return occurrences, total
