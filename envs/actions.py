"""Actions as people give them, checked before anything remembers them."""

from __future__ import annotations

from typing import Any

import numpy as np

from auvdock.core.arrays import Array, check_shape

__all__ = ["checked_action"]


def checked_action(action: Any, count: int) -> Array:  # noqa: ANN401
    """An action as an array (count,), clipped to [-1, 1].

    Raises:
        ValueError: another shape, or a value that is not a number: it would stay in every integrator for good.
    """
    values = np.asarray(action, dtype=np.float64)
    check_shape("action", values, (count,))
    if np.isnan(values).any():
        raise ValueError(f"action {int(np.isnan(values).argmax())} is not a number")
    return np.clip(values, -1.0, 1.0)
