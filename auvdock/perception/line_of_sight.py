"""Bearings without a pose: the far lamp or the blue group as a whole, and the red entrance lamps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import Bearing
from auvdock.core.limits import Count, PositiveShare, at_least
from auvdock.numeric.lights import Solution
from auvdock.perception.pnp import PnpSolution, lens_of
from auvdock.perception.sights import ENTRANCE, LONG_RANGE, SightLaw, find_sights, spread_m
from auvdock.perception.tracker import LightTracker

__all__ = ["LineOfSight", "LineOfSightCfg"]

_NO_SOLUTION = Solution.zeros(0)


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
        lights = layout.positions_m
        blue, red = list(layout.indices("array") + layout.indices("long_range")), list(layout.indices("entrance"))
        self._law = SightLaw(
            lens=lens_of(camera),
            blue_spread_m=spread_m(lights[blue]),
            red_spread_m=spread_m(lights[red]) if len(red) > 1 else 0.0,
            centre_m=layout.array_positions_m.mean(axis=0),
            min_occurrences=cfg.min_occurrences,
            max_missed=cfg.max_missed,
            group_size=cfg.group_size,
            loyalty=cfg.loyalty,
        ).packed()
        self.reset()

    def reset(self) -> None:
        """Forget which light was followed."""
        self._followed = -1

    def update(self, tracks: LightTracker, solution: PnpSolution | None) -> tuple[Bearing | None, Bearing | None]:
        """(long range, entrance) bearings of this frame."""
        record = _NO_SOLUTION if solution is None else solution.record
        sights, self._followed = find_sights(tracks.table, tracks.scores, record, self._law, self._followed)
        rows = sights.tolist()
        return _bearing(*rows[LONG_RANGE]), _bearing(*rows[ENTRANCE])


def _bearing(ray_camera: Array, pixel: Array, score: float, range_m: float) -> Bearing | None:
    """One bearing out of what `find_sights` gives."""
    if score != score:
        return None
    return Bearing(ray_camera, pixel, score, range_m if range_m == range_m else None)
