"""Level II: the pose from the four corners of the tag."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import RegionOfInterest, TagDetection
from auvdock.core.landing_station import TagCfg
from auvdock.core.transforms import invert, make_transform
from auvdock.perception.landing.config import TagLevelCfg
from auvdock.perception.landing.level import LevelPose, LevelSolver
from auvdock.perception.solvers import solve_square

__all__ = ["TagLevel", "tag_corners_m"]

_SURE = 25.0
"""χ² of a pose that needs no rival: eight residuals and three of attitude, less six unknowns."""
_MARGIN = 0.3
_MARGIN_PX = 12.0


def tag_corners_m(cfg: TagCfg) -> Array:
    """(4, 3) corners of the black square in the station frame, in the order of `TagDetection.corners_px`.

    The tag lies face up with its upper edge to the head (+x): as it is read, right is starboard (-y).
    """
    half = 0.5 * cfg.size_m
    corners = np.array([[half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0], [-half, half, 0.0]])
    return corners + np.array(cfg.position_m)


class TagLevel:
    """Pose from one known tag.

    A square has two poses that reproject almost alike (Schweighofer & Pinz 2006); for a small tag noise decides. Both
    of IPPE (Collins & Bartoli 2014) are refined with the vehicle's own attitude as a prior, and so is the pose that
    attitude alone suggests; the least cost wins.
    """

    def __init__(self, cfg: TagLevelCfg, tag: TagCfg, camera: Camera, solver: LevelSolver) -> None:
        """Precompute for one camera and tag."""
        self._cfg = cfg
        self._tag = tag
        self._camera = camera
        self._solver = solver
        self._corners_m = tag_corners_m(tag)
        self._centre_m = np.array(tag.position_m)
        half = 0.5 * tag.size_m
        # IPPE_SQUARE's own frame: x right, y up, z towards the reader.
        self._square = np.array([[-half, half, 0.0], [half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0]])
        self._T_station_square = make_transform(
            np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), self._centre_m
        )

    def measure(self, tags: Sequence[TagDetection], attitude: Array, expected: Array | None = None) -> LevelPose | None:
        """The pose of one frame, None without the tag or where its corners fit no pose, or any.

        Args:
            tags: what the detector saw; other numbers than the station's are ignored.
            attitude: (3, 3) R_station_camera by inclinometer and compass.
            expected: (4, 4) T_station_camera where the filter expects the camera; tried first.
        """
        best: LevelPose | None = None
        for tag in tags:
            if tag.tag_id == self._tag.tag_id:
                pose = self._pose(tag, attitude, expected)
                if pose is not None and pose.is_sure(self._centre_m) and (best is None or pose.cost < best.cost):
                    best = pose
        return best

    def region(self, T_station_camera: Array, covariance: Array) -> RegionOfInterest | None:
        """Where the tag must be in the image; empty (x0 = x1) if out of view, None if it lies behind the camera."""
        q = (self._corners_m - T_station_camera[:3, 3]) @ T_station_camera[:3, :3]
        if not bool((q[:, 2] > 0.02).all()):
            return None
        if not bool(self._camera.in_view(q).any()) and not bool(self._camera.in_view(q.mean(axis=0)[None])[0]):
            return RegionOfInterest(0, 0, 0, 0)
        pixels = self._camera.project(q)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        focal, depth = float(self._camera.matrix[0, 0]), float(q[:, 2].mean())
        spread = 3.0 * focal / depth * float(np.sqrt(np.max(np.diag(covariance)[:3])))
        spread += 3.0 * focal * float(np.sqrt(np.max(np.diag(covariance)[3:])))
        margin = _MARGIN * float((high - low).max()) + _MARGIN_PX + spread
        x0, y0 = np.maximum(np.floor(low - margin), 0.0).astype(int).tolist()
        size = np.array([self._camera.width_px, self._camera.height_px])
        x1, y1 = np.minimum(np.ceil(high + margin), size).astype(int).tolist()
        return RegionOfInterest(x0, y0, max(x0, x1), max(y0, y1))

    def _pose(self, tag: TagDetection, attitude: Array, expected: Array | None) -> LevelPose | None:
        xy = self._camera.normalise(tag.corners_px)
        sigma = np.full(4, math.hypot(tag.sigma_px, self._cfg.corner_sigma_px))
        if expected is not None:
            # The attitude's share of the cost tells the wrong of a square's two poses: it is tens of degrees off.
            tracked = self._solver.solve(self._corners_m, tag.corners_px, sigma, attitude, expected, (), "tracked")
            if tracked is not None and tracked.cost < _SURE:
                return tracked
        found = [
            self._solver.solve(self._corners_m, tag.corners_px, sigma, attitude, start, (), name)
            for start, name in self._starts(xy, attitude)
        ]
        poses = [pose for pose in found if pose is not None]
        if not poses:
            return None
        best = min(poses, key=lambda pose: pose.cost)
        limit_px = self._cfg.max_reprojection_px * max(1.0, tag.sigma_px)
        return best if best.estimate.reprojection_error_px <= limit_px else None

    def _starts(self, xy: Array, attitude: Array) -> list[tuple[Array, str]]:
        """Poses (4, 4) to refine, and where they come from."""
        starts: list[tuple[Array, str]] = []
        for vector, translation in solve_square(self._square, xy):
            rotation = np.asarray(cv2.Rodrigues(vector)[0], dtype=np.float64)
            starts.append((self._T_station_square @ invert(make_transform(rotation, translation)), "ippe"))
            # The same distance, seen as upright as the vehicle says it is.
            starts.append((make_transform(attitude, self._centre_m - attitude @ translation), "prior"))
        return starts
