"""Bearings without a pose: the far lamp or the blue group as a whole, and the red entrance lamps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import Bearing
from auvdock.core.limits import Count, PositiveShare, at_least
from auvdock.perception.pnp import PnpSolution
from auvdock.perception.sights import (
    CENTRE,
    ENTRANCE,
    FOLLOWED,
    LONG_RANGE,
    RANGE,
    RAY,
    SCORE,
    find_sights,
    sight_terms,
)
from auvdock.perception.tracker import LightTracker

__all__ = ["LineOfSight", "LineOfSightCfg"]

_NO_POSE = np.zeros(0)


@dataclass(frozen=True)
class LineOfSightCfg(Checked):
    """When a light is steady enough to steer by."""

    min_occurrences: Count = 3
    """Detections within the tracker's window: a light seen once or twice does not steer."""
    max_missed: int = 5
    """A light may be bridged by prediction for this many frames."""
    group_size: Annotated[int, at_least(2)] = 3
    """From this many blue lights on, the group's centre is the target and its spread gives a rough range."""
    loyalty: PositiveShare = 0.7
    """A single light is kept until another scores more than its own score over this."""


class LineOfSight:
    """Bearings from the tracks of one camera.

    With a pose the long-range bearing is that of the array's centre. Without one it is the centre of the blue lights,
    strays left out, with a range by their spread; of fewer than `group_size` it is the brightest and steadiest. The
    entrance's is the centre of the red lights.
    """

    def __init__(self, cfg: LineOfSightCfg, camera: Camera, layout: BeaconLayout) -> None:
        """Precompute the layout's spreads."""
        self._terms = sight_terms(camera, layout, cfg.min_occurrences, cfg.max_missed, cfg.group_size, cfg.loyalty)
        self.reset()

    def reset(self) -> None:
        """Forget which light was followed."""
        self._followed = -1

    def update(self, tracks: LightTracker, solution: PnpSolution | None) -> tuple[Bearing | None, Bearing | None]:
        """(long range, entrance) bearings of this frame."""
        pose = _NO_POSE if solution is None else solution.numbers
        found = find_sights(tracks.numbers, tracks.labels, pose, self._terms, self._followed)
        self._followed = int(found.item(FOLLOWED))
        return _bearing(found, LONG_RANGE), _bearing(found, ENTRANCE)


def _bearing(found: Array, start: int) -> Bearing | None:
    """One bearing out of what `find_sights` gives."""
    score, range_m = found.item(start + SCORE), found.item(start + RANGE)
    if score != score:
        return None
    return Bearing(
        found[start + RAY : start + CENTRE],
        found[start + CENTRE : start + SCORE],
        score,
        range_m if range_m == range_m else None,
    )
