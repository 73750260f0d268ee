"""Spatiotemporal association: authenticate once, then let the tracks carry the identities (paper A, section 4)."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, Detections
from auvdock.perception.association import Associated, pose_estimate
from auvdock.perception.authentication import AuthenticationCfg, Authenticator
from auvdock.perception.pnp import PnpCfg, PnpSolution, PnpSolver
from auvdock.perception.tracker import LightTracker

__all__ = ["SpatiotemporalAssociation"]

_MAX_POSE_AGE = 10
"""Frames after which the last pose no longer helps to solve the next."""
_MIN_LIT = 3
_REACQUIRE = 0.15
_REACQUIRE_PX = 2.0
_FIRST = np.array(0)


class SpatiotemporalAssociation:
    """Keeps identities over time.

    Every frame: solve the pose from the lights that carry an identity; verify it by reprojection; if it fails, drop
    the worst light, and if that does not mend it, drop all identities and authenticate again in the same frame. Lights
    that appear where a lost beacon must be are given its identity.

    A pose is `measured` when at least three authenticated beacons were detected in this frame. With four or more it
    rests on them alone; with three, the predicted positions of the others support it (weighted by their tracks'
    variance), or the last pose where no track is left to predict. With fewer it is solved from four or more detected
    or predicted positions and is not `measured`; below that there is no pose.
    """

    def __init__(
        self,
        cfg: AuthenticationCfg,
        pnp: PnpCfg,
        pixel_sigma_px: float,
        camera: Camera,
        layout: BeaconLayout,
    ) -> None:
        """Build the authenticator and the solver for one camera and station."""
        self._cfg = cfg
        self._pnp = pnp
        self._sigma_px = pixel_sigma_px
        self._camera = camera
        self._array_m = np.ascontiguousarray(layout.array_positions_m)
        self._focal_px = float(camera.matrix[0, 0])
        radius = np.linalg.norm(self._array_m - self._array_m.mean(axis=0), axis=1)
        self._radius_m = float(radius.mean())
        others = [index for index in layout.indices("long_range")]
        # The array first, then lights that must not be mistaken for it.
        self._blue_m = np.ascontiguousarray(np.vstack([self._array_m, layout.positions_m[others]]))
        self._authenticator = Authenticator(cfg, self._array_m, self._focal_px)
        self._solver = PnpSolver(pnp, camera)
        self._sigmas_px = [np.full(count, pixel_sigma_px) for count in range(len(self._array_m) + 1)]
        self.reset()

    def reset(self) -> None:
        """Forget the last pose."""
        self._last: PnpSolution | None = None
        self._age = 0

    def update(
        self,
        tracks: LightTracker,
        detections: Detections,
        rotation_prior: Array,
        heading_sigma_rad: float | None = None,
    ) -> Associated:
        """Process one frame; writes `tracks.beacon_id`."""
        self._solver.heading_sigma_rad = heading_sigma_rad
        self._age += 1
        if self._age > _MAX_POSE_AGE:
            self._last = None
        result = self._solve_labelled(tracks, detections, rotation_prior)
        if result is None and self._authenticate(tracks, rotation_prior):
            result = self._solve_labelled(tracks, detections, rotation_prior)
        if result is None:
            return Associated()
        if result.solution is not None and result.array_count >= _MIN_LIT:
            self._last, self._age = result.solution, 0
            if result.array_count < len(self._array_m):
                self._reacquire(tracks, result.solution)
        return result

    def _solve_labelled(self, tracks: LightTracker, detections: Detections, prior: Array) -> Associated | None:
        """Pose from the tracks that carry an identity; clears all identities and returns None if it does not hold."""
        rows = (tracks.beacon_id >= _FIRST).nonzero()[0]
        if len(rows) == 0:
            return None
        rows = rows[tracks.beacon_id[rows].argsort()]
        seen = rows[tracks.detection[rows] >= _FIRST]
        if len(seen) >= 4:
            rows = seen
        enough = len(rows) >= 4 or (len(seen) == _MIN_LIT and self._last is not None)
        if not enough:
            if len(rows) < _MIN_LIT:
                tracks.beacon_id[:] = -1
            return None
        solution, error = self._verified(tracks, detections, rows, prior)
        if solution is None and len(seen) >= 5:
            solution, error, rows = self._without_worst(tracks, detections, rows, prior)
        if solution is None:
            tracks.beacon_id[:] = -1
            return None
        count = min(len(seen), len(rows)) if len(seen) >= 4 else len(seen)
        ids = tuple(tracks.beacon_id[rows].tolist())
        return Associated(pose_estimate(solution, ids, error, count >= _MIN_LIT), count, solution)

    def _verified(
        self, tracks: LightTracker, detections: Detections, rows: IntArray, prior: Array
    ) -> tuple[PnpSolution | None, float]:
        """The pose of the given tracks if it reprojects well, and its mean reprojection error."""
        detection = tracks.detection[rows]
        seen = detection >= _FIRST
        count = np.count_nonzero(seen)
        if count == len(rows):
            pixels = detections.centre_px.take(detection, 0)
            sigma = self._sigmas_px[count]
        else:
            pixels = tracks.state[rows, :2].copy()
            pixels[seen] = detections.centre_px[detection[seen]]
            sigma = np.where(seen, self._sigma_px, self._sigma_px + np.sqrt(tracks.covariance[rows, 0]))
        points = self._array_m.take(tracks.beacon_id[rows], 0)
        solution = self._solver.solve(points, pixels, sigma, prior, self._last)
        if solution is None:
            return None, 0.0
        residual = solution.residual_px[seen] if 0 < count < len(rows) else solution.residual_px
        error = float(np.add.reduce(residual)) / len(residual)
        if count and error > self._pnp.max_reprojection_px:
            return None, error
        return solution, error

    def _without_worst(
        self, tracks: LightTracker, detections: Detections, rows: IntArray, prior: Array
    ) -> tuple[PnpSolution | None, float, IntArray]:
        """Leave one light out: a single stray light must not cost the identities of all."""
        best: tuple[PnpSolution | None, float, IntArray] = (None, np.inf, rows)
        for index in range(len(rows)):
            kept = np.delete(rows, index)
            solution, error = self._verified(tracks, detections, kept, prior)
            if solution is not None and error < best[1]:
                best = (solution, error, kept)
        if best[0] is not None:
            dropped = np.setdiff1d(rows, best[2])
            tracks.beacon_id[dropped] = -1
        return best

    def _authenticate(self, tracks: LightTracker, prior: Array) -> bool:
        """Name the beacons among the unnamed; True if a proposal holds."""
        if len(tracks) < self._cfg.min_beacons:
            return False
        blue = np.flatnonzero((tracks.class_id == BLUE) & (tracks.detection >= 0))
        if len(blue) < self._cfg.min_beacons:
            return False
        chosen = blue[self._authenticator.candidates(tracks.occurrences()[blue], tracks.mean_confidence()[blue])]
        if len(chosen) < self._cfg.min_beacons:
            return False
        pixels = tracks.state[chosen, :2]
        self._last = None
        for identity in self._authenticator.propose(self._camera.normalise(pixels), prior):
            settled = self._settle(pixels, identity, prior)
            if settled is not None:
                identity, self._last = settled
                self._age = 0
                found = np.flatnonzero(identity >= 0)
                tracks.beacon_id[:] = -1
                tracks.beacon_id[chosen[identity[found]]] = found
                return True
        return False

    def _settle(self, pixels: Array, identity: IntArray, prior: Array) -> tuple[IntArray, PnpSolution] | None:
        """Solve, look again where all beacons must be, and solve again; None if the identities do not hold."""
        for _ in range(2):
            beacons = np.flatnonzero(identity >= 0)
            if len(beacons) < self._cfg.min_beacons:
                return None
            solution = self._solver.solve(
                self._array_m[beacons],
                pixels[identity[beacons]],
                np.full(len(beacons), self._sigma_px),
                prior,
            )
            if solution is None:
                return None
            error = float(solution.residual_px.mean())
            again = self._match(solution, pixels)
            if np.array_equal(again, identity):
                return (identity, solution) if error <= self._pnp.max_reprojection_px else None
            identity = again
        return None

    def _match(self, solution: PnpSolution, pixels: Array) -> IntArray:
        """(k,) the candidate at each array beacon's reprojection, -1 where there is none."""
        image = self._solver.project(solution, self._blue_m)
        gap = np.linalg.norm(image[:, None] - pixels[None], axis=2)
        owner = gap.argmin(axis=0)
        gate = self._gate_px(solution)
        identity = np.full(len(self._array_m), -1, dtype=np.int64)
        for beacon in range(len(self._array_m)):
            candidate = int(gap[beacon].argmin())
            if gap[beacon, candidate] <= gate and owner[candidate] == beacon:
                identity[beacon] = candidate
        return identity

    def _gate_px(self, solution: PnpSolution) -> float:
        return _REACQUIRE_PX + _REACQUIRE * self._focal_px * self._radius_m / float(solution.translation_m[2])

    def _reacquire(self, tracks: LightTracker, solution: PnpSolution) -> None:
        """Give lost beacons' identities to new lights at their reprojections."""
        fresh = (
            (tracks.beacon_id < 0) & (tracks.class_id == BLUE) & (tracks.detection >= 0) & (tracks.hits >= 2)
        ).nonzero()[0]
        if len(fresh) == 0:
            return
        identity = self._match(solution, tracks.state[fresh, :2])
        carried = tracks.beacon_id[tracks.detection >= 0]
        for beacon in np.flatnonzero(identity >= 0):
            if beacon not in carried:
                tracks.beacon_id[tracks.beacon_id == beacon] = -1
                tracks.beacon_id[fresh[identity[beacon]]] = beacon
