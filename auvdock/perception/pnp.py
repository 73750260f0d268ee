"""Pose from authenticated beacons: solver by count, Levenberg–Marquardt refinement, covariance, reprojection error.

Paper A, section 4.3. With n ≥ 5 lights SQPnP (Terzakis & Lourakis 2020; our reading of the paper's "fast PnP ...
quadratic programming"), with 3 or 4 the iterative solver; both end in Levenberg–Marquardt on the reprojection error in
pixels, lens distortion included. A frame that follows on a solved one starts that refinement from the last pose. Lights
of a plane have two poses that reproject almost equally well (Schweighofer & Pinz 2006): the vehicle's own attitude
decides between them, and enters the least squares as a weak prior (beyond the paper; can be switched off).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.errors import ConfigError
from auvdock.perception.pnp_refine import attitude_weight, pose_covariance, refine, rotation_of, vector_of

__all__ = ["PnpCfg", "PnpSolution", "PnpSolver", "translation_from_rotation"]

_DECREMENT = 1e-9
_DECREMENT_TRACKED = 1e-4
_EYE_3 = np.eye(3)
_NO_VECTOR, _NO_WEIGHT = np.zeros(3), np.zeros((3, 3))


@dataclass(frozen=True)
class PnpCfg:
    """How poses are solved and checked."""

    max_reprojection_px: float = 2.0
    """A mean reprojection error above this means that identities are wrong."""
    attitude_sigma_deg: float = 5.0
    """Trust in the vehicle's own attitude when it decides between the two poses of a plane."""
    max_attitude_error_deg: float = 40.0
    """A pose turned farther than this from the vehicle's own attitude is refused."""
    attitude_prior_sigma_deg: float = 5.0
    """The vehicle's attitude enters the least squares with this σ per axis; 0 leaves the pose to light alone, as in
    paper A. Beyond some 8 m light alone hardly tells how the array is turned, and the two poses of its plane melt into
    one that may be 30° off and carries the position with it."""

    def __post_init__(self) -> None:
        """Refuse what no check can use."""
        for name in ("max_reprojection_px", "attitude_sigma_deg", "max_attitude_error_deg"):
            if not getattr(self, name) > 0.0:
                raise ConfigError(f"pnp.{name}", getattr(self, name), "a value above 0")
        if self.attitude_prior_sigma_deg < 0.0:
            raise ConfigError("pnp.attitude_prior_sigma_deg", self.attitude_prior_sigma_deg, "0 or more")


class PnpSolution(NamedTuple):
    """A pose of the station in the camera frame, p_camera = R p_station + t.

    Attributes:
        rotation_vector: (3,) Rodrigues vector of R.
        rotation: (3, 3) R.
        translation_m: (3,) t.
        residual_px: (n,) distance between each observed light and its reprojection, to a hundredth of its σ.
        normal: (6, 6) lower Cholesky factor of JᵀWJ over (rotation vector, t), prior included; what stands above its
            diagonal means nothing.
        attitude_error_rad: angle to the attitude prior.
        cost: χ² of the reprojection and of the attitude prior, if that is in use.
        solver: name of the solver.
    """

    rotation_vector: Array
    rotation: Array
    translation_m: Array
    residual_px: Array
    normal: Array
    attitude_error_rad: float
    cost: float
    solver: str

    def T_station_camera(self) -> Array:
        """(4, 4) pose of the camera in the station frame: [Rᵀ, -Rᵀ t]."""
        transform = np.zeros((4, 4))
        transform[3, 3] = 1.0
        back = self.rotation.T
        transform[:3, :3] = back
        transform[:3, 3] = -back.dot(self.translation_m)
        return transform

    def covariance(self) -> Array:
        """(6, 6) covariance of (camera position in the station frame, small rotation in the camera frame).

        With Σ = (JᵀWJ)⁻¹ over (r, t), δ = J_l(r) dr a small rotation of the camera axes: d(position) =
        -Rᵀ (dt + t × δ), and the camera turns by -δ.
        """
        return pose_covariance(self.rotation_vector, self.rotation, self.translation_m, self.normal)


class PnpSolver:
    """Solves poses for one camera."""

    def __init__(self, cfg: PnpCfg, camera: Camera) -> None:
        """Keep what every solve needs."""
        self._cfg = cfg
        self._camera = camera
        self._matrix = np.ascontiguousarray(camera.matrix)
        self._distortion = np.ascontiguousarray(camera.distortion)
        self._attitude_weight = 1.0 / math.radians(cfg.attitude_sigma_deg) ** 2
        prior = math.radians(cfg.attitude_prior_sigma_deg)
        self._prior_weight = 1.0 / prior**2 if prior > 0.0 else 0.0
        self.heading_sigma_rad: float | None = None
        """Standard deviation of the prior's turn about the station's upright axis, where it is worse than the rest."""
        self._max_attitude_rad = math.radians(cfg.max_attitude_error_deg)
        self._ambiguous_rad = math.radians(2.0 * cfg.attitude_sigma_deg)

    def solve(
        self,
        points_m: Array,
        pixels: Array,
        sigma_px: Array,
        rotation_prior: Array,
        start: PnpSolution | None = None,
    ) -> PnpSolution | None:
        """Pose from n ≥ 3 correspondences, None where no solver finds one in front of the camera.

        Args:
            points_m: (n, 3) beacons in the station frame.
            pixels: (n, 2) their images.
            sigma_px: (n,) standard deviation of each image point per axis.
            rotation_prior: (3, 3) R of the vehicle's own attitude (camera from station axes).
            start: the last frame's solution: refined directly, without the solver chosen by count.
        """
        n = len(pixels)
        if n < 3:
            return None
        tried: list[PnpSolution | None] = []
        if start is not None:
            tried.append(self._refine(start, points_m, pixels, sigma_px, rotation_prior, "tracked"))
        elif n >= 5:
            tried.append(self._sqpnp(points_m, pixels, sigma_px, rotation_prior))
        first = tried[0] if tried else None
        if first is None or first.attitude_error_rad > self._ambiguous_rad:
            tried.append(self._from_prior(points_m, pixels, sigma_px, rotation_prior))
        found = [
            solution
            for solution in tried
            if solution is not None and solution.attitude_error_rad <= self._max_attitude_rad
        ]
        return min(found, key=self._judge) if found else None

    def plain(self, points_m: Array, pixels: Array, sigma_px: Array, rotation_prior: Array) -> PnpSolution | None:
        """The standard PnP of the comparison: OpenCV's iterative solver, n ≥ 4 lights of a plane, attitude ignored."""
        xy = self._camera.normalise(pixels)
        try:
            ok, rotation, translation = cv2.solvePnP(points_m, xy, np.eye(3), None, flags=cv2.SOLVEPNP_ITERATIVE)
        except cv2.error:
            return None
        if not ok:
            return None
        start = (_vector(rotation), _vector(translation))
        return self._refine(start, points_m, pixels, sigma_px, rotation_prior, "plain")

    def project(self, solution: PnpSolution, points_m: Array) -> Array:
        """(k, 2) pixels of station points (k, 3) under a solution."""
        pixels, _ = cv2.projectPoints(
            points_m, solution.rotation_vector, solution.translation_m, self._matrix, self._distortion
        )
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2)

    def _judge(self, solution: PnpSolution) -> float:
        return solution.cost + self._attitude_weight * solution.attitude_error_rad**2

    def _sqpnp(self, points: Array, pixels: Array, sigma: Array, prior: Array) -> PnpSolution | None:
        xy = self._camera.normalise(pixels)
        ok, rotation, translation = cv2.solvePnP(points, xy, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
        if not ok:
            return None
        start = (_vector(rotation), _vector(translation))
        return self._refine(start, points, pixels, sigma, prior, "sqpnp")

    def _from_prior(self, points: Array, pixels: Array, sigma: Array, prior: Array) -> PnpSolution | None:
        translation = translation_from_rotation(prior, points, self._camera.normalise(pixels))
        if translation is None:
            return None
        return self._refine((_rodrigues(prior), translation), points, pixels, sigma, prior, "iterative")

    def _refine(
        self,
        start: PnpSolution | tuple[Array, Array],
        points: Array,
        pixels: Array,
        sigma: Array,
        prior: Array,
        solver: str,
    ) -> PnpSolution | None:
        """Levenberg–Marquardt on the weighted reprojection error."""
        if isinstance(start, PnpSolution):
            pose, decrement = np.concatenate([start.rotation_vector, start.translation_m]), _DECREMENT_TRACKED
        else:
            pose, decrement = np.concatenate(start), _DECREMENT
        expected, weight = self._prior_terms(prior)
        good, pose, residual, factor, cost = refine(
            pose, points, pixels, sigma, self._matrix, self._distortion, expected, weight, decrement
        )
        if not good:
            return None
        rotation = rotation_of(pose[:3])
        cosine = (float(np.vdot(rotation, prior)) - 1.0) / 2.0
        return PnpSolution(
            rotation_vector=pose[:3],
            rotation=rotation,
            translation_m=pose[3:],
            residual_px=np.hypot(residual[:, 0], residual[:, 1]),
            normal=factor,
            attitude_error_rad=math.acos(max(-1.0, min(1.0, cosine))),
            cost=cost,
            solver=solver,
        )

    def _prior_terms(self, prior: Array) -> tuple[Array, Array]:
        """The prior's rotation vector (3,) and its weight J_lᵀ W J_l (3, 3), W that of a small rotation; or zeros."""
        if not self._prior_weight:
            return _NO_VECTOR, _NO_WEIGHT
        vector = _rodrigues(prior)
        weights = self._prior_weight * _EYE_3
        if self.heading_sigma_rad is not None:
            up = prior[:, 2]
            heading_weight = min(1.0 / self.heading_sigma_rad**2, self._prior_weight)
            weights += (heading_weight - self._prior_weight) * np.outer(up, up)
        return vector, attitude_weight(vector, weights)


def translation_from_rotation(rotation: Array, points_m: Array, xy: Array) -> Array | None:
    """Translation (3,) that images points (n, 3) at normalised coordinates xy (n, 2) under a known rotation.

    Linear least squares of x (q_z + t_z) = q_x + t_x and the same in y, q = R X; exact for exact data. None where the
    images all coincide or the result lies behind the camera.
    """
    q = points_m @ rotation.T
    e = xy * q[:, 2:] - q[:, :2]
    mean_xy, mean_e = xy.mean(axis=0), e.mean(axis=0)
    centred = xy - mean_xy
    spread = float(np.vdot(centred, centred))
    if spread < 1e-12:
        return None
    depth = -float(np.vdot(centred, e)) / spread
    if depth <= 0.0:
        return None
    return np.array([*(mean_e + mean_xy * depth), depth])


def _rodrigues(rotation: Array) -> Array:
    vector = vector_of(rotation)
    return vector if math.isfinite(vector[0]) else np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).ravel()


def _vector(column: NDArray[Any]) -> Array:
    return np.asarray(column, dtype=np.float64).ravel()
