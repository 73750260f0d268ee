"""The README's picture: one episode seen from behind and through the vehicle's own camera.

`python -m auvdock.experiments.pictures OUT.png`
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.envs.chase import ChaseCamera
from auvdock.episode.config import level_cfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeSetup, Tick

__all__ = ["Album", "main"]

RANGES_M = (20.0, 8.0, 2.5, 0.2)
"""Distances of the nose from the mouth at which pictures are taken."""
SIZE = (480, 270)


class Album:
    """Takes a pair of pictures at each of the ranges; an `EpisodeObserver`."""

    def __init__(self, chase: ChaseCamera) -> None:
        """Start empty."""
        self.pairs: list[tuple[Image, Image]] = []
        self._chase = chase

    def on_start(self, setup: EpisodeSetup) -> None:
        """Nothing to prepare."""

    def on_tick(self, tick: Tick) -> None:
        """Take a pair when the next range is reached."""
        reached = len(self.pairs) < len(RANGES_M) and tick.truth.nose_station_m[0] <= RANGES_M[len(self.pairs)]
        if reached and tick.image is not None:
            self.pairs.append((self._chase.render(), tick.image.copy()))

    def on_end(self, result: EpisodeResult) -> None:
        """Nothing to do."""

    def close(self) -> None:
        """Release the chase camera."""
        self._chase.close()


def main(out: Path) -> None:
    """Fly the standard task and write the picture."""
    runner = EpisodeRunner(level_cfg(1))
    album = Album(ChaseCamera(runner.world.simulator))
    runner.run(1, [album])
    columns: list[Image] = []
    for pair in album.pairs:
        resized = [np.asarray(cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA), dtype=np.uint8) for image in pair]
        columns.append(np.vstack(resized))
    cv2.imwrite(str(out), np.hstack(columns)[:, :, ::-1])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
