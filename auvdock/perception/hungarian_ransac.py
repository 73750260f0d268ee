"""The comparison of paper A, section 6.2: Hungarian matching frame to frame, RANSAC, plain PnP; no memory beyond that.

The program that the paper's authors published differs from its text: its RANSAC hands three points to a solver that
refuses them, so it never rejects anything, and on failure it repeats the last pose as if it were new. Here RANSAC works
(P3P on four points), lights that are off by its threshold lose their names, and where those that keep theirs are not
all or do not reproject as their noise allows, all are named anew in the same frame. A frame without a pose has none;
`hold_last` repeats the last pose instead, marked as not measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array, IntArray
from auvdock.core.beacons import BeaconLayout
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.contracts import BLUE, Detections
from auvdock.core.limits import Count, Positive
from auvdock.perception.association import Associated, pose_estimate
from auvdock.perception.credibility import Credibility, CredibilityCfg
from auvdock.perception.pnp import Attitude, PnpCfg, PnpSolver
from auvdock.perception.solvers import ransac
from auvdock.perception.tracker import LightTracker

__all__ = ["HungarianRansacAssociation", "HungarianRansacCfg"]


@dataclass(frozen=True)
class HungarianRansacCfg(Checked):
    """Settings of the comparison."""

    gate_px: Positive = 25.0
    """Greatest distance of a light from where its beacon was in the last frame."""
    ransac_px: Positive = 5.0
    """Inlier threshold (published program: 5)."""
    ransac_iterations: Count = 100
    """Published program: 100."""
    hold_last: bool = False
    """Repeat the last pose on failure, marked as not measured."""


class HungarianRansacAssociation:
    """Identities from the last frame's positions, or by angular order when there are none.

    First labelling: the k surest blue lights, k the array's size, sorted by angle about their centroid and matched with
    the array's own angles as the vehicle's attitude turns them (cyclic shift of least error).
    """

    def __init__(
        self,
        cfg: HungarianRansacCfg,
        pnp: PnpCfg,
        credibility: CredibilityCfg,
        pixel_sigma_px: float,
        camera: Camera,
        layout: BeaconLayout,
    ) -> None:
        """Keep the array and the camera."""
        self._cfg = cfg
        self._sigma_px = pixel_sigma_px
        self._camera = camera
        self._array_m = np.ascontiguousarray(layout.array_positions_m)
        self._max_reprojection_px = pnp.max_reprojection_px
        self._solver = PnpSolver(replace(pnp, attitude_prior_sigma_deg=0.0), camera)
        self._credibility = Credibility(credibility, camera, self._array_m, attitude_sigma_rad=0.0)
        self.reset()

    def reset(self) -> None:
        """Forget the last frame."""
        self._ids: IntArray = np.zeros(0, dtype=np.int64)
        self._pixels: Array = np.zeros((0, 2))
        self._held: Associated | None = None

    def update(
        self,
        tracks: LightTracker,
        detections: Detections,
        attitude: Attitude,
        velocity_m_s: Array,
    ) -> Associated:
        """Process one frame; writes `tracks.beacon_id`."""
        tracks.beacon_id[:] = -1
        blue = np.flatnonzero(detections.class_id == BLUE)
        result, ids, chosen = self._named(detections, *self._carry(detections, blue), attitude)
        if len(ids) < len(self._array_m) <= len(blue) or result is None:
            named = self._named(detections, *self._by_angle(detections, blue, attitude.rotation), attitude)
            if result is None or (named[0] is not None and len(named[1]) > len(ids)):
                result, ids, chosen = named
        if result is None:
            self._ids = np.zeros(0, dtype=np.int64)
            return self._held if self._cfg.hold_last and self._held is not None else Associated()
        self._ids, self._pixels = ids, detections.centre_px[chosen]
        for beacon, detection in zip(ids.tolist(), chosen.tolist(), strict=True):
            tracks.beacon_id[tracks.detection == detection] = beacon
        if result.pose is not None:
            self._held = Associated(replace(result.pose, measured=False), 0, None)
        return result

    def _named(
        self, detections: Detections, ids: IntArray, chosen: IntArray, prior: Attitude
    ) -> tuple[Associated | None, IntArray, IntArray]:
        """The pose of named lights, and those of them that it bears out; None if the names do not hold.

        A light that is off from where the pose has it loses its name: carried on, a wrong one would never be put right.
        """
        solved = self._solve(ids, detections.centre_px[chosen], prior)
        if solved is None:
            return None, ids, chosen
        result, kept = solved
        return result, ids[kept], chosen[kept]

    def _carry(self, detections: Detections, blue: IntArray) -> tuple[IntArray, IntArray]:
        """Hungarian assignment of the last frame's beacons to this frame's lights."""
        if len(self._ids) == 0 or len(blue) == 0:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        gap = np.linalg.norm(self._pixels[:, None] - detections.centre_px[blue][None], axis=2)
        rows, columns = linear_sum_assignment(np.fmin(gap, 2.0 * self._cfg.gate_px))  # NaN is beyond the gate
        near = gap[rows, columns] <= self._cfg.gate_px
        return self._ids[rows[near]], blue[columns[near]]

    def _by_angle(self, detections: Detections, blue: IntArray, prior: Array) -> tuple[IntArray, IntArray]:
        """Angular order about the centroid; needs as many lights as the array has beacons."""
        k = len(self._array_m)
        if len(blue) < k:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        chosen = blue[np.argsort(-detections.score[blue], kind="stable")[:k]]
        offset = detections.centre_px[chosen]
        offset = offset - offset.mean(axis=0)
        seen = np.arctan2(offset[:, 1], offset[:, 0])
        array = (self._array_m - self._array_m.mean(axis=0)) @ prior.T
        known = np.arctan2(array[:, 1], array[:, 0])
        chosen, beacons = chosen[np.argsort(seen)], np.argsort(known)
        seen, known = np.sort(seen), known[beacons]
        error = [float(np.sum(1.0 - np.cos(seen - np.roll(known, shift)))) for shift in range(k)]
        return np.roll(beacons, int(np.argmin(error))), chosen

    def _solve(self, ids: IntArray, pixels: Array, prior: Attitude) -> tuple[Associated, IntArray] | None:
        if len(ids) < 4:
            return None
        xy = self._camera.normalise(pixels)
        points = np.ascontiguousarray(self._array_m[ids])
        error = self._cfg.ransac_px / float(self._camera.matrix[0, 0])
        kept = ransac(points, xy, iterations=self._cfg.ransac_iterations, error=error)
        if kept is None or len(kept) < 4:
            return None
        sigma = np.full(len(kept), self._sigma_px)
        solution = self._solver.plain(points[kept], pixels[kept], sigma, prior)
        if solution is None or solution.error_px > self._max_reprojection_px:
            return None
        if not self._credibility.holds(solution):
            return None
        pose = pose_estimate(solution, tuple(ids[kept].tolist()), True)
        off_px = np.linalg.norm(self._solver.project(solution, points) - pixels, axis=1)
        near = np.flatnonzero(off_px <= self._cfg.ransac_px)
        return Associated(pose, len(near), solution), near
