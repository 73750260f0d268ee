"""Makes a data set: its scenes in one process or in several, each written as soon as it is rendered."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2

from auvdock import __version__
from auvdock.campaign.worker import THREAD_LIMITS, die_with_parent
from auvdock.core.errors import AuvdockError
from auvdock.core.strict import to_plain
from auvdock.dataset.config import DatasetCfg
from auvdock.dataset.plan import SceneSpec, plan_scenes
from auvdock.dataset.render import render_scene
from auvdock.dataset.store import Store

__all__ = ["Making"]


class Making:
    """One data set on its way."""

    def __init__(
        self, cfg: DatasetCfg, frames: int, seed: int, shares: Sequence[float], folder: Path, *, shards: bool = False
    ) -> None:
        """Plan the scenes and open the folder; those that are there already are kept.

        Args:
            cfg: what is drawn.
            frames: of all splits together.
            seed: decides all scenes' seeds.
            shares: of train, val and test.
            folder: where it goes.
            shards: write each scene's frames as one array, too.

        Raises:
            ConfigError: shares that cannot be used, or a folder that holds something else or cannot be written.
        """
        self.scenes = plan_scenes(cfg, frames, seed, shares)
        self._cfg, self._store, self._shards = cfg, Store(folder), shards
        split = " ".join(f"{share:g}" for share in shares)
        extra = " --shards" if shards else ""
        self._recipe: dict[str, Any] = {
            "version": __version__,
            "command": f"auvdock dataset --frames {frames} --seed {seed} --split {split} --out DIR{extra}",
            "seed": seed,
            "frames": frames,
            "split": [float(share) for share in shares],
            "config": to_plain(cfg),
        }
        self._store.open(self._recipe)
        self.missing = tuple(scene for scene in self.scenes if not self._store.is_done(scene))
        """Scenes that are still to be made."""

    def run(self, workers: int) -> Iterator[SceneSpec]:
        """Make what is missing; each scene as it is done.

        Raises:
            ConfigError: a file that cannot be written.
            GraphicsError: no OpenGL context can be had.
        """
        folder = self._store.folder
        if workers == 1:
            for scene in self.missing:
                yield _make(self._cfg, scene, folder, self._shards)
            return
        context = multiprocessing.get_context("spawn")  # OpenGL contexts do not survive a fork
        with _limited_threads(), ProcessPoolExecutor(workers, context, initializer=_start_worker) as pool:
            tasks = [pool.submit(_make, self._cfg, scene, folder, self._shards) for scene in self.missing]
            try:
                for task in tasks:
                    yield task.result()
            except BrokenProcessPool as error:
                raise AuvdockError("workers: one of them ended; what is done is kept, try fewer --workers") from error
            finally:
                for task in tasks:
                    task.cancel()

    def finish(self) -> dict[str, Any]:
        """Write annotations and card; the card."""
        return self._store.finish(self._recipe, self.scenes)


def _make(cfg: DatasetCfg, scene: SceneSpec, folder: Path, shard: bool) -> SceneSpec:
    Store(folder).put(scene, render_scene(cfg, scene), shard=shard)
    return scene


def _start_worker() -> None:
    """Leave the interrupt key to the parent, die with it, and use one core."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=die_with_parent, daemon=True).start()
    cv2.setNumThreads(1)


@contextmanager
def _limited_threads() -> Generator[None]:
    """One core each for the processes started meanwhile."""
    added = [name for name in THREAD_LIMITS if name not in os.environ]
    os.environ.update({name: THREAD_LIMITS[name] for name in added})
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]
