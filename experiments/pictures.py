"""The README's picture: one episode seen from behind and through the vehicle's own camera.

`python -m auvdock.experiments.pictures OUT.png`
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.envs.chase import ChaseCamera
from auvdock.episode.config import level_cfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeSetup
from auvdock.metrics.tick import Tick

__all__ = ["Album", "main"]

RANGES_M = (20.0, 8.0, 2.5, 0.2)
"""Distances of the nose from the mouth at which pictures are taken."""
SIZE = (480, 270)


class Album:
    """Takes a picture from outside and one through the pilot's camera at some distances; an `EpisodeObserver`."""

    def __init__(
        self,
        chase: ChaseCamera,
        distances_m: Sequence[float],
        distance_m: Callable[[Tick], float],
        mark: Callable[[Image, Tick], Image] | None = None,
    ) -> None:
        """Start empty.

        Args:
            chase: takes the pictures from outside.
            distances_m: where pairs are taken, in falling order.
            distance_m: how far a tick is from the goal.
            mark: draws on the pilot's picture; nothing without.
        """
        self.pairs: list[tuple[Image, Image]] = []
        self._chase, self._distances_m, self._distance_m, self._mark = chase, distances_m, distance_m, mark

    def on_start(self, setup: EpisodeSetup) -> None:
        """Nothing to prepare."""

    def on_tick(self, tick: Tick) -> None:
        """Take a pair when the next distance is reached."""
        if tick.image is None or len(self.pairs) == len(self._distances_m):
            return
        if self._distance_m(tick) <= self._distances_m[len(self.pairs)]:
            image = tick.image.copy()
            self.pairs.append((self._chase.render(), image if self._mark is None else self._mark(image, tick)))

    def on_end(self, result: EpisodeResult) -> None:
        """Nothing to do."""

    def close(self) -> None:
        """Release the chase camera."""
        self._chase.close()

    def save(self, out: Path, size: tuple[int, int]) -> None:
        """Write all pairs side by side, each picture at a size of (width, height) px."""
        columns: list[Image] = []
        for pair in self.pairs:
            small = [np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8) for image in pair]
            columns.append(np.vstack(small))
        cv2.imwrite(str(out), np.hstack(columns)[:, :, ::-1])


def main(out: Path) -> None:
    """Fly the standard task and write the picture."""
    runner = EpisodeRunner(level_cfg(1))
    chase = ChaseCamera(runner.world.simulator)
    album = Album(chase, RANGES_M, lambda tick: float(tick.truth.nose_station_m[0]))
    runner.run(1, [album])
    album.save(out, SIZE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
