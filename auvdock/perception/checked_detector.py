"""What a detector of one's own finds, checked where it comes in: the rooms behind rely on shapes and finite numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from auvdock.core.arrays import ShapeError
from auvdock.core.contracts import BLUE, RED, Detections, Detector, Frame, RegionOfInterest
from auvdock.core.errors import ConfigError

__all__ = ["CheckedDetector"]


@dataclass(frozen=True)
class CheckedDetector:
    """A detector whose answers are refused unless they are `Detections` of finite numbers."""

    name: str
    """By which the user asked for it."""
    inner: Detector

    def detect(self, frame: Frame, regions: Sequence[RegionOfInterest] = ()) -> Detections:
        """What the detector finds.

        Raises:
            ConfigError: an answer of another kind or shape, a number that is not finite, a box inside out, a score
                outside 0 to 1, or a class that is neither `BLUE` nor `RED`.
        """
        try:
            found: Any = self.inner.detect(frame, regions)
        except ShapeError as error:
            self._refuse(frame, f"arrays that belong together ({error})")
        if not isinstance(found, Detections):
            self._refuse(frame, f"an answer of type Detections, not {type(found).__name__}")
        columns = {"xyxy": found.xyxy, "centre_px": found.centre_px, "score": found.score}
        if found.flux is not None:
            columns["flux"] = found.flux
        numbers = {name: self._numbers(frame, name, values) for name, values in columns.items()}
        box, score, kind = numbers["xyxy"], numbers["score"], self._numbers(frame, "class_id", found.class_id)
        self._demand(frame, "xyxy", box, (box[:, :2] <= box[:, 2:]).all(axis=1), "left <= right and top <= bottom")
        self._demand(frame, "score", score, (score >= 0.0) & (score <= 1.0), "a confidence of 0 to 1")
        self._demand(frame, "class_id", kind, np.isin(kind, (BLUE, RED)), f"BLUE ({BLUE}) or RED ({RED})")
        return Detections(box, numbers["centre_px"], score, kind.astype(np.int64), numbers.get("flux"))

    def _numbers(self, frame: Frame, name: str, values: Any) -> Any:  # noqa: ANN401 - whatever the detector gave
        try:
            numbers = np.ascontiguousarray(values, dtype=np.float64)
        except (TypeError, ValueError) as error:
            self._refuse(frame, f"{name} as an array of numbers ({error})")
        finite = np.isfinite(numbers).all(axis=tuple(range(1, numbers.ndim)))
        self._demand(frame, name, numbers, finite, "finite numbers")
        return numbers

    def _demand(self, frame: Frame, name: str, values: Any, right: Any, remedy: str) -> None:  # noqa: ANN401
        if not right.all():
            row = int(np.argmin(right))
            self._refuse(frame, f"{name} of {remedy}: row {row} is {values[row].tolist()}")

    def _refuse(self, frame: Frame, remedy: str) -> NoReturn:
        raise ConfigError("perception.detector", self.name, f"detections with {remedy}, at {frame.time_s:.3f} s")
