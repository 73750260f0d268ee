"""Whether poses of one level agree from frame to frame, the vehicle's own motion taken out."""

from __future__ import annotations

import numpy as np

from auvdock.core.contracts import Proprioception
from auvdock.estimation.landing.filter import LandingFilter
from auvdock.perception.landing.level import LevelPose, pose_offset

__all__ = ["Agreement"]

_AGREE_M = 0.15
"""How far a pose may lie from where the last one and dead reckoning put it."""
_AGREE_SIGMAS = 4.0


class Agreement:
    """Counts consecutive frames whose poses follow from one another.

    A pose that nothing else speaks for, the first one or one that contradicts the filter, is believed only after some
    of them in a row: spots that have nothing to do with the station give poses too, but hardly the same one again.
    """

    def __init__(self, trial: LandingFilter) -> None:
        """Take a filter of its own, which carries the last pose on to the next frame."""
        self._trial = trial
        self._count = 0

    def reset(self) -> None:
        """Begin anew."""
        self._trial.reset()
        self._count = 0

    def add(self, pose: LevelPose | None, proprioception: Proprioception) -> int:
        """Take in this frame's pose, None for none; how many in a row agree up to it."""
        if pose is None:
            self.reset()
            return 0
        self._count = self._count + 1 if self._follows(pose, proprioception) else 1
        self._trial.reset()
        self._trial.start([pose], proprioception)
        return self._count

    def _follows(self, pose: LevelPose, proprioception: Proprioception) -> bool:
        expected = self._trial.expected(proprioception)
        if expected is None:
            return False
        offset = pose_offset(expected[0], pose.T_station_camera)
        spread = np.sqrt(np.diag(expected[1])[:3] + np.diag(pose.estimate.covariance)[:3])
        return bool((np.abs(offset[:3]) <= _AGREE_M + _AGREE_SIGMAS * spread).all())
