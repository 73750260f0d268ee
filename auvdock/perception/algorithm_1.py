"""Paper A's association as printed (sections 4.1 to 4.3), beside `spatiotemporal`, which is what we make of it.

Algorithm 1, line by line: (1) candidates are tracks that occur often and surely enough within the window, surest first;
(2) with c the centroid of all candidates, a candidate p stays if another one lies within τ of 2 c - p; (3) those that
stay are sorted by angle about c and left to right, and are given B0 to B5 "based on predefined layout". Filtered
positions of the tracks go into PnP, predicted ones where a light is missing, up to the tracker's ten frames. The solver
goes by count: three or four lights the iterative one, five or more SQPnP. Where the mean reprojection error is above
its threshold, all names are cleared, algorithm 1 runs again in the same frame and the pose is solved once more.

What the paper leaves open and what is chosen here:

- τ: a share of the candidates' mean distance from c, so that it means the same at every range;
- the layout's angles: those of a vehicle that is upright and looks along the approach axis. A light is given the beacon
  nearest in angle, surest first, so that fewer than six can be named too;
- when algorithm 1 runs: whenever a beacon of the array has no name; its result counts if it names more;
- three lights: OpenCV's iterative solver needs a start for them, which is the last frame's pose; without one there is
  none;
- a pose is `measured` if three of its lights or more were detected in this frame, else it is predicted;
- no attitude enters, and nothing but the reprojection error judges a pose: the doubts of `perception.credibility` are
  ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import Detections
from auvdock.core.limits import Positive
from auvdock.perception.association import Associated, pose_estimate
from auvdock.perception.authentication import AuthenticationCfg
from auvdock.perception.pnp import Attitude, PnpCfg, PnpSolution, PnpSolver
from auvdock.perception.proposals import surest_lights
from auvdock.perception.tracker import LightTracker

__all__ = ["Algorithm1Association", "Algorithm1Cfg"]

_MIN_LIT = 3
_FACING = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
"""R_camera_station of an upright vehicle that looks into the mouth: image right is the station's y, down its -z."""


@dataclass(frozen=True)
class Algorithm1Cfg(Checked):
    """What paper A's algorithm 1 has of its own; occurrences, confidence and window are shared with ours."""

    symmetry: Positive = 0.25
    """τ of line 16 over the candidates' mean distance from their centroid (ours; the paper gives no figure)."""


class Algorithm1Association:
    """Names by algorithm 1, positions by the tracks, pose by the solver that the number of lights asks for."""

    def __init__(
        self,
        cfg: Algorithm1Cfg,
        authentication: AuthenticationCfg,
        pnp: PnpCfg,
        pixel_sigma_px: float,
        camera: Camera,
        layout: BeaconLayout,
    ) -> None:
        """Keep the array and the camera."""
        self._cfg, self._authentication = cfg, authentication
        self._sigma_px, self._max_reprojection_px = pixel_sigma_px, pnp.max_reprojection_px
        self._array_m = np.ascontiguousarray(layout.array_positions_m)
        self._angle = _angles((self._array_m - self._array_m.mean(axis=0)) @ _FACING.T)
        self._solver = PnpSolver(replace(pnp, attitude_prior_sigma_deg=0.0), camera)
        self.reset()

    def reset(self) -> None:
        """Forget the last pose."""
        self._last: PnpSolution | None = None

    def update(
        self,
        tracks: LightTracker,
        detections: Detections,
        attitude: Attitude,
        velocity_m_s: Array,
    ) -> Associated:
        """Process one frame; writes `tracks.beacon_id`."""
        named = int(np.count_nonzero(tracks.beacon_id >= 0))
        if named < len(self._array_m):
            identity = self.authenticate(tracks)
            if np.count_nonzero(identity >= 0) > named:
                tracks.beacon_id[:] = identity
        solution = self._solve(tracks, attitude)
        if solution is not None and solution.error_px > self._max_reprojection_px:
            tracks.beacon_id[:] = self.authenticate(tracks)
            solution = self._solve(tracks, attitude)
            if solution is not None and solution.error_px > self._max_reprojection_px:
                tracks.beacon_id[:] = -1
                solution = None
        self._last = solution
        if solution is None:
            return Associated()
        carried = tracks.beacon_id >= 0
        seen = int(np.count_nonzero(carried & (tracks.detection >= 0)))
        ids = tuple(tracks.beacon_id[carried].tolist())
        return Associated(pose_estimate(solution, ids, seen >= _MIN_LIT), seen, solution)

    def authenticate(self, tracks: LightTracker) -> IntArray:
        """(n,) beacon of each track by algorithm 1, -1 for none."""
        cfg = self._authentication
        identity = np.full(len(tracks), -1, dtype=np.int64)
        candidates = surest_lights(
            tracks.table, tracks.scores, cfg.min_occurrences, cfg.min_confidence, cfg.max_candidates
        )
        if len(candidates) < 2:
            return identity
        place = tracks.centre_px[candidates]
        centre = place.mean(axis=0)
        valid = self._symmetric(place, centre)
        free = np.ones(len(self._array_m), dtype=bool)
        for row in valid:  # surest first
            if not free.any():
                break
            turn = np.abs(np.remainder(_angles(place[row][None] - centre) - self._angle + math.pi, math.tau) - math.pi)
            beacon = int(np.argmin(np.where(free, turn, math.inf)))
            identity[candidates[row]], free[beacon] = beacon, False
        return identity

    def _symmetric(self, place: Array, centre: Array) -> list[int]:
        """Rows of the candidates (n, 2) whose mirror point about the centroid another one takes, in their order."""
        reach = self._cfg.symmetry * float(np.linalg.norm(place - centre, axis=1).mean())
        matched: set[int] = set()
        for p in range(len(place)):
            if p in matched:
                continue
            mirror = 2.0 * centre - place[p]
            for q in range(len(place)):
                if q != p and q not in matched and np.linalg.norm(mirror - place[q]) <= reach:
                    matched |= {p, q}
                    break
        return sorted(matched)

    def _solve(self, tracks: LightTracker, attitude: Attitude) -> PnpSolution | None:
        """The pose of all tracks that carry a name, where they are or are predicted to be."""
        carried = np.flatnonzero(tracks.beacon_id >= 0)
        points = self._array_m[tracks.beacon_id[carried]]
        sigma = np.full(len(carried), self._sigma_px)
        return self._solver.by_count(points, tracks.centre_px[carried], sigma, attitude, self._last)


def _angles(offset: Array) -> Array:
    """(n,) angle of offsets (n, 2 or 3) in the image."""
    return np.arctan2(offset[:, 1], offset[:, 0])
