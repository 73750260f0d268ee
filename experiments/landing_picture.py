"""The picture of docs/landing.md: one landing seen from the side and through the vehicle's belly camera.

`python -m auvdock.experiments.landing_picture OUT.png`
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.envs.chase import ChaseCamera, from_the_side
from auvdock.episode.config import landing_level_cfg
from auvdock.episode.runner import EpisodeRunner
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.experiments.pictures import Album
from auvdock.metrics.tick import Tick

__all__ = ["main"]

HEIGHTS_M = (3.5, 1.5, 0.5, 0.02)
"""Heights of the seat above its place at which pictures are taken."""
SIZE = (400, 300)


def _height_m(tick: Tick) -> float:
    landing = tick.truth.landing
    return math.inf if landing is None else float(landing.seat_error_m[2])


def _mark(image: Image, tick: Tick) -> Image:
    """Draw what perception made of the frame: boxes around lights, the tag's corners, the level in use."""
    percept = tick.percept
    if not isinstance(percept, LandingPercept):
        return image
    for left, top, right, bottom in percept.detections.xyxy.round().astype(int).tolist():
        cv2.rectangle(image, (left, top), (right, bottom), (255, 200, 60), 2)
    for tag in percept.tags:
        corners = tag.corners_px.round().astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(image, [corners], isClosed=True, color=(90, 255, 120), thickness=2)
    cv2.putText(image, percept.level, (14, 40), cv2.FONT_HERSHEY_SIMPLEX, 1.1, (255, 255, 255), 2, cv2.LINE_AA)
    return image


def main(out: Path) -> None:
    """Fly the standard task and write the picture."""
    runner = EpisodeRunner(landing_level_cfg(1))
    album = Album(ChaseCamera(runner.world.simulator, from_the_side, 640, 480), HEIGHTS_M, _height_m, _mark)
    runner.run(1, [album])
    album.save(out, SIZE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
