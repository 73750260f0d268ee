"""Which scenes a data set has: how many frames of which split each gives, and its seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from auvdock.core.errors import ConfigError
from auvdock.dataset.config import DatasetCfg

__all__ = ["SPLITS", "SceneSpec", "Split", "plan_scenes", "split_frames"]

Split = Literal["train", "val", "test"]
"""What frames are for."""
SPLITS: tuple[Split, ...] = get_args(Split)
"""The splits, in the order of their shares."""

_PLASTIC = 1.324717957244746
"""The real root of x³ = x + 1."""


@dataclass(frozen=True)
class SceneSpec:
    """One scene: a station and a camera that stay while waters, lamps, nuisances and poses change.

    Attributes:
        split: what its frames are for.
        number: within the split.
        seed: decides all that is drawn in it; no other scene has the same.
        frames: how many it gives.
        place: (2,) numbers in [0, 1) that choose kind and count of lights, spread evenly over the split's scenes.
    """

    split: Split
    number: int
    seed: int
    frames: int
    place: tuple[float, float]

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.split}_{self.number:05d}"


def split_frames(frames: int, shares: Sequence[float]) -> tuple[int, ...]:
    """Frames of each split, largest remainders first; shares need not add up to 1.

    Raises:
        ConfigError: shares that are negative, not finite, or all 0.
    """
    total = sum(shares)
    if len(shares) != len(SPLITS) or not all(0.0 <= share < math.inf for share in shares) or not 0.0 < total < math.inf:
        raise ConfigError("split", list(shares), "three shares of 0 or more for train, val and test, not all of them 0")
    exact = [frames * share / total for share in shares]
    counts = [int(part) for part in exact]
    by_rest = sorted(range(len(exact)), key=lambda k: counts[k] - exact[k])
    for k in by_rest[: frames - sum(counts)]:
        counts[k] += 1
    return tuple(counts)


def plan_scenes(cfg: DatasetCfg, frames: int, seed: int, shares: Sequence[float]) -> tuple[SceneSpec, ...]:
    """The scenes of a data set, split by split; the last of a split may be shorter.

    Kinds and counts of lights follow a sequence of low discrepancy (Roberts 2018, R2), so that few scenes hold all.
    """
    each = cfg.scenes.conditions * cfg.scenes.frames
    scenes: list[SceneSpec] = []
    for index, (split, count) in enumerate(zip(SPLITS, split_frames(frames, shares), strict=True)):
        start = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(index,))).random(2)
        for number in range(-(-count // each)):
            sequence = np.random.SeedSequence(seed, spawn_key=(index, number))
            # 63 bits: readers of JSON and TOML hold no more.
            own = int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1))
            x, y = ((start[k] + number * _PLASTIC ** -(k + 1)) % 1.0 for k in range(2))
            scenes.append(SceneSpec(split, number, own, min(each, count - number * each), (float(x), float(y))))
    return tuple(scenes)
