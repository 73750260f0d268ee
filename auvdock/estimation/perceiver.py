"""What perceives in each kind of docking: detectors, perception and, for landings, their filter behind one call."""

from __future__ import annotations

from typing import Protocol

from auvdock.core.contracts import Detector, Percept, Sensed
from auvdock.estimation.landing.estimator import LandingEstimator
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.perception.landing.tag_detectors import TagDetector
from auvdock.perception.pipeline import BeaconPerception

__all__ = ["BeaconPerceiver", "LandingPerceiver", "Perceiver"]


class Perceiver(Protocol):
    """Turns what was sensed into a percept, whether that is a frame or the detections that stand in for it."""

    def reset(self) -> None:
        """Forget everything; call at the start of an episode."""
        ...

    def perceive(self, sensed: Sensed) -> Percept | None:
        """What perception makes of a control period's senses; None if there was no new frame."""
        ...


class BeaconPerceiver:
    """A `Perceiver` of lights."""

    def __init__(self, detector: Detector, perception: BeaconPerception) -> None:
        """Put `detector`, which reads frames, before `perception`."""
        self._detector, self._perception = detector, perception

    def reset(self) -> None:
        """Forget the tracks."""
        self._perception.reset()

    def perceive(self, sensed: Sensed) -> Percept | None:
        """What perception makes of a control period's senses; None if there was no new frame."""
        detections = sensed.detections if sensed.frame is None else self._detector.detect(sensed.frame)
        return None if detections is None else self._perception.update(detections, sensed.proprioception)


class LandingPerceiver:
    """A `Perceiver` of a platform's lights and its tag."""

    def __init__(self, detector: Detector, tag_detector: TagDetector, perception: LandingEstimator) -> None:
        """Put the detectors of lights and tags, which read frames, before `perception`."""
        self._detector, self._tag_detector, self._perception = detector, tag_detector, perception

    def reset(self) -> None:
        """Forget the pose and its filter."""
        self._perception.reset()

    def perceive(self, sensed: Sensed) -> LandingPercept | None:
        """What perception makes of a control period's senses; None if there was no new frame."""
        own, detections, tags = sensed.proprioception, sensed.detections, sensed.tags
        if sensed.frame is not None:
            tags = self._tag_detector.detect(sensed.frame, self._perception.tag_regions(own))
            detections = self._detector.detect(sensed.frame)
        return None if detections is None else self._perception.update(detections, tags, own)
