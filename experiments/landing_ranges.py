"""Error of lights, tag and both against range, on the same frames: where each level carries, and whether fusion pays.

Frames of one flight are not independent, so intervals come from drawing whole flights (cluster bootstrap; Davison &
Hinkley 1997, section 3.8).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from auvdock.core.arrays import Array
from auvdock.experiments.landing_trials import LandingTrial
from auvdock.perception.landing.config import LEVELS

__all__ = ["EDGES_M", "QUANTITIES", "Comparison", "RangeCell", "compare", "range_cells"]

EDGES_M = (0.0, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.5)
"""Edges of the bins: height of the camera over the tag."""
QUANTITIES = ("position", "heading")
_DRAWS = 1000
_MIN_FRAMES = 20


@dataclass(frozen=True)
class RangeCell:
    """One perception in one bin.

    Attributes:
        levels: "both", "lights" or "tag".
        low_m: lower edge.
        high_m: upper edge.
        frames: frames in the bin.
        flights: flights that have frames there.
        measured: share of them in which the perception measured.
        position_m: root mean square distance from the truth over the frames measured, None without any.
        position_95: its 95 % interval.
        heading_deg: root mean square heading error, likewise.
        heading_95: its 95 % interval.
    """

    levels: str
    low_m: float
    high_m: float
    frames: int
    flights: int
    measured: float
    position_m: float | None
    position_95: tuple[float, float] | None
    heading_deg: float | None
    heading_95: tuple[float, float] | None


@dataclass(frozen=True)
class Comparison:
    """Fused against the better single level in one bin, over the frames that both measured.

    Attributes:
        quantity: "position" (m) or "heading" (degrees).
        low_m: lower edge.
        high_m: upper edge.
        better: the single level with the lesser error.
        frames: paired frames.
        single: its root mean square error.
        fused: that of both together.
        difference_95: 95 % interval of fused less single.
        worse: whether the interval lies above 0.
    """

    quantity: str
    low_m: float
    high_m: float
    better: str
    frames: int
    single: float
    fused: float
    difference_95: tuple[float, float]
    worse: bool


def range_cells(trials: Sequence[LandingTrial], seed: int = 0) -> list[RangeCell]:
    """All perceptions in all bins that have frames."""
    cells: list[RangeCell] = []
    for low, high in pairwise(EDGES_M):
        for name in LEVELS:
            groups = [group for group in (_pick(trial, low, high, name) for trial in trials) if len(group[0])]
            frames = sum(len(inside) for inside, _ in groups)
            if frames == 0:
                continue
            squares = [group[1] for group in groups if len(group[1])]
            measured = sum(len(values) for values in squares)
            enough = measured >= _MIN_FRAMES
            rng = np.random.default_rng([seed, round(1000 * low), LEVELS.index(name)])
            position = _rms_interval([values[:, 0] for values in squares], rng) if enough else None
            heading = _rms_interval([values[:, 1] for values in squares], rng) if enough else None
            cells.append(
                RangeCell(
                    levels=name,
                    low_m=low,
                    high_m=high,
                    frames=frames,
                    flights=len(groups),
                    measured=measured / frames,
                    position_m=None if position is None else position[0],
                    position_95=None if position is None else position[1:],
                    heading_deg=None if heading is None else heading[0],
                    heading_95=None if heading is None else heading[1:],
                )
            )
    return cells


def compare(trials: Sequence[LandingTrial], seed: int = 0) -> list[Comparison]:
    """Fused against the better of the two in every bin, for position and heading."""
    found: list[Comparison] = []
    for column, quantity in enumerate(QUANTITIES):
        for low, high in pairwise(EDGES_M):
            pairs = {name: _paired(trials, low, high, name, column) for name in LEVELS if name != "both"}
            singles = {
                name: math.sqrt(float(np.concatenate([single for single, _ in groups]).mean()))
                for name, groups in pairs.items()
                if sum(len(single) for single, _ in groups) >= _MIN_FRAMES
            }
            if not singles:
                continue
            better = min(singles, key=lambda name: singles[name])
            groups = pairs[better]
            rng = np.random.default_rng([seed, column, round(1000 * low)])
            fused = math.sqrt(float(np.concatenate([both for _, both in groups]).mean()))
            interval = _difference_interval(groups, rng)
            found.append(
                Comparison(
                    quantity=quantity,
                    low_m=low,
                    high_m=high,
                    better=better,
                    frames=sum(len(single) for single, _ in groups),
                    single=singles[better],
                    fused=fused,
                    difference_95=interval,
                    worse=interval[0] > 0.0,
                )
            )
    return found


def _squares(trial: LandingTrial, name: str) -> Array:
    """(n, 2) squared position error in m² and squared heading error in degrees²."""
    error = trial.errors[name]
    return np.column_stack([(error[:, :3] ** 2).sum(axis=1), np.degrees(error[:, 3]) ** 2])


def _pick(trial: LandingTrial, low: float, high: float, name: str) -> tuple[Array, Array]:
    """(ranges of the bin's frames, squared errors (k, 2) of those measured)."""
    inside = (trial.range_m >= low) & (trial.range_m < high)
    return trial.range_m[inside], _squares(trial, name)[inside & (trial.measured[name] > 0.0)]


def _paired(
    trials: Sequence[LandingTrial], low: float, high: float, name: str, column: int
) -> list[tuple[Array, Array]]:
    """(squared errors of the single level, of both) in the frames that both measured, for each flight with any."""
    groups: list[tuple[Array, Array]] = []
    for trial in trials:
        inside = (trial.range_m >= low) & (trial.range_m < high)
        kept = inside & (trial.measured[name] > 0.0) & (trial.measured["both"] > 0.0)
        if kept.any():
            groups.append((_squares(trial, name)[kept, column], _squares(trial, "both")[kept, column]))
    return groups


def _sums(groups: Sequence[Array]) -> Array:
    """(k, 2) sum and count of each flight."""
    return np.array([[values.sum(), len(values)] for values in groups])


def _draw(rng: np.random.Generator, count: int) -> Array:
    """(draws, count) how often each flight is drawn."""
    return rng.multinomial(count, np.full(count, 1.0 / count), size=_DRAWS).astype(np.float64)


def _rms_interval(groups: Sequence[Array], rng: np.random.Generator) -> tuple[float, float, float]:
    total = _sums(groups)
    drawn = _draw(rng, len(total)) @ total
    rms = np.sqrt(drawn[:, 0] / drawn[:, 1])
    whole = total.sum(axis=0)
    low, high = np.percentile(rms, [2.5, 97.5]).tolist()
    return math.sqrt(float(whole[0] / whole[1])), low, high


def _difference_interval(groups: Sequence[tuple[Array, Array]], rng: np.random.Generator) -> tuple[float, float]:
    single, fused = _sums([group[0] for group in groups]), _sums([group[1] for group in groups])
    weights = _draw(rng, len(groups))
    drawn_single, drawn_fused = weights @ single, weights @ fused
    difference = np.sqrt(drawn_fused[:, 0] / drawn_fused[:, 1]) - np.sqrt(drawn_single[:, 0] / drawn_single[:, 1])
    low, high = np.percentile(difference, [2.5, 97.5]).tolist()
    return low, high
