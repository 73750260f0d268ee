"""The bearing to the group of lights while there is no pose."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, Bearing
from auvdock.perception.tracker import LightTracker

__all__ = ["group_bearing"]

_MIN_HITS = 3
_MAX_MISSED = 5


def group_bearing(tracks: LightTracker, camera: Camera, points_m: Array) -> Bearing | None:
    """Bearing to the centre of the steady blue lights, strays left out; None if there is none.

    From three lights on with a rough range: the spread of the station's lights over that of the angles.

    Args:
        tracks: the tracks after this frame.
        camera: the camera.
        points_m: (m, 3) the station's lights.
    """
    steady = (tracks.class_id == BLUE) & (tracks.hits >= _MIN_HITS) & (tracks.missed <= _MAX_MISSED)
    rows = np.flatnonzero(steady)
    if len(rows) == 0:
        return None
    centre = np.median(tracks.centre_px[rows], axis=0)
    distance = np.linalg.norm(tracks.centre_px[rows] - centre, axis=1)
    rows = rows[distance <= 3.0 * float(np.median(distance)) + 2.0]
    xy = camera.normalise(tracks.centre_px[rows])
    mean = xy.mean(axis=0)
    ray = np.array([*mean.tolist(), 1.0])
    ray /= np.linalg.norm(ray)
    range_m = None
    if len(rows) >= 3:
        spread = math.sqrt(float(((xy - mean) ** 2).sum(axis=1).mean()))
        size = points_m[:, :2] - points_m[:, :2].mean(axis=0)
        if spread > 1e-3:
            range_m = math.sqrt(float((size**2).sum(axis=1).mean())) / spread
    score = float(min(tracks.mean_confidence()[rows].mean(), 1.0))
    return Bearing(ray, camera.project(ray[None])[0], score, range_m)
