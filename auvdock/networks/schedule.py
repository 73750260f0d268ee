"""How a network is trained: strict TOML, `assets/networks/schedules`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from auvdock.core.checked import Checked
from auvdock.core.errors import ConfigError
from auvdock.core.limits import Count, NotNegative, OpenShare, Positive, PositiveShare, at_least

__all__ = ["AssignmentCfg", "LossCfg", "ScheduleCfg", "learning_rate"]


@dataclass(frozen=True)
class AssignmentCfg(Checked):
    """Which cells learn an object (Feng et al. 2021, TOOD, arXiv 2108.07755, section 3.2)."""

    cells: Count
    """Cells of an object at most."""
    score_power: Positive
    """α of t = s^α · u^β, s the score and u the overlap."""
    overlap_power: Positive
    """β."""


@dataclass(frozen=True)
class LossCfg(Checked):
    """Weights of the parts of the loss."""

    box: NotNegative
    """Of 1 − CIoU."""
    score: NotNegative
    """Of the scores' cross entropy."""
    distribution: NotNegative
    """Of the distribution focal loss."""
    keypoint: NotNegative
    """Of the keypoint's distance."""


@dataclass(frozen=True)
class ScheduleCfg(Checked):
    """A training from beginning to end."""

    crops: Count
    """Crops that the network sees in all; a last batch is whole."""
    batch: Count
    """Crops of a step."""
    learning_rate: Positive
    """Greatest step size of AdamW (Loshchilov and Hutter 2019)."""
    warm_up_steps: Count
    """Steps over which it rises from 0."""
    final_share: PositiveShare
    """Share of it that is left at the end of a cosine."""
    weight_decay: NotNegative
    """Of the weights of convolutions and matrices, none of scales and shifts."""
    gradient_norm: Positive
    """Longer gradients are cut to this."""
    average_decay: OpenShare
    """Decay a step of the running mean of all weights, which is what is used afterwards."""
    validate_steps: Annotated[int, at_least(0)]
    """Steps between two scores on the validation split; 0 for one at the end alone."""
    keep_steps: Count
    """Steps between two checkpoints."""
    assignment: AssignmentCfg
    """Which cells learn an object."""
    loss: LossCfg
    """What is made small."""

    def __post_init__(self) -> None:
        """Refuse a warm-up that is longer than the training."""
        if self.warm_up_steps > self.steps:
            raise ConfigError("warm_up_steps", self.warm_up_steps, f"at most all of the {self.steps} steps")

    @property
    def steps(self) -> int:
        """Steps in all."""
        return -(-self.crops // self.batch)


def learning_rate(cfg: ScheduleCfg, step: int) -> float:
    """Step size of a step, counted from 0: a line up, then half a cosine down (Loshchilov and Hutter 2017)."""
    if step < cfg.warm_up_steps:
        return cfg.learning_rate * (step + 1) / cfg.warm_up_steps
    done = (step - cfg.warm_up_steps) / max(cfg.steps - 1 - cfg.warm_up_steps, 1)
    share = cfg.final_share + (1.0 - cfg.final_share) * 0.5 * (1.0 + math.cos(math.pi * done))
    return cfg.learning_rate * share
