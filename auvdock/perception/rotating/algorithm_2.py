"""Paper B's forward beacon detection (algorithm 2): of a run of detections, the frame with the largest, roundest spot.

Kept as the comparison. What the paper leaves open is said in `PaperBCfg`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, NotNegative

__all__ = ["ForwardDetection", "PaperBCfg", "PaperBForwardBeacon"]


@dataclass(frozen=True)
class PaperBCfg(Checked):
    """Settings of algorithm 2."""

    area_weight: NotNegative = 0.5
    """w_area; the paper gives no value (ours: both count alike)."""
    shape_weight: NotNegative = 0.5
    """w_shape; likewise."""
    min_detections: Count = 5
    """Detections that make a pass (line 8: 5). A 10° beam at 0.5 rev/s and 30 Hz is on the camera for 1.67 frames: it
    takes the water's halo to give more."""
    max_missed: Count = 5
    """Frames without a detection that end the pass (line 14: 5)."""
    interpolate: bool = True
    """Fill the gaps of dropped frames within a pass ("interpolation is used to fill in the gaps")."""

    def __post_init__(self) -> None:
        """Refuse weights that weigh nothing."""
        if self.area_weight + self.shape_weight <= 0.0:
            raise ConfigError("area_weight", self.area_weight, "weights of 0 or more, not both 0")


class ForwardDetection(NamedTuple):
    """The frame in which the beacon faces the vehicle, by algorithm 2.

    Attributes:
        time_s: its time.
        centre_px: (2,) the spot's centre in it.
        score: weighted sum of normalised area and roundness.
        detections: detections in the pass.
    """

    time_s: float
    centre_px: Array
    score: float
    detections: int


class PaperBForwardBeacon:
    """Algorithm 2 over the surest detection of each frame.

    Score = w_area × area / greatest area of the pass + w_shape × shorter over longer side of the box. The paper's
    counter frame_det is never set back; here it is, with the list of boxes, else the first pass alone would count. The
    answer comes when the pass is over; the printed algorithm gives it again and again from the fifth detection on, and
    ends with the same.
    """

    def __init__(self, cfg: PaperBCfg, rate_hz: float) -> None:
        """Keep the settings.

        Args:
            cfg: weights and counts.
            rate_hz: the camera's frame rate, to tell dropped frames.
        """
        self._cfg = cfg
        self._dt_s = 1.0 / rate_hz
        self.reset()

    def reset(self) -> None:
        """Forget the pass in progress."""
        self._rows: list[tuple[float, float, float, float, float]] = []
        self._detections = 0

    def update(self, detections: Detections, time_s: float) -> ForwardDetection | None:
        """One frame; returns the answer for a pass that this frame ends, else None."""
        done: ForwardDetection | None = None
        if self._rows and time_s - self._rows[-1][0] > (self._cfg.max_missed - 0.5) * self._dt_s:
            done = self._best()
            self.reset()
        if len(detections):
            best = int(detections.score.argmax())
            left, top, right, bottom = detections.xyxy[best].tolist()
            u, v = detections.centre_px[best].tolist()
            self._rows.append((time_s, right - left, bottom - top, u, v))
            self._detections += 1
        return done

    def finish(self) -> ForwardDetection | None:
        """The answer for the pass in progress; ends it."""
        done = self._best() if self._rows else None
        self.reset()
        return done

    def _best(self) -> ForwardDetection | None:
        if self._detections < self._cfg.min_detections:
            return None
        time_s, *columns = np.array(self._rows).T
        if self._cfg.interpolate:
            count = round((time_s[-1] - time_s[0]) / self._dt_s) + 1
            times = np.union1d(time_s, time_s[0] + self._dt_s * np.arange(count))
            # A frame that is there within a tenth of a period needs no filling.
            missing = np.abs(times[:, None] - time_s).min(axis=1) > 0.1 * self._dt_s
            times = np.sort(np.concatenate([time_s, times[missing]]))
            columns = [np.interp(times, time_s, column) for column in columns]
            time_s = times
        width, height, u, v = columns
        width, height = np.maximum(width, 1e-9), np.maximum(height, 1e-9)
        area = width * height
        shape = np.minimum(width, height) / np.maximum(width, height)
        score = self._cfg.area_weight * area / area.max() + self._cfg.shape_weight * shape
        best = int(score.argmax())
        return ForwardDetection(float(time_s[best]), np.array([u[best], v[best]]), float(score[best]), self._detections)
