"""Which episodes a campaign consists of: for each its seed and its place on the axes, computable alone."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from auvdock.campaign.axes import AxisValue
from auvdock.campaign.config import CampaignCfg
from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.episode.config import AnyEpisodeCfg

__all__ = ["EpisodeSpec", "Plan"]

_EPISODES, _DESIGN = 0, 1
"""First key of the seed sequences: one branch for the episodes, one for the design."""
_SEED_BITS = 53
"""Seeds survive JSON readers that keep numbers as doubles; among 10⁶ episodes two alike have probability 6e-5."""


@dataclass(frozen=True)
class EpisodeSpec:
    """One episode of a campaign.

    Attributes:
        episode: its number, from 0.
        seed: what `EpisodeRunner.run` and `auvdock dock --seed` take.
        point: value of each axis, by the axis's name.
    """

    episode: int
    seed: int
    point: Mapping[str, AxisValue]


class Plan:
    """A campaign's episodes, in order.

    Episode i lies in grid cell i mod (number of cells), so that every prefix is balanced and a longer campaign begins
    with the shorter one. Its seed is the first 53 bits of `SeedSequence(campaign seed, spawn_key=(0, i))`, the child
    that `SeedSequence.spawn` would give: any episode can be had alone. Drawn axes come from the episode's own sequence
    (`random`) or from a Latin hypercube or scrambled Sobol' design over all episodes (SciPy's qmc).
    """

    def __init__(self, cfg: CampaignCfg) -> None:
        """Draw the design."""
        self.cfg = cfg
        self._grid = [axis for axis in cfg.axes if axis.is_grid]
        self._drawn = [axis for axis in cfg.axes if not axis.is_grid]
        self._kinds = {axis.name: cfg.kind(axis) for axis in cfg.axes}
        self._grids = [tuple(axis.typed(value, self._kinds[axis.name]) for value in axis.grid) for axis in self._grid]
        self.cells = math.prod(len(values) for values in self._grids)
        self._design = self._draw_design()

    def __len__(self) -> int:
        """Number of episodes."""
        return self.cfg.episodes

    def __getitem__(self, episode: int) -> EpisodeSpec:
        """Episode number `episode`.

        Raises:
            ConfigError: no such episode.
        """
        if not 0 <= episode < self.cfg.episodes:
            raise ConfigError("episode", episode, f"a number of 0 to {self.cfg.episodes - 1}")
        sequence = np.random.SeedSequence(self.cfg.seed, spawn_key=(_EPISODES, episode))
        seed = int(sequence.generate_state(1, np.uint64)[0]) >> (64 - _SEED_BITS)
        point: dict[str, AxisValue] = {}
        cell = episode % self.cells
        for axis, values in zip(reversed(self._grid), reversed(self._grids), strict=True):
            cell, place = divmod(cell, len(values))
            point[axis.name] = values[place]
        if self._drawn:
            unit = np.random.default_rng(sequence).random(len(self._drawn))
            unit = unit if self._design is None else self._design[episode]
            for axis, probability in zip(self._drawn, unit, strict=True):
                point[axis.name] = axis.drawn(float(probability), self._kinds[axis.name])
        return EpisodeSpec(episode, seed, {axis.name: point[axis.name] for axis in self.cfg.axes})

    def config(self, spec: EpisodeSpec) -> AnyEpisodeCfg:
        """The episode's configuration."""
        level = spec.point.get("level", self.cfg.level)
        point = [spec.point[axis.name] for axis in self.cfg.axes]
        return self.cfg.base(int(level)).override(self.cfg.changes_at(point))

    def _draw_design(self) -> Array | None:
        if not self._drawn or self.cfg.sampling == "random":
            return None
        from scipy.stats import qmc  # here, because it takes half a second, which most campaigns can do without

        rng = np.random.default_rng(np.random.SeedSequence(self.cfg.seed, spawn_key=(_DESIGN,)))
        dimensions, episodes = len(self._drawn), self.cfg.episodes
        if self.cfg.sampling == "latin_hypercube":
            return qmc.LatinHypercube(dimensions, rng=rng).random(episodes)
        with warnings.catch_warnings():
            # A length that is no power of two costs balance, not validity; any prefix is still a Sobol' sequence.
            warnings.filterwarnings("ignore", message="The balance properties of Sobol")
            return qmc.Sobol(dimensions, rng=rng).random(episodes)
