"""Synthetic episodes; a module of its own so that spawned workers can import it."""

import json
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auvdock.campaign.row import RESULT_COLUMNS
from auvdock.core.errors import ConfigError


def row(spec, success, reason="near"):
    """A row with plausible figures that follow from the episode's seed."""
    part = spec.seed / 2**53
    drawn: dict[str, Any] = {name: kind(part * 100) for name, kind in RESULT_COLUMNS.items() if kind in (int, float)}
    drawn["poses_by_solver"] = json.dumps({"sqpnp": int(part * 100)})
    outcome = {"success": success, "failure_reason": None if success else reason}
    ordered = {name: outcome[name] if name in outcome else drawn[name] for name in RESULT_COLUMNS}
    return {"episode": spec.episode, "seed": spec.seed, **spec.point, **ordered, "error": None}


@dataclass(frozen=True)
class Bernoulli:
    """Succeeds with a known probability; `pause_s` makes it last, `log` tells who ran it, each n-th may raise."""

    probability: float
    pause_s: float = 0.0
    log: str = ""
    raise_every: int = 0

    def build(self):
        def run(spec):
            if self.raise_every and spec.episode % self.raise_every == 0:
                raise ZeroDivisionError("no light")
            if self.pause_s:
                time.sleep(self.pause_s)
            if self.log:
                with Path(self.log).open("a", encoding="utf-8") as log:
                    log.write(f"{spec.episode}\n")
            return row(spec, bool(np.random.default_rng(spec.seed).random() < self.probability))

        return run


@dataclass(frozen=True)
class ByCell:
    """Succeeds with the probability of its cell; cells follow one another."""

    probabilities: tuple[float, ...]

    def build(self):
        def run(spec):
            probability = self.probabilities[spec.episode % len(self.probabilities)]
            return row(spec, bool(np.random.default_rng(spec.seed).random() < probability))

        return run


@dataclass(frozen=True)
class Troubled:
    """Episode 1 kills its worker always, 2 only the first time, 3 hangs, 4 raises; the others succeed."""

    folder: str

    def build(self):
        def run(spec):
            if spec.episode == 1:
                os.kill(os.getpid(), signal.SIGKILL)
            marker = Path(self.folder) / "died-once"
            if spec.episode == 2 and not marker.exists():
                marker.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            if spec.episode == 3:
                time.sleep(1e6)
            if spec.episode == 4:
                raise ZeroDivisionError("no\nlight")
            return row(spec, True)

        return run


@dataclass(frozen=True)
class Raising:
    """Every episode raises."""

    refuse: bool = False

    def build(self):
        def run(spec):
            if self.refuse:
                raise ConfigError("detector", spec.episode, "one that works")
            raise ZeroDivisionError("no light")

        return run
