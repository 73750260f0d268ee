"""Array types used in signatures, and the checks at the border between rooms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "BoolArray", "Image", "IntArray", "ShapeError", "check_shape"]

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Image = NDArray[np.uint8]


class ShapeError(ValueError):
    """An array of another shape than it must have."""


def check_shape(name: str, array: NDArray[np.generic], shape: tuple[int | None, ...]) -> None:
    """Raise ShapeError unless `array` has `shape`; None stands for any length."""
    if getattr(array, "shape", None) == shape:
        return  # the common case, at a tenth of the cost
    if not isinstance(array, np.ndarray):
        raise ShapeError(f"{name} is a {type(array).__name__}, expected an array of shape {shape}")
    if array.ndim != len(shape) or any(
        want is not None and have != want for have, want in zip(array.shape, shape, strict=True)
    ):
        raise ShapeError(f"{name} has shape {array.shape}, expected {shape}")
