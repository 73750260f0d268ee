"""Array types used in signatures, and the checks at the border between rooms."""

from __future__ import annotations

from typing import Any

from auvdock.numeric.arrays import Array, BoolArray, Image, IntArray

__all__ = ["Array", "BoolArray", "Image", "IntArray", "ShapeError", "check_shape"]


class ShapeError(ValueError):
    """An array of another shape than it must have."""


def check_shape(name: str, array: Any, shape: tuple[int | None, ...]) -> None:  # noqa: ANN401 - that is the question
    """Raise ShapeError unless `array` has `shape`; None stands for any length."""
    have = getattr(array, "shape", None)
    if have == shape:
        return  # the common case, at a tenth of the cost
    if have is None:
        raise ShapeError(f"{name} is a {type(array).__name__}, expected an array of shape {shape}")
    if len(have) != len(shape) or any(want not in (None, size) for size, want in zip(have, shape, strict=True)):
        raise ShapeError(f"{name} has shape {have}, expected {shape}")
