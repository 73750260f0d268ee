"""Which spot is which light: hypotheses from pairs, with the vehicle's own attitude.

With the attitude known, two named lights determine the camera's place: x (q_z + t_z) = q_x + t_x and the same in y,
q = R X. So every pair of spots is tried as every pair of lights; the compass's error shows as a turn of the pair in the
image and is taken out. Each hypothesis says where all lights must be, and the one that finds most of them wins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from auvdock.core.arrays import Array, BoolArray, IntArray

__all__ = ["Hypothesis", "hypotheses", "match"]

_MAX_TURN_RAD = math.radians(12.0)
_MIN_DEPTH_M, _MAX_DEPTH_M = 0.1, 30.0
_SPREAD = 0.04
"""Share of the pattern's size in the image by which tilt and perspective may displace a light from its hypothesis."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A way to name the spots.

    Attributes:
        spot: (m,) index of each light's spot, -1 for none.
        rotation: (3, 3) R_camera_station, the attitude with the compass's error taken out.
        translation_m: (3,) t of p_camera = R p + t.
        count: lights named.
        error: mean squared distance in normalised coordinates.
    """

    spot: IntArray
    rotation: Array
    translation_m: Array
    count: int
    error: float


def hypotheses(
    points_m: Array, xy: Array, rotation: Array, gate: float, heights_m: tuple[float, float]
) -> list[Hypothesis]:
    """Different namings that find three lights or more, most lights first, then least error.

    Args:
        points_m: (m, 3) the lights in the station frame.
        xy: (n, 2) the spots in normalised image coordinates.
        rotation: (3, 3) R_camera_station by the vehicle's own attitude.
        gate: normalised distance within which a spot is a light's, for a hypothesis that is exact.
        heights_m: least and greatest height of the camera above the station's origin.
    """
    m, n = len(points_m), len(xy)
    if m < 3 or n < 3:
        return []
    lights = np.array(list(combinations(range(m), 2)))
    first, second = (index.ravel() for index in np.divmod(np.arange(n * n), n))
    spots = np.column_stack([first, second])[first != second]
    a, b = np.repeat(lights, len(spots), axis=0).T
    i, j = np.tile(spots, (len(lights), 1)).T
    q = points_m @ rotation.T
    turn, translation, good = _place(q, xy, a, b, i, j)
    height = -(rotation.T @ translation.T)[2]
    good &= (height >= heights_m[0]) & (height <= heights_m[1])
    if not good.any():
        return []
    turn, translation = turn[good], translation[good]
    image = _image(q, turn, translation)
    scale = float(np.ptp(points_m[:, :2], axis=0).max()) / translation[:, 2]
    limit = gate + _SPREAD * scale
    gap = ((image[:, :, None, :] - xy) ** 2).sum(axis=3)
    spot = gap.argmin(axis=2)
    near = np.take_along_axis(gap, spot[:, :, None], axis=2)[:, :, 0]
    hit = near <= (limit * limit)[:, None]
    spot = np.where(hit, spot, -1)
    count = hit.sum(axis=1)
    error = np.where(hit, near, 0.0).sum(axis=1) / np.maximum(count, 1)
    return _distinct(spot, count, error, turn, translation, rotation)


def _place(q: Array, xy: Array, a: IntArray, b: IntArray, i: IntArray, j: IntArray) -> tuple[Array, Array, BoolArray]:
    """Turn about the optical axis (h,), translation (h, 3) and whether it makes sense, for each pair of pairs."""
    # The pair's rays weighted by depth: (q_z,a + t_z) xy_i - (q_z,b + t_z) xy_j = q_xy,a - q_xy,b.
    want = q[a, :2] - q[b, :2]
    seen = xy[i] - xy[j]
    uneven = q[a, 2][:, None] * xy[i] - q[b, 2][:, None] * xy[j]
    length2 = (seen * seen).sum(axis=1)
    good = length2 > 1e-10
    safe = np.where(good, length2, 1.0)
    # Turned by the angle between what is wanted and what is seen, both are parallel and the depth is their ratio.
    turn = np.arctan2(
        want[:, 0] * seen[:, 1] - want[:, 1] * seen[:, 0], want[:, 0] * seen[:, 0] + want[:, 1] * seen[:, 1]
    )
    c, s = np.cos(turn), np.sin(turn)
    turned = np.column_stack([c * want[:, 0] - s * want[:, 1], s * want[:, 0] + c * want[:, 1]])
    depth = ((turned - uneven) * seen).sum(axis=1) / safe
    middle = 0.5 * (q[a] + q[b])
    centre = np.column_stack([c * middle[:, 0] - s * middle[:, 1], s * middle[:, 0] + c * middle[:, 1]])
    at = 0.5 * ((q[a, 2] + depth)[:, None] * xy[i] + (q[b, 2] + depth)[:, None] * xy[j])
    translation = np.column_stack([at - centre, depth])
    near = depth + np.minimum(q[:, 2].min(), 0.0)
    good &= (np.abs(turn) <= _MAX_TURN_RAD) & (near >= _MIN_DEPTH_M) & (depth <= _MAX_DEPTH_M)
    return turn, translation, good


def _image(q: Array, turn: Array, translation: Array) -> Array:
    """(h, m, 2) normalised images of all lights under each hypothesis."""
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    depth = q[:, 2] + translation[:, 2:]
    u = (c * q[:, 0] - s * q[:, 1] + translation[:, :1]) / depth
    v = (s * q[:, 0] + c * q[:, 1] + translation[:, 1:2]) / depth
    return np.stack([u, v], axis=2)


def _distinct(
    spot: IntArray, count: IntArray, error: Array, turn: Array, translation: Array, rotation: Array
) -> list[Hypothesis]:
    """The best hypothesis of each naming; no spot serves two lights."""
    found: list[Hypothesis] = []
    named: set[tuple[int, ...]] = set()
    for row in np.lexsort((error, -count)).tolist():
        if count[row] < 3 or len(found) >= 8:
            break
        key = tuple(spot[row].tolist())
        used = [index for index in key if index >= 0]
        if key in named or len(set(used)) < len(used):
            continue
        named.add(key)
        c, s = math.cos(turn[row]), math.sin(turn[row])
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
        found.append(Hypothesis(spot[row], turned, translation[row], int(count[row]), float(error[row])))
    return found


def match(image_px: Array, spots_px: Array, gate_px: Array) -> IntArray:
    """(m,) index of each light's spot: the nearest within its gate, if it is no other light's nearest; -1 for none.

    Args:
        image_px: (m, 2) where the lights are expected.
        spots_px: (n, 2) the spots.
        gate_px: (m,) farthest distance for each light.
    """
    m = len(image_px)
    named = np.full(m, -1, dtype=np.int64)
    if len(spots_px) == 0:
        return named
    gap = np.linalg.norm(image_px[:, None] - spots_px, axis=2)
    owner = gap.argmin(axis=0)
    nearest = gap.argmin(axis=1)
    for light, spot in enumerate(nearest.tolist()):
        if gap[light, spot] <= gate_px[light] and owner[spot] == light:
            named[light] = spot
    return named
