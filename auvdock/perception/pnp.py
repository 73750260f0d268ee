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
from typing import NamedTuple

import cv2
import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.limits import NotNegative, Positive
from auvdock.numeric.lights import (
    ATTITUDE,
    COST,
    COVARIANCE,
    ERROR,
    PIXEL,
    RESIDUAL,
    ROTATION,
    SEEN,
    SIGMA,
    TRANSFORM,
    TRANSLATION,
)
from auvdock.numeric.rotations import rotation_of, vector_of
from auvdock.perception.pnp_refine import solve_from
from auvdock.perception.solvers import project, solve_pnp

__all__ = ["PnpCfg", "PnpSolution", "PnpSolver", "light_table", "translation_from_rotation"]

_DECREMENT = 1e-9
_DECREMENT_TRACKED = 1e-4


@dataclass(frozen=True)
class PnpCfg(Checked):
    """How poses are solved and checked."""

    max_reprojection_px: Positive = 2.0
    """A mean reprojection error above this means that identities are wrong."""
    attitude_sigma_deg: Positive = 5.0
    """Trust in the vehicle's own attitude when it decides between the two poses of a plane."""
    max_attitude_error_deg: Positive = 40.0
    """A pose turned farther than this from the vehicle's own attitude is refused."""
    attitude_prior_sigma_deg: NotNegative = 2.0
    """The vehicle's attitude enters the least squares with this σ per axis; 0 leaves the pose to light alone, as in
    paper A. Beyond some 8 m light alone hardly tells how the array is turned: the two poses of its plane melt into one
    that may be 30° off and carries the position with it, and a flake of marine snow that shifts one light by 2 px turns
    the pose by several degrees. The value is ours: compass and inclinometer are good to 0.5° (`SensorCfg`), the rest is
    for the camera's mounting and the survey of the station. It must be well below 6°, for a turn by 6° moves the
    position by a tenth of the range, which no test of the range sees."""


class PnpSolution(NamedTuple):
    """A pose of the station in the camera frame, p_camera = R p_station + t.

    Attributes:
        numbers: (70 + n,) all that `solve_from` tells of it.
        attitude_error_rad: angle to the attitude prior.
        cost: χ² of the reprojection and of the attitude prior, if that is in use.
        solver: name of the solver.
    """

    numbers: Array
    attitude_error_rad: float
    cost: float
    solver: str

    @property
    def rotation_vector(self) -> Array:
        """(3,) Rodrigues vector of R."""
        return self.numbers[:TRANSLATION]

    @property
    def translation_m(self) -> Array:
        """(3,) t."""
        return self.numbers[TRANSLATION:ROTATION]

    @property
    def rotation(self) -> Array:
        """(3, 3) R."""
        return self.numbers[ROTATION:TRANSFORM].reshape(3, 3)

    @property
    def residual_px(self) -> Array:
        """(n,) distance between each light and its reprojection, to a hundredth of its σ."""
        return self.numbers[RESIDUAL:]

    @property
    def error_px(self) -> float:
        """Mean residual of the lights that were seen, or of all where none was."""
        return self.numbers.item(ERROR)

    def T_station_camera(self) -> Array:
        """(4, 4) pose of the camera in the station frame: [Rᵀ, -Rᵀ t]."""
        return self.numbers[TRANSFORM:COVARIANCE].reshape(4, 4)

    def covariance(self) -> Array:
        """(6, 6) covariance of (camera position in the station frame, small rotation in the camera frame).

        With Σ = (JᵀWJ)⁻¹ over (r, t), δ = J_l(r) dr a small rotation of the camera axes: d(position) =
        -Rᵀ (dt + t × δ), and the camera turns by -δ.
        """
        return self.numbers[COVARIANCE:ATTITUDE].reshape(6, 6)


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
        lens = (camera.matrix[0, 0], camera.matrix[1, 1], camera.matrix[0, 2], camera.matrix[1, 2])
        self._terms = np.array([*lens, *camera.distortion, self._prior_weight])
        self.heading_sigma_rad: float | None = None
        """Standard deviation of the prior's turn about the station's upright axis, where it is worse than the rest."""
        self._max_attitude_rad = math.radians(cfg.max_attitude_error_deg)
        self._ambiguous_rad = math.radians(2.0 * cfg.attitude_sigma_deg)
        self._clear_rad = min(self._ambiguous_rad, self._max_attitude_rad)

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
        return self.solve_lights(light_table(points_m, pixels, sigma_px), rotation_prior, start)

    def solve_lights(
        self, lights: Array, rotation_prior: Array, start: PnpSolution | None = None
    ) -> PnpSolution | None:
        """The same from a table (n, 7) of lights, some of them perhaps predicted: see `light_table`."""
        n = len(lights)
        if n < 3:
            return None
        first = None
        if start is not None:
            first = self._refine(start.numbers, lights, rotation_prior, "tracked")
        elif n >= 5:
            first = self._sqpnp(lights, rotation_prior)
        if first is not None and first.attitude_error_rad <= self._clear_rad:
            return first
        tried = [first]
        if first is None or first.attitude_error_rad > self._ambiguous_rad:
            tried.append(self._from_prior(lights, rotation_prior))
        found = [
            solution
            for solution in tried
            if solution is not None and solution.attitude_error_rad <= self._max_attitude_rad
        ]
        return min(found, key=self._judge) if found else None

    def plain(self, points_m: Array, pixels: Array, sigma_px: Array, rotation_prior: Array) -> PnpSolution | None:
        """The standard PnP of the comparison: OpenCV's iterative solver, n ≥ 4 lights of a plane, attitude ignored."""
        xy = self._camera.normalise(pixels)
        start = solve_pnp(points_m, xy, cv2.SOLVEPNP_ITERATIVE, 4)
        if start is None:
            return None
        return self._refine(_pose(*start), light_table(points_m, pixels, sigma_px), rotation_prior, "plain")

    def mirrored(self, solution: PnpSolution, lights: Array, rotation_prior: Array) -> PnpSolution | None:
        """The other pose of a plane (Schweighofer & Pinz 2006), refined from the mirror image of a solution.

        Seen from afar, a plane turned by θ about an axis across the line of sight looks like one turned by -θ: R' =
        exp(2 θ a) R, about the lights' centre, with a the unit vector of n × l, n the array's normal away from the
        camera and l the line of sight to its centre.

        Args:
            solution: pose of lights that lie more or less in a plane across the station's x axis.
            lights: (n, 7) their table, see `light_table`.
            rotation_prior: as in `solve`.

        Returns:
            That pose, which may be the solution itself, or None where there is none.
        """
        middle = lights[:, :PIXEL].mean(axis=0)
        centre = solution.rotation @ middle + solution.translation_m
        sight, normal = centre / np.linalg.norm(centre), -solution.rotation[:, 0]
        across = np.asarray(np.cross(normal, sight), dtype=np.float64)
        sine = float(np.linalg.norm(across))
        if sine == 0.0:
            return solution
        angle = 2.0 * math.atan2(sine, float(normal @ sight))
        turn = rotation_of(across * (angle / sine))
        rotation = turn @ solution.rotation
        start = _pose(vector_of(rotation), centre - rotation @ middle)
        return self._refine(start, lights, rotation_prior, solution.solver)

    def project(self, solution: PnpSolution, points_m: Array) -> Array:
        """(k, 2) pixels of station points (k, 3) under a solution."""
        return project(points_m, solution.rotation_vector, solution.translation_m, self._matrix, self._distortion)[0]

    def _judge(self, solution: PnpSolution) -> float:
        return solution.cost + self._attitude_weight * solution.attitude_error_rad**2

    def _sqpnp(self, lights: Array, prior: Array) -> PnpSolution | None:
        points, pixels = _parts(lights)
        xy = self._camera.normalise(pixels)
        start = solve_pnp(points, xy, cv2.SOLVEPNP_SQPNP, 5)
        return self._refine(_pose(*start), lights, prior, "sqpnp") if start is not None else None

    def _from_prior(self, lights: Array, prior: Array) -> PnpSolution | None:
        points, pixels = _parts(lights)
        translation = translation_from_rotation(prior, points, self._camera.normalise(pixels))
        if translation is None:
            return None
        return self._refine(_pose(vector_of(prior), translation), lights, prior, "iterative")

    def _refine(self, start: Array, lights: Array, prior: Array, solver: str) -> PnpSolution | None:
        """Levenberg–Marquardt on the weighted reprojection error; from the last frame's pose it may stop sooner."""
        heading_weight = self._prior_weight
        if self.heading_sigma_rad is not None:
            heading_weight = min(1.0 / self.heading_sigma_rad**2, heading_weight)
        decrement = _DECREMENT_TRACKED if solver == "tracked" else _DECREMENT
        numbers = solve_from(start, lights, prior, self._terms, heading_weight, decrement)
        cost = numbers.item(COST)
        return PnpSolution(numbers, numbers.item(ATTITUDE), cost, solver) if cost == cost else None


def light_table(points_m: Array, pixels: Array, sigma_px: Array) -> Array:
    """(n, 7) table of seen lights: X, Y, Z in the station frame, m; image u, v and its σ (n,), px; 1 for seen."""
    table = np.ones((len(pixels), SEEN + 1))
    table[:, :PIXEL], table[:, PIXEL:SIGMA], table[:, SIGMA] = points_m, pixels, sigma_px
    return table


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
    if not spread >= 1e-12:
        return None
    depth = -float(np.vdot(centred, e)) / spread
    if not 0.0 < depth < math.inf:
        return None
    return np.array([*(mean_e + mean_xy * depth), depth])


def _parts(lights: Array) -> tuple[Array, Array]:
    """Points (n, 3) and pixels (n, 2) of a table of lights, each of its own memory as OpenCV wants them."""
    return lights[:, :PIXEL].copy(), lights[:, PIXEL:SIGMA].copy()


def _pose(rotation_vector: Array, translation_m: Array) -> Array:
    """(6,) of a rotation vector and a translation."""
    return np.concatenate([rotation_vector, translation_m])
