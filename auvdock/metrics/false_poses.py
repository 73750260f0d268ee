"""Which measured poses are wrong: medians hide a pose kilometres away, a count does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from auvdock.core.arrays import BoolArray

__all__ = ["FALSE_POSE_M", "FALSE_POSE_OF_RANGE", "FalsePoses", "is_false"]

FALSE_POSE_M = 0.3
"""A measured pose is false if the camera's position is off by more than this ..."""
FALSE_POSE_OF_RANGE = 0.1
"""... and by more than this share of the true distance between camera and station origin."""


def is_false(error_m: ArrayLike, range_m: ArrayLike) -> BoolArray:
    """(n,) whether each pose is false: its error is above max(0.3 m, 10 % of range), or no number.

    Args:
        error_m: (n,) distance between measured and true camera position.
        range_m: (n,) true distance between camera and station origin.
    """
    bound_m = np.maximum(FALSE_POSE_M, FALSE_POSE_OF_RANGE * np.asarray(range_m, dtype=np.float64))
    return ~(np.asarray(error_m, dtype=np.float64) <= bound_m)


@dataclass(frozen=True)
class FalsePoses:
    """How many measured poses an episode had and how many of them were false, named as in `EpisodeResult`."""

    measured_poses: int
    false_poses: int
    false_pose_rate: float | None

    @classmethod
    def count(cls, error_m: ArrayLike, range_m: ArrayLike) -> FalsePoses:
        """Count them; see `is_false` for the arguments."""
        wrong = is_false(error_m, range_m)
        false = int(np.count_nonzero(wrong))
        return cls(wrong.size, false, false / wrong.size if wrong.size else None)
