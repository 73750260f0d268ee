"""Spatiotemporal association: authenticate once, then let the tracks carry the identities (paper A, section 4)."""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, Detections
from auvdock.numeric.lights import Light
from auvdock.numeric.records import Records
from auvdock.perception.association import Associated, pose_estimate
from auvdock.perception.authentication import AuthenticationCfg, Authenticator
from auvdock.perception.credibility import Credibility, CredibilityCfg
from auvdock.perception.labelled import Owner, gather_lights
from auvdock.perception.pnp import Attitude, PnpCfg, PnpSolution, PnpSolver
from auvdock.perception.tracker import LightTracker

__all__ = ["SpatiotemporalAssociation"]

_MAX_POSE_AGE = 10
"""Frames after which the last pose no longer helps to solve the next."""
_MAX_DOUBTED = 3
"""Frames in a row whose pose is not believed, though it reprojects well, before the identities are given up."""
_MIN_LIT = 3
_REACQUIRE = 0.15
_REACQUIRE_PX = 2.0


class SpatiotemporalAssociation:
    """Keeps identities over time.

    Every frame: solve the pose from the lights that carry an identity; verify it; if it fails, drop the worst light,
    and if that does not mend it, drop all identities and authenticate again in the same frame. Where the lights
    reproject well but the pose is not to be believed, there is none; the identities go if it lasts. They stay where two
    poses are about as likely. Lights that appear where a lost beacon must be are given its identity.

    A pose is `measured` when at least three authenticated beacons were detected in this frame. With four or more it
    rests on them alone; with three, the predicted positions of the others support it (weighted by their tracks'
    variance) where they agree with what is seen, or the last pose where no track is left to predict. With fewer it is
    solved from four or more detected or predicted positions and is not `measured`; below that there is no pose.
    """

    def __init__(
        self,
        cfg: AuthenticationCfg,
        pnp: PnpCfg,
        credibility: CredibilityCfg,
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
        self._lights, self._owners = Light.zeros(len(self._array_m)), Owner.zeros(len(self._array_m))
        self._rate_hz = camera.rate_hz
        self._size_px = (camera.width_px, camera.height_px)
        self._focal_px = float(camera.matrix[0, 0])
        radius = np.linalg.norm(self._array_m - self._array_m.mean(axis=0), axis=1)
        self._radius_m = float(radius.mean())
        others = [index for index in layout.indices("long_range")]
        # The array first, then lights that must not be mistaken for it.
        self._blue_m = np.ascontiguousarray(np.vstack([self._array_m, layout.positions_m[others]]))
        self._authenticator = Authenticator(cfg, self._array_m, self._focal_px)
        self._solver = PnpSolver(pnp, camera)
        self._credibility = Credibility(credibility, camera, self._blue_m, math.radians(pnp.attitude_prior_sigma_deg))
        self._min_log_odds = credibility.min_log_odds
        self._attitude_sigma_rad = math.radians(pnp.attitude_sigma_deg)
        self.reset()

    def reset(self) -> None:
        """Forget the last pose."""
        self._last: PnpSolution | None = None
        self._believed: PnpSolution | None = None
        self._age = 0
        self._way_m: Array = np.zeros(3)
        self._noise = 1.0
        self._doubted = 0
        self._heading_known = True

    def update(
        self,
        tracks: LightTracker,
        detections: Detections,
        attitude: Attitude,
        velocity_m_s: Array,
    ) -> Associated:
        """Process one frame; writes `tracks.beacon_id`."""
        sigma = attitude.heading_sigma_rad
        self._heading_known = sigma is None or sigma <= self._attitude_sigma_rad
        self._age += 1
        self._way_m = attitude.rotation.T.dot(velocity_m_s) * (self._age / self._rate_hz)
        if self._age > _MAX_POSE_AGE:
            self._last = self._believed = None
            self._noise = 1.0
        result = self._solve_labelled(tracks, detections, attitude)
        if result is None and self._authenticate(tracks, attitude):
            result = self._solve_labelled(tracks, detections, attitude)
        if result is None:
            return Associated()
        if result.solution is not None and result.array_count >= _MIN_LIT:
            self._last = self._believed = result.solution
            self._age = 0
            if result.array_count < len(self._array_m):
                self._reacquire(tracks, result.solution)
        return result

    def _solve_labelled(self, tracks: LightTracker, detections: Detections, prior: Attitude) -> Associated | None:
        """Pose from the tracks that carry an identity; clears all identities and returns None if it does not hold."""
        count, seen = gather_lights(
            tracks.table,
            detections.centre_px,
            detections.xyxy,
            self._size_px,
            self._array_m,
            self._sigma_px * math.sqrt(self._noise),
            self._lights,
            self._owners,
        )
        if count == 0:
            return None
        lights, owners = self._lights[:count], self._owners[:count]
        enough = count >= 4 or (seen == _MIN_LIT and self._last is not None)
        if not enough:
            if count < _MIN_LIT:
                tracks.beacon_id[:] = -1
            return None
        solution = self._solved(lights, seen, prior)
        if seen == _MIN_LIT < count and (solution is None or solution.cost > self._credibility.expected_cost(count)):
            there = lights["is_seen"]
            alone = self._solved(lights[there], seen, prior)
            if alone is not None and self._is_believed(alone):
                solution, lights, owners = alone, lights[there], owners[there]
        believed = solution is not None and self._is_believed(solution)
        if seen >= 5 and not believed:
            better, worst = self._without_worst(lights, prior)
            if better is not None:
                tracks.beacon_id[owners["track"][worst]] = -1
                rest = np.arange(len(lights)) != worst
                lights, owners = lights[rest], owners[rest]
                solution, seen, believed = better, len(owners), True
        if solution is not None and seen >= _MIN_LIT:
            self._noise = self._credibility.noise_after(self._noise, solution)
        if not believed:
            self._doubted += 1
            if solution is not None and self._doubted <= _MAX_DOUBTED:
                return Associated()
            tracks.beacon_id[:] = -1
        if solution is None or not believed:
            return None
        self._doubted = 0
        if not self._heading_known:
            solution, is_alone = self._likelier(solution, lights, prior)
            if not is_alone:
                self._last, self._believed, self._age = solution, None, 0
                return Associated()
        ids = tuple(owners["beacon"].tolist())
        return Associated(pose_estimate(solution, ids, seen >= _MIN_LIT), seen, solution)

    def _solved(self, lights: Records[Light], seen: int, prior: Attitude) -> PnpSolution | None:
        """The pose of the given lights if those of them that were seen reproject well."""
        solution = self._solver.solve_lights(lights, prior, self._last)
        if solution is None or (seen and solution.error_px > self._pnp.max_reprojection_px):
            return None
        return solution

    def _is_believed(self, solution: PnpSolution) -> bool:
        """Whether a pose can be right, by itself and after the last one that was."""
        return self._credibility.holds(solution, self._heading_known) and self._follows(solution)

    def _follows(self, solution: PnpSolution) -> bool:
        """Whether a pose can come after the last one that was believed."""
        before, elapsed_s = self._believed, self._age / self._rate_hz
        return before is None or self._credibility.follows(solution, before, self._way_m, elapsed_s)

    def _likelier(self, solution: PnpSolution, lights: Records[Light], prior: Attitude) -> tuple[PnpSolution, bool]:
        """The likelier of a pose and the other one of its plane, and whether it is so by far and to be believed."""
        other = self._solver.mirrored(solution, lights, prior)
        if other is not None and other.cost < solution.cost:
            solution, other = other, solution
        return solution, self._credibility.is_alone(solution, other) and self._is_believed(solution)

    def _without_worst(self, lights: Records[Light], prior: Attitude) -> tuple[PnpSolution | None, int]:
        """Leave one of the seen lights out: a single stray light must not cost the identities of all."""
        best: PnpSolution | None = None
        left_out, every = 0, np.arange(len(lights))
        for index in range(len(lights)):
            solution = self._solved(lights[every != index], len(lights) - 1, prior)
            if solution is None or not self._is_believed(solution):
                continue
            if best is None or solution.error_px < best.error_px:
                best, left_out = solution, index
        return best, left_out

    def _authenticate(self, tracks: LightTracker, prior: Attitude) -> bool:
        """Name the beacons among the unnamed; True if a proposal holds."""
        if len(tracks) < self._cfg.min_beacons:
            return False
        chosen = self._authenticator.candidates(tracks)
        if len(chosen) < self._cfg.min_beacons:
            return False
        pixels = tracks.centre_px[chosen]
        blue = np.flatnonzero(tracks.class_id == BLUE)
        others = tracks.centre_px[np.setdiff1d(blue, chosen)]
        self._last = None
        for identity in self._authenticator.propose(self._camera.normalise(pixels), prior.rotation):
            settled = self._settle(pixels, identity, prior, others)
            if settled is not None:
                identity, self._last = settled
                found = np.flatnonzero(identity >= 0)
                tracks.beacon_id[:] = -1
                tracks.beacon_id[chosen[identity[found]]] = found
                self._doubted = 0
                return True
        return False

    def _settle(
        self, pixels: Array, identity: IntArray, prior: Attitude, others_px: Array
    ) -> tuple[IntArray, PnpSolution] | None:
        """Solve, look again where all beacons must be, and solve again; None if the identities do not hold.

        `others_px` (m, 2) are blue lights that are no candidates, but may be beacons all the same.
        """
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
            again = self._match(solution, pixels)
            if np.array_equal(again, identity):
                return (identity, solution) if self._likely(solution, identity, prior, pixels, others_px) else None
            identity = again
        return None

    def _likely(
        self, solution: PnpSolution, identity: IntArray, prior: Attitude, pixels: Array, others_px: Array
    ) -> bool:
        """Whether new identities hold: a good fit, and far likelier than spurious lights in those places."""
        if solution.error_px > self._pnp.max_reprojection_px or not self._is_believed(solution):
            return False
        unused = np.setdiff1d(np.arange(len(self._blue_m)), np.flatnonzero(identity >= 0))
        others_px = np.vstack([np.delete(pixels, identity[identity >= 0], axis=0), others_px])
        odds = self._credibility.log_odds(solution, unused, others_px, self._sigma_px, prior.heading_sigma_rad)
        return odds >= self._min_log_odds

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
        identity = self._match(solution, tracks.centre_px[fresh])
        carried = tracks.beacon_id[tracks.detection >= 0]
        for beacon in np.flatnonzero(identity >= 0):
            if beacon not in carried:
                tracks.beacon_id[tracks.beacon_id == beacon] = -1
                tracks.beacon_id[fresh[identity[beacon]]] = beacon
