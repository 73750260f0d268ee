"""The picture of docs/landing.md: one landing seen from the side and through the vehicle's belly camera.

`python -m auvdock.experiments.landing_picture OUT.png`
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.envs.chase import ChaseCamera
from auvdock.episode.config import landing_level_cfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeSetup, Tick
from auvdock.estimation.landing.percept import LandingPercept

__all__ = ["LandingAlbum", "main"]

HEIGHTS_M = (3.5, 1.5, 0.5, 0.02)
"""Heights of the seat above its place at which pictures are taken."""
SIZE = (400, 300)


class LandingAlbum:
    """Takes a pair of pictures at each height; an `EpisodeObserver`."""

    def __init__(self, chase: ChaseCamera) -> None:
        """Start empty."""
        self.pairs: list[tuple[Image, Image]] = []
        self._chase = chase

    def on_start(self, setup: EpisodeSetup) -> None:
        """Nothing to prepare."""

    def on_tick(self, tick: Tick) -> None:
        """Take a pair when the next height is reached."""
        landing = tick.truth.landing
        if landing is None or tick.image is None or len(self.pairs) == len(HEIGHTS_M):
            return
        if landing.seat_error_m[2] <= HEIGHTS_M[len(self.pairs)]:
            self.pairs.append((self._chase.render(), _marked(tick.image, tick)))

    def on_end(self, result: EpisodeResult) -> None:
        """Nothing to do."""

    def close(self) -> None:
        """Release the chase camera."""
        self._chase.close()


def _marked(image: Image, tick: Tick) -> Image:
    """The frame with what perception made of it: boxes around lights, the tag's corners, the level in use."""
    out = image.copy()
    percept = tick.percept
    if not isinstance(percept, LandingPercept):
        return out
    for left, top, right, bottom in percept.detections.xyxy.round().astype(int).tolist():
        cv2.rectangle(out, (left, top), (right, bottom), (255, 200, 60), 2)
    for tag in percept.tags:
        corners = tag.corners_px.round().astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(out, [corners], isClosed=True, color=(90, 255, 120), thickness=2)
    cv2.putText(out, percept.level, (14, 40), cv2.FONT_HERSHEY_SIMPLEX, 1.1, (255, 255, 255), 2, cv2.LINE_AA)
    return out


def main(out: Path) -> None:
    """Fly the standard task and write the picture."""
    runner = EpisodeRunner(landing_level_cfg(1))
    simulator = runner.world.simulator
    album = LandingAlbum(ChaseCamera(simulator, 640, 480))
    runner.run(1, [album])
    columns: list[Image] = []
    for pair in album.pairs:
        resized = [np.asarray(cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA), dtype=np.uint8) for image in pair]
        columns.append(np.vstack(resized))
    cv2.imwrite(str(out), np.hstack(columns)[:, :, ::-1])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
