"""How far paper B's beacon is seen along each line of its grid, by day and by night."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from auvdock.experiments.kept import Kept
from auvdock.experiments.rotating_rig import RIG, X_M, Y_M, PoolRig, network_stand_in, share_of_turns
from auvdock.experiments.rotating_tables import PAPER_AZIMUTH_DEG
from auvdock.experiments.rotating_watch import Watch

__all__ = ["SHARE_TURNS", "Limit", "Sight", "flash_sights", "limits"]

SHARE_TURNS = 24
"""Turns on which the share rests, frames and beam evenly out of step."""


@dataclass(frozen=True)
class Sight:
    """Share of turns in which the flash is found in a frame or more, along one line from far to near.

    Attributes:
        x_m: along the gantry.
        day: daylight or night.
        y_m: distances along the pool, the farthest first, down to the first with a share of a half or more.
        share: of the turns at each.
    """

    x_m: float
    day: bool
    y_m: tuple[float, ...]
    share: tuple[float, ...]

    @property
    def farthest_m(self) -> float:
        """Farthest distance at which half of the turns or more show the flash, 0 for none."""
        return self.y_m[-1] if self.share[-1] >= 0.5 else 0.0


@dataclass(frozen=True)
class Limit:
    """Detection limits along one line, in m along the pool, 0 for none.

    Attributes:
        x_m: along the gantry.
        day: daylight or night.
        paper_m: the paper's.
        found_m: farthest Y at which half of the turns show the flash here; None where no image is drawn.
        shares: (Y, share of turns) behind it.
        paper_method_m: farthest Y at which algorithm 2 answers in at least half of the turns, in half of the videos.
        ours_m: farthest Y at which our method times at least half of the passes, in half of the videos.
    """

    x_m: float
    day: bool
    paper_m: float
    found_m: float | None
    shares: tuple[tuple[float, float], ...]
    paper_method_m: float
    ours_m: float


def flash_sights(workers: int = 1, tick: Callable[[], object] = lambda: None, kept: Kept | None = None) -> list[Sight]:
    """Both lights on every line of the grid, rendered; the order is that of `X_M`, day first.

    Args:
        workers: processes.
        tick: called after each line.
        kept: holds earlier lines, and takes each new one.
    """
    kept = kept or Kept()
    sights: list[Sight] = []
    jobs = [(x_m, day) for x_m in X_M for day in (True, False)]
    keys: list[dict[str, object]] = [{"sight": job, "turns": SHARE_TURNS, "rig": RIG} for job in jobs]
    known = [kept.find(Sight, key) for key in keys]
    missing = [job for job, sight in zip(jobs, known, strict=True) if sight is None]
    with ProcessPoolExecutor(workers) as pool:
        fresh = pool.map(_sight, missing) if workers > 1 else map(_sight, missing)
        for key, sight in zip(keys, known, strict=True):
            if sight is None:
                sight = next(fresh)
                kept.add(key, sight)
            sights.append(sight)
            tick()
    return sights


def limits(watches: Sequence[Watch], sights: Sequence[Sight] = ()) -> list[Limit]:
    """Detection limits by day and night along each line of the grid."""
    rows: list[Limit] = []
    lines = {(sight.x_m, sight.day): sight for sight in sights}
    for x_m in X_M:
        for day in (True, False):
            own = [w for w in watches if (w.place.x_m, w.place.day) == (x_m, day)]
            paper = PAPER_AZIMUTH_DEG[x_m, day]
            sight = lines.get((x_m, day))
            rows.append(
                Limit(
                    x_m,
                    day,
                    paper_m=max(y for y, value in zip(Y_M, paper, strict=True) if value is not None),
                    found_m=None if sight is None else sight.farthest_m,
                    shares=() if sight is None else tuple(zip(sight.y_m, sight.share, strict=True)),
                    paper_method_m=_farthest(own, lambda w: len(w.paper_deg) >= 0.5 * w.turns),
                    ours_m=_farthest(own, lambda w: len(w.ours_deg) >= 0.5 * w.passes),
                )
            )
    return rows


def _sight(job: tuple[float, bool]) -> Sight:
    x_m, day = job
    rig = PoolRig(day)
    detector = network_stand_in(rig.camera_cfg)
    shares: list[float] = []
    for y_m in reversed(Y_M):
        shares.append(share_of_turns(rig, detector, x_m, y_m, SHARE_TURNS))
        if shares[-1] >= 0.5:
            break
    return Sight(x_m, day, tuple(reversed(Y_M))[: len(shares)], tuple(shares))


def _farthest(watches: Sequence[Watch], good: Callable[[Watch], bool]) -> float:
    best = 0.0
    for y_m in sorted({w.place.y_m for w in watches}):
        there = [w for w in watches if w.place.y_m == y_m]
        if sum(good(w) for w in there) >= math.ceil(0.5 * len(there)):
            best = y_m
    return best
