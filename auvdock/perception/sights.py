"""Steady lights, their groups and their bearings in one compiled call: the loops of `perception.line_of_sight`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import BLUE, RED
from auvdock.numeric.lens import FX, pixel_of, tangents_of
from auvdock.numeric.lights import Solution
from auvdock.numeric.records import Record, Records, new_rows
from auvdock.numeric.tracks import Track, window_of

__all__ = ["ENTRANCE", "LONG_RANGE", "Sight", "SightLaw", "find_sights", "spread_m"]

LONG_RANGE, ENTRANCE = 0, 1
"""Rows of the two bearings."""


@dataclass(frozen=True)
class SightLaw(Record):
    """Camera, spread and place of the lights, and what makes a light steady."""

    lens: Annotated[Array, 9]
    """As `numeric.lens` names it."""
    blue_spread_m: float
    """`spread_m` of the blue lights."""
    red_spread_m: float
    """That of the red ones, 0 where there is one only."""
    centre_m: Annotated[Array, 3]
    """Of the array, in the station frame."""
    min_occurrences: int
    max_missed: int
    group_size: int
    loyalty: float
    """These four as `LineOfSightCfg` has them."""


@dataclass
class Sight(Record):
    """A bearing."""

    ray_camera: Annotated[Array, 3]
    """Unit ray."""
    pixel: Annotated[Array, 2]
    """u, v in px."""
    score: float
    """Confidence, nan where there is no bearing."""
    range_m: float
    """nan where it carries none."""


@dataclass
class _Steady(Record):
    """A steady light."""

    u_px: float
    v_px: float
    weight: float
    """Mean score over the window."""
    track_id: int
    away_px: float
    """Distance from the lights' median."""


_SIGHT, _STEADY = Sight.dtype(), _Steady.dtype()


@compiled
def find_sights(
    tracks: Records[Track], scores: Array, solution: Records[Solution], law: Records[SightLaw], followed: int
) -> tuple[Records[Sight], int]:
    """Long-range and entrance bearings of a frame.

    Args:
        tracks: (n,) tracks.
        scores: (n, window) their scores in the last frames.
        solution: (1,) pose of the station in the camera frame; (0,) for none.
        law: the settings.
        followed: track id of the single light that was followed last, -1 for none.

    Returns:
        (2,) the long-range bearing and the entrance's, and the track followed now.
    """
    sights: Records[Sight] = new_rows(2, dtype=_SIGHT)
    sights[LONG_RANGE].score = sights[ENTRANCE].score = np.nan
    lights: Records[_Steady] = new_rows(len(tracks), dtype=_STEADY)
    count = _gather(tracks, scores, RED, law[0], lights)
    if count > 0:
        _sight_group(lights[:count], law[0].red_spread_m, law[0].lens, sights[ENTRANCE])
    if len(solution) > 0:
        _sight_centre(solution[0], law[0], sights[LONG_RANGE])
        return sights, followed
    count = _gather(tracks, scores, BLUE, law[0], lights)
    if count >= law[0].group_size:
        _sight_group(lights[:count], law[0].blue_spread_m, law[0].lens, sights[LONG_RANGE])
    elif count > 0:
        best = lights[_single(lights[:count], followed, law[0].loyalty)]
        followed = best.track_id
        _sight(best.u_px, best.v_px, best.weight, np.nan, law[0].lens, sights[LONG_RANGE])
    return sights, followed


@compiled
def _gather(tracks: Records[Track], scores: Array, class_id: int, law: SightLaw, lights: Records[_Steady]) -> int:
    """Put the steady lights of a class into the first rows; their number."""
    count = 0
    for i in range(len(tracks)):
        track, least = tracks[i], law.min_occurrences
        if track.class_id != class_id or track.hits < least or track.missed > law.max_missed:
            continue
        occurrences, total = window_of(scores[i])
        if occurrences >= least:
            light = lights[count]
            light.u_px, light.v_px = track.centre_px[0], track.centre_px[1]
            light.weight, light.track_id = total / scores.shape[1], track.track_id
            count += 1
    return count


@compiled
def _surest(lights: Records[_Steady]) -> int:
    """The first light of the greatest weight."""
    best = 0
    for i in range(1, len(lights)):
        if lights[i].weight > lights[best].weight:
            best = i
    return best


@compiled
def _single(lights: Records[_Steady], followed: int, loyalty: float) -> int:
    """The brightest and steadiest light: greatest sum of scores over the window, with loyalty to the last."""
    best = _surest(lights)
    for i in range(len(lights)):
        if lights[i].track_id == followed and lights[i].weight >= loyalty * lights[best].weight:
            return i
    return best


@compiled
def _sight_group(lights: Records[_Steady], spread_m: float, lens: Array, sight: Sight) -> None:
    """Bearing of the group's centre, strays left out; range = spread of the layout over spread of the angles."""
    n = _drop_strays(lights)
    u = v = score = 0.0
    for i in range(n):
        u += lights[i].u_px
        v += lights[i].v_px
        score += lights[i].weight
    u, v, score = u / n, v / n, score / n
    range_m = np.nan
    if n >= 3 and spread_m > 0.0:
        square = 0.0
        for i in range(n):
            square += (lights[i].u_px - u) ** 2 + (lights[i].v_px - v) ** 2
        square /= n
        if square > 1.0:
            range_m = spread_m * lens[FX] / math.sqrt(square)
    _sight(u, v, score, range_m, lens, sight)


@compiled
def _drop_strays(lights: Records[_Steady]) -> int:
    """Move lights within three median distances of the component-wise median to the front; their number.

    Of two lights that is the surer one.
    """
    if len(lights) < 3:
        lights[0] = lights[_surest(lights)]
        return 1
    u, v = _upper_median(lights["u_px"]), _upper_median(lights["v_px"])
    for i in range(len(lights)):
        lights[i].away_px = math.hypot(lights[i].u_px - u, lights[i].v_px - v)
    limit = 3.0 * _upper_median(lights["away_px"]) + 2.0
    kept = 0
    for i in range(len(lights)):
        if lights[i].away_px <= limit:
            lights[kept] = lights[i]
            kept += 1
    return kept


@compiled
def _upper_median(values: Array) -> float:
    """The median of numbers (n,), of an even number of them the upper one."""
    n = len(values)
    for i in range(n):
        below = 0
        for k in range(n):
            if values[k] < values[i] or (values[k] == values[i] and k < i):
                below += 1
        if below == n // 2:
            return values[i]
    return np.nan


@compiled
def _sight_centre(solution: Solution, law: SightLaw, sight: Sight) -> None:
    """Bearing of the array's centre under a pose."""
    centre, place = np.empty(3), law.centre_m
    for i in range(3):
        centre[i] = solution.rotation[i, 0] * place[0] + solution.rotation[i, 1] * place[1]
        centre[i] += solution.rotation[i, 2] * place[2]
        centre[i] += solution.pose.translation_m[i]
    sight.range_m = math.sqrt(centre[0] * centre[0] + centre[1] * centre[1] + centre[2] * centre[2])
    for i in range(3):
        sight.ray_camera[i] = centre[i] / sight.range_m
    sight.pixel[0], sight.pixel[1] = pixel_of(centre[0] / centre[2], centre[1] / centre[2], law.lens)
    sight.score = 1.0


@compiled
def _sight(u: float, v: float, score: float, range_m: float, lens: Array, sight: Sight) -> None:
    """Bearing of a pixel."""
    x, y = tangents_of(u, v, lens)
    scale = 1.0 / math.sqrt(1.0 + x * x + y * y)
    sight.ray_camera[0], sight.ray_camera[1], sight.ray_camera[2] = x * scale, y * scale, scale
    sight.pixel[0], sight.pixel[1] = u, v
    sight.score, sight.range_m = min(score, 1.0), range_m


def spread_m(positions_m: Array) -> float:
    """RMS distance from the centroid, across the approach axis: what the camera sees of it from afar."""
    across = positions_m[:, 1:] - positions_m[:, 1:].mean(axis=0)
    return float(np.sqrt((across**2).sum(axis=1).mean()))
