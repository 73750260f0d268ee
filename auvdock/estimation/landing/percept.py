"""What a landing pilot is told of each frame."""

from __future__ import annotations

from dataclasses import dataclass

from auvdock.core.contracts import Percept, PoseEstimate, TagDetection

__all__ = ["LandingPercept"]


@dataclass(frozen=True, eq=False)
class LandingPercept(Percept):
    """What one frame over the landing station says, and what is believed after it.

    `pose` is the belief; `pose.measured` is True if a level measured in this frame. `long_range` is the bearing to the
    group of lights while there is no pose.

    Attributes:
        lights: level I's own pose in this frame.
        tag: level II's own pose in this frame.
        level: what the frame's pose rests on: "none", "lights", "tag" or "fused".
        status: "searching" before the first pose, "tracking" with a measurement in this frame, "holding" while the pose
            is carried on by dead reckoning alone, "lost" once both levels have been silent for too long.
        missed_lights: C_L, consecutive frames without level I.
        missed_tag: C_A, consecutive frames without level II.
        tags: the frame's tags.
        restarts: how often poses disagreed with the belief for so long that it began anew.
    """

    lights: PoseEstimate | None = None
    tag: PoseEstimate | None = None
    level: str = "none"
    status: str = "searching"
    missed_lights: int = 0
    missed_tag: int = 0
    tags: tuple[TagDetection, ...] = ()
    restarts: int = 0
