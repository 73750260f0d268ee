"""Level I: the pose from the lights of the station."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.core.camera import Camera
from auvdock.core.contracts import BLUE, Detections
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.linear import solve_positive
from auvdock.core.transforms import invert, make_transform
from auvdock.perception.landing.config import LightLevelCfg
from auvdock.perception.landing.evidence import log_odds
from auvdock.perception.landing.identity import hypotheses, match
from auvdock.perception.landing.level import LevelPose, LevelSolver, pose_offset
from auvdock.perception.rpnp import rpnp_poses

__all__ = ["LightLevel", "NamedLights"]

_MIN_LIGHTS = 3
_MAX_ROTATION_RAD = 0.6
_GATE_PX = 3.0
_BETTER = 9.0
"""χ² by which one naming must beat another that names as many lights."""
_FAR = 50.0
"""Squared Mahalanobis distance; beyond the filter's own gate, which comes after and counts its refusals."""
_WIDE_HEIGHT_M = (0.1, 30.0)


class _Start(NamedTuple):
    """A pose (4, 4) T_station_camera to refine, and what gave it."""

    pose: Array
    solver: str


@dataclass(frozen=True, eq=False)
class NamedLights:
    """A level pose and which detection is which light.

    Attributes:
        pose: the pose.
        detection: (m,) index of each light's detection, -1 for none.
        convincing: whether the spots speak for the station by themselves: strays hardly explain them.
    """

    pose: LevelPose
    detection: IntArray
    convincing: bool

    @property
    def count(self) -> int:
        """Lights named."""
        return int((self.detection >= 0).sum())


class LightLevel:
    """Finds the lights of one station among a frame's detections and solves the pose.

    Where the filter says which light is to be expected where, the nearest detection within the gate is taken.
    Otherwise the pattern tells (`identity.hypotheses`), and the pose starts from RPnP (paper C, section 3.4.2), or from
    the vehicle's own attitude where RPnP's is turned too far from it; three lights have several poses, and attitude
    chooses. What does not reproject is refused.
    """

    def __init__(self, cfg: LightLevelCfg, station: LandingStationCfg, camera: Camera, solver: LevelSolver) -> None:
        """Precompute for one camera and station."""
        self._cfg = cfg
        self._camera = camera
        self._solver = solver
        self._points_m = np.ascontiguousarray(station.layout.array_positions_m)
        self._focal_px = float(camera.matrix[0, 0])

    def find(self, detections: Detections, attitude: Array, height_m: float | None) -> NamedLights | None:
        """Name the lights without an expectation.

        Args:
            detections: the frame's.
            attitude: (3, 3) R_station_camera by inclinometer and compass.
            height_m: of the camera above the station's origin by the pressure gauge, None if not to be used.
        """
        index = np.flatnonzero(detections.class_id == BLUE)
        if len(index) > self._cfg.max_lights_n:
            order = np.argsort(-detections.score[index], kind="stable")
            index = np.sort(index[order[: self._cfg.max_lights_n]])
        if len(index) < _MIN_LIGHTS:
            return None
        heights = _WIDE_HEIGHT_M
        if height_m is not None and self._cfg.max_height_error_m > 0.0:
            heights = (height_m - self._cfg.max_height_error_m, height_m + self._cfg.max_height_error_m)
        xy = self._camera.normalise(detections.centre_px[index])
        settled: list[NamedLights] = []
        for guess in hypotheses(self._points_m, xy, attitude.T, _GATE_PX / self._focal_px, heights):
            if settled and guess.count < settled[0].count:
                break
            named = np.where(guess.spot >= 0, index[guess.spot], -1)
            start = invert(make_transform(guess.rotation, guess.translation_m))
            found = self._solve(detections, named, attitude, _Start(start, "prior"))
            if found is not None and found.count == guess.count:
                settled.append(found)
        settled.sort(key=lambda found: (-found.count, found.pose.cost))
        if not settled:
            return None
        best = settled[0]
        rivals = [
            other
            for other in settled[1:]
            if other.count == best.count and other.pose.cost < best.pose.cost + _BETTER and _apart(best, other)
        ]
        return None if rivals else best

    def follow(
        self, detections: Detections, attitude: Array, T_station_camera: Array, covariance: Array
    ) -> NamedLights | None:
        """Name the lights where they are expected.

        Args:
            detections: the frame's.
            attitude: (3, 3) R_station_camera by inclinometer and compass.
            T_station_camera: (4, 4) expected pose.
            covariance: (6, 6) of it.
        """
        index = np.flatnonzero(detections.class_id == BLUE)
        if len(index) < _MIN_LIGHTS:
            return None
        q = (self._points_m - T_station_camera[:3, 3]) @ T_station_camera[:3, :3]
        view = self._camera.in_view(q)
        image = self._camera.project(np.where(view[:, None], q, np.array([0.0, 0.0, 1.0])))
        spread = self._focal_px / np.maximum(q[:, 2], 0.1) * np.sqrt(np.max(np.diag(covariance)[:3]))
        spread += self._focal_px * np.sqrt(np.max(np.diag(covariance)[3:]))
        gate = np.where(view, np.minimum(_GATE_PX + 4.0 * spread, self._cfg.gate_px), -1.0)
        spot = match(image, detections.centre_px[index], gate)
        named = np.where(spot >= 0, index[spot], -1)
        return self._solve(detections, named, attitude, _Start(T_station_camera, "tracked"), covariance)

    def _solve(
        self, detections: Detections, named: IntArray, attitude: Array, start: _Start, spread: Array | None = None
    ) -> NamedLights | None:
        """The pose of the named lights; if they fit none, that of most of them that does, three at least.

        With `spread`, the covariance of the start, a pose far from the start does not fit: three spots that are not
        the lights may image some pose well.
        """
        lights = np.flatnonzero(named >= 0)
        for left_out in range(max(len(lights) - _MIN_LIGHTS, 0) + 1):
            best: NamedLights | None = None
            for out in combinations(lights.tolist(), left_out):
                fewer = named.copy()
                fewer[list(out)] = -1
                found = self._refined(detections, fewer, attitude, start)
                if found is None or (spread is not None and _far(found.pose, start.pose, spread)):
                    continue
                if best is None or found.pose.cost < best.pose.cost:
                    best = found
            if best is not None:
                return best
        return None

    def _refined(self, detections: Detections, named: IntArray, attitude: Array, start: _Start) -> NamedLights | None:
        lights = np.flatnonzero(named >= 0)
        if len(lights) < _MIN_LIGHTS:
            return None
        pixels = detections.centre_px[named[lights]]
        sigma = self._sigma_px(detections, named[lights])
        points = self._points_m[lights]
        ids = tuple(lights.tolist())
        starts = [start]
        if start.solver != "tracked":
            own = self._rpnp(points, pixels, attitude)
            if own is not None:
                starts.insert(0, _Start(own, "rpnp"))
        for T, name in starts:
            pose = self._solver.solve(points, pixels, sigma, attitude, T, ids, name)
            if pose is None or not pose.is_sure(points.mean(axis=0)):
                continue
            limit = self._cfg.max_reprojection_px * float(np.maximum(sigma, 1.0).mean())
            if pose.estimate.reprojection_error_px <= limit:
                spots_n = int((detections.class_id == BLUE).sum())
                if start.solver != "tracked":  # `find` looked at no more than these
                    spots_n = min(spots_n, self._cfg.max_lights_n)
                return NamedLights(pose, named, self._convinces(pose, sigma, spots_n))
        return None

    def _rpnp(self, points: Array, pixels: Array, attitude: Array) -> Array | None:
        """(4, 4) T_station_camera by RPnP, the candidate nearest to the attitude; None if all are far from it."""
        best, least = None, _MAX_ROTATION_RAD
        for pose in rpnp_poses(points, self._camera.normalise(pixels))[:4]:
            cosine = (float(np.vdot(pose.rotation, attitude.T)) - 1.0) / 2.0
            angle = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
            if angle < least:
                best, least = pose, angle
        return None if best is None else invert(make_transform(best.rotation, best.translation_m))

    def _convinces(self, pose: LevelPose, sigma_px: Array, spots_n: int) -> bool:
        """Whether a naming out of so many spots is hardly one of strays."""
        error_m = self._cfg.max_height_error_m
        span_m = 2.0 * error_m if error_m > 0.0 else _WIDE_HEIGHT_M[1] - _WIDE_HEIGHT_M[0]
        size = self._camera.width_px, self._camera.height_px
        # The camera may be wherever it has the station in its image.
        across_m2 = size[0] * size[1] * (float(pose.T_station_camera[2, 3]) / self._focal_px) ** 2
        odds = log_odds(pose, sigma_px, len(self._points_m), spots_n, size, across_m2 * span_m)
        return odds >= math.log(self._cfg.min_odds)

    def _sigma_px(self, detections: Detections, index: IntArray) -> Array:
        width = detections.xyxy[index, 2:] - detections.xyxy[index, :2]
        return np.hypot(self._cfg.centre_sigma_px, self._cfg.centre_sigma_widths * width.mean(axis=1))


def _far(pose: LevelPose, T_expected: Array, covariance: Array) -> bool:
    """Whether a pose contradicts what was expected."""
    offset = pose_offset(T_expected, pose.T_station_camera)
    weighed = solve_positive(covariance + pose.estimate.covariance, offset)
    return weighed is None or float(offset @ weighed) > _FAR


def _apart(a: NamedLights, b: NamedLights) -> bool:
    """Whether two namings mean different places, not the same place with a different light left out."""
    gap = a.pose.T_station_camera[:3, 3] - b.pose.T_station_camera[:3, 3]
    return float(np.linalg.norm(gap)) > 0.05
