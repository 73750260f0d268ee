"""What a network is to find in a batch of pictures; NumPy alone."""

from __future__ import annotations

from typing import NamedTuple

from auvdock.core.arrays import Array, BoolArray, Image, IntArray

__all__ = ["Batch", "Targets"]


class Targets(NamedTuple):
    """Objects of all pictures of a batch, in px from a picture's upper left corner.

    The middle of the first pixel is (0.5, 0.5), as the head counts; elsewhere in this package it is (0, 0).
    """

    picture: IntArray
    """(n,) in which picture of the batch."""
    classes: IntArray
    """(n,) of which class."""
    xyxy: Array
    """(n, 4) left, top, right, bottom."""
    keypoints_px: Array
    """(n, k, 2)."""
    ignored: BoolArray
    """(n,) neither positive nor negative."""


class Batch(NamedTuple):
    """Pictures and what is in them."""

    images: Image
    """(batch, h, w, 3) uint8, red, green, blue."""
    targets: Targets
    """What is in them."""
