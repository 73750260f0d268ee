"""Pose of one level: weighted least squares on pixels, the vehicle's own attitude as a prior, and its covariance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.contracts import PoseEstimate
from auvdock.core.linear import solve_positive
from auvdock.core.transforms import make_transform
from auvdock.perception.landing.config import AttitudeCfg
from auvdock.perception.solvers import project

__all__ = ["LevelPose", "LevelSolver", "pose_offset", "rotated"]

_MAX_ITERATIONS = 20
_DECREMENT = 1e-8
_MAX_SIGMA_M, _MAX_SIGMA_OF_RANGE = 0.1, 0.1 / 3.0
"""Of the place, along its worst axis: three σ are 0.3 m, or 10 % of the range if that is more. Ours: from that error on
an episode counts a pose as false."""
_NO_ROTATION = np.zeros(3)
_IDENTITY = np.eye(6)


@dataclass(frozen=True, eq=False)
class LevelPose:
    """What one level makes of one frame.

    Errors e = (δp, δθ) are those of `PoseEstimate`: position in the station frame, small rotation in the camera frame,
    R = R₀ exp([δθ]).

    Attributes:
        estimate: pose and covariance, the attitude prior included.
        information: (6, 6) H = JᵀWJ of the pixels alone.
        pull: (6,) where the pixels alone would have the minimum, relative to the pose: the prior keeps the pose off it.
        prior: (6, 6) information Λ of the attitude prior.
        residual_sigmas: (n,) distance of each point from its reprojection over its σ.
        cost: χ² of the reprojection and of the prior.
    """

    estimate: PoseEstimate
    information: Array
    pull: Array
    prior: Array
    residual_sigmas: Array
    cost: float

    @property
    def T_station_camera(self) -> Array:
        """(4, 4) the pose."""
        return self.estimate.T_station_camera

    def is_sure(self, mark_m: Array) -> bool:
        """Whether the place is known well enough to be a measurement.

        Points that span few pixels for their noise fit poses at any range; the covariance says so.

        Args:
            mark_m: (3,) middle of the points in the station frame, from which the range counts.
        """
        range_m = float(np.linalg.norm(mark_m - self.T_station_camera[:3, 3]))
        worst_m2 = float(np.linalg.eigvalsh(self.estimate.covariance[:3, :3])[2])
        return worst_m2 <= max(_MAX_SIGMA_M, _MAX_SIGMA_OF_RANGE * range_m) ** 2


class _Fit(NamedTuple):
    """χ² and what it is made of at one pose.

    Attributes:
        cost: χ².
        information: (6, 6) H = JᵀWJ of the pixels.
        gradient: (6,) JᵀW times their residuals.
        prior: (6, 6) Λ.
        prior_gradient: (6,) Λ φ.
        residual_px: (n,).
    """

    cost: float
    information: Array
    gradient: Array
    prior: Array
    prior_gradient: Array
    residual_px: Array


class LevelSolver:
    """Levenberg–Marquardt over (position, rotation) for one camera.

    χ² = Σ |u_i - π(Rᵀ (X_i - p))|² / σ_i² + φᵀ Λ φ with φ = log(R_mᵀ R) the rotation from the measured attitude R_m:
    the inclinometer is known to some tenths of a degree, the compass about the station's vertical only roughly. Where
    χ² is more than its degrees of freedom, the pixels are worse than their σ says, and their information is divided by
    the ratio (Birge 1932).
    """

    def __init__(self, cfg: AttitudeCfg, camera: Camera) -> None:
        """Keep what every solve needs."""
        self._matrix = np.ascontiguousarray(camera.matrix)
        self._distortion = np.ascontiguousarray(camera.distortion)
        self._tilt = 1.0 / (math.radians(cfg.tilt_noise_deg) ** 2 + math.radians(cfg.tilt_bias_deg) ** 2)
        self._heading = 1.0 / math.radians(cfg.heading_deg) ** 2
        self._level = self._tilt * np.eye(3)

    def solve(
        self,
        points_m: Array,
        pixels: Array,
        sigma_px: Array,
        attitude: Array,
        start: Array,
        ids: tuple[int, ...],
        solver: str,
    ) -> LevelPose | None:
        """The pose of n ≥ 3 points, None for fewer and where there is none in front of the camera.

        Args:
            points_m: (n, 3) points in the station frame.
            pixels: (n, 2) their images.
            sigma_px: (n,) standard deviation of each, per axis.
            attitude: (3, 3) R_station_camera by inclinometer and compass.
            start: (4, 4) T_station_camera to start from.
            ids: for the estimate.
            solver: name of what gave the start, for the estimate.
        """
        if len(points_m) < 3 or len(points_m) != len(pixels):
            return None
        position, rotation = start[:3, 3].copy(), start[:3, :3].copy()
        damping = 0.0
        best: _Fit | None = None
        trial = (position, rotation)
        for _ in range(_MAX_ITERATIONS):
            fit = self._evaluate(points_m, pixels, sigma_px, attitude, *trial)
            if fit is not None and (best is None or fit.cost <= best.cost):
                best, (position, rotation), damping = fit, trial, damping * 0.1
            elif best is None:
                return None
            else:
                damping = max(10.0 * damping, 1e-3)
            normal, gradient = best.information + best.prior, best.gradient + best.prior_gradient
            damped = normal + np.diag(damping * normal.diagonal()) if damping > 1e-9 else normal
            back = solve_positive(damped, gradient)
            if back is None:
                return None
            # The expected fall of χ²: the square of the step in units of the pose's standard deviation.
            if damping <= 1e-9 and float(gradient @ back) < _DECREMENT:
                break
            trial = (position - back[:3], rotated(rotation, -back[3:]))
        if best is None:
            return None
        return self._finish(best, make_transform(rotation, position), sigma_px, ids, solver)

    @staticmethod
    def _finish(
        fit: _Fit, T_station_camera: Array, sigma_px: Array, ids: tuple[int, ...], solver: str
    ) -> LevelPose | None:
        # 2 n residuals and three of attitude, less six unknowns.
        worse = max(1.0, fit.cost / (2 * len(sigma_px) - 3))
        information, gradient = fit.information / worse, fit.gradient / worse
        covariance = solve_positive(information + fit.prior, _IDENTITY)
        # Three points may leave a direction open: a trace of information keeps the inverse finite.
        open_ = 1e-9 * float(information.trace()) / 6.0
        back = solve_positive(information + open_ * _IDENTITY, gradient)
        if covariance is None or back is None:
            return None
        covariance = 0.5 * (covariance + covariance.T)
        estimate = PoseEstimate(T_station_camera, covariance, ids, solver, float(fit.residual_px.mean()))
        return LevelPose(estimate, information, -back, fit.prior, fit.residual_px / sigma_px, fit.cost)

    def _evaluate(
        self, points: Array, pixels: Array, sigma: Array, attitude: Array, position: Array, rotation: Array
    ) -> _Fit | None:
        """The fit of a pose; None where it has points behind the camera or χ² is not finite."""
        q = (points - position) @ rotation
        if not bool((q[:, 2] > 1e-3).all()):
            return None
        image, by_q = project(q, _NO_ROTATION, _NO_ROTATION, self._matrix, self._distortion)
        difference = image - pixels
        n = len(q)
        # du/dq of each point: with the identity as pose that is the derivative by the translation.
        du = by_q[:, 3:6].reshape(n, 2, 3)
        jacobian = np.empty((n, 2, 6))
        jacobian[:, :, :3] = -du @ rotation.T
        # q = Rᵀ (X - p), R → R exp([δθ]): dq = q × δθ, so du/dq dq = (du/dq × q) δθ.
        (x, y, z), (a, b, c) = q.T[:, :, None], du.transpose(2, 0, 1)
        jacobian[:, :, 3], jacobian[:, :, 4], jacobian[:, :, 5] = b * z - c * y, c * x - a * z, a * y - b * x
        flat = (jacobian / sigma[:, None, None]).reshape(2 * n, 6)
        weighted = (difference / sigma[:, None]).reshape(-1)
        information, gradient = flat.T @ flat, flat.T @ weighted
        turn = pose_turn(attitude, rotation)
        up = rotation[2]
        prior = np.zeros((6, 6))
        prior[3:, 3:] = self._level + (self._heading - self._tilt) * (up[:, None] * up)
        pulled = prior[:, 3:] @ turn
        cost = float(weighted @ weighted) + float(turn @ pulled[3:])
        if not math.isfinite(cost):
            return None
        return _Fit(cost, information, gradient, prior, pulled, np.hypot(difference[:, 0], difference[:, 1]))


def pose_turn(a: Array, b: Array) -> Array:
    """(3,) rotation vector log(R_aᵀ R_b), in b's axes as in a's."""
    return np.asarray(cv2.Rodrigues(a.T @ b)[0], dtype=np.float64).ravel()


def pose_offset(a: Array, b: Array) -> Array:
    """(6,) error coordinates of pose b (4, 4) about pose a (4, 4): (p_b - p_a, log(R_aᵀ R_b))."""
    return np.concatenate([b[:3, 3] - a[:3, 3], pose_turn(a[:3, :3], b[:3, :3])])


def rotated(rotation: Array, turn: Array) -> Array:
    """(3, 3) R exp([turn])."""
    return rotation @ np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
