"""Which light is which beacon: paper A's algorithm 1, made to stand spurious lights and missing beacons.

Steps of the paper: (1) keep tracks seen often and surely enough within a window, surest first; (2) keep those whose
point-symmetric partner about the array's centre is there; (3) order by angle and hand out B0, B1, ... Step 2 of the
paper takes the centroid of *all* candidates as the centre, which two spurious lights, or the far lamp above the ring,
displace by more than its tolerance. Here every pair of candidates proposes itself as an opposite pair: its direction
gives its two identities (step 3: the vehicle knows how it is rolled), and with the vehicle's attitude its two images
fix where the array's centre and all other beacons must be. The proposal that finds most beacons there, and finds
them nearest, wins; the pose solver has the last word.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.checked import Checked
from auvdock.core.limits import AcuteDeg, Count, Positive, Share, at_least
from auvdock.perception.proposals import propose, surest_lights
from auvdock.perception.tracker import LightTracker

__all__ = ["AuthenticationCfg", "Authenticator", "every_pair", "symmetric_pairs"]


@dataclass(frozen=True)
class AuthenticationCfg(Checked):
    """When a light is believed to be a beacon."""

    min_occurrences: Count = 3
    """Detections within the tracker's window (algorithm 1, line 6)."""
    min_confidence: Share = 0.2
    """Mean score of those detections (algorithm 1, line 6)."""
    min_beacons: Annotated[int, at_least(4, "PnP needs 4")] = 4
    """Beacons that a proposal must find."""
    max_candidates: Count = 12
    """Only the surest candidates are tried."""
    max_angle_deg: AcuteDeg = 25.0
    """Greatest difference in direction between a pair in the image and the opposite pair it claims to be. The ring of
    six repeats every 60°, so 30° is the limit of what can be told apart."""
    tolerance: Positive = 0.2
    """Greatest distance between a candidate and where a beacon must be, over the array's radius in the image."""
    tolerance_px: Positive = 1.5
    """Added to it for noise."""
    pairs: Literal["opposite", "every"] = "opposite"
    """Pairs of beacons that two candidates may be taken for: opposite ones, whose images fix the array's place best,
    or every pair, so that an arc of the array is enough."""
    proposals: Count = 3
    """Best proposals handed to the pose solver."""


class Authenticator:
    """Proposes identities for the candidates of one frame."""

    def __init__(self, cfg: AuthenticationCfg, points_m: Array, focal_px: float) -> None:
        """Find the array's opposite pairs.

        Args:
            cfg: thresholds.
            points_m: (k, 3) array beacons in the station frame.
            focal_px: focal length, to turn pixels into angles.
        """
        self._cfg = cfg
        self._points = points_m
        self._pairs = symmetric_pairs(points_m) if cfg.pairs == "opposite" else every_pair(points_m)
        self._radius_m = float(np.linalg.norm(points_m - points_m.mean(axis=0), axis=1).mean())
        self._tolerance = cfg.tolerance_px / focal_px
        self._min_cosine = math.cos(math.radians(cfg.max_angle_deg))

    def candidates(self, tracks: LightTracker) -> IntArray:
        """Rows of the tracks that are seen often and surely enough, surest first (algorithm 1, lines 1 to 7)."""
        cfg = self._cfg
        return surest_lights(tracks.table, tracks.scores, cfg.min_occurrences, cfg.min_confidence, cfg.max_candidates)

    def propose(self, xy: Array, rotation: Array) -> IntArray:
        """Possible identities, best first.

        Args:
            xy: (n, 2) undistorted normalised image coordinates of the candidates.
            rotation: (3, 3) R_camera_station of the vehicle's own attitude.

        Returns:
            (m, k) for each proposal and array beacon the index of its candidate, -1 where it is not seen.
        """
        cfg = self._cfg
        return propose(
            xy,
            rotation,
            self._points,
            self._pairs,
            self._min_cosine,
            cfg.tolerance * self._radius_m,
            self._tolerance,
            cfg.min_beacons,
            cfg.proposals,
        )


def every_pair(points_m: Array) -> IntArray:
    """(p, 2) indices of every two beacons, the lower one first."""
    return np.array([(i, j) for i in range(len(points_m)) for j in range(i + 1, len(points_m))], dtype=np.int64)


def symmetric_pairs(points_m: Array) -> IntArray:
    """(p, 2) index pairs of beacons that lie opposite each other about the centroid; all pairs if fewer than two do."""
    centre = points_m.mean(axis=0)
    radius = float(np.linalg.norm(points_m - centre, axis=1).max())
    every = every_pair(points_m)
    gap = np.linalg.norm(points_m[every[:, 0]] + points_m[every[:, 1]] - 2.0 * centre, axis=1)
    opposite = every[gap < 0.05 * radius]
    return opposite if len(opposite) >= 2 else every
