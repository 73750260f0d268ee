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
from auvdock.numeric.lights import Light, Pose, Solution
from auvdock.numeric.records import Records, new_rows
from auvdock.numeric.rotations import rotation_of, vector_of
from auvdock.perception.pnp_refine import solve_from
from auvdock.perception.solvers import project, solve_pnp

__all__ = ["Attitude", "PnpCfg", "PnpSolution", "PnpSolver", "lens_of", "light_table", "translation_from_rotation"]

_SOLUTION = Solution.dtype()
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


class Attitude(NamedTuple):
    """What the vehicle knows of how the station is turned before it sees a light.

    Attributes:
        rotation: (3, 3) R_camera_station.
        heading_sigma_rad: standard deviation of the turn about the station's upright axis, None where it was surveyed
            and is no worse than the rest.
    """

    rotation: Array
    heading_sigma_rad: float | None = None


class PnpSolution(NamedTuple):
    """A pose of the station in the camera frame, p_camera = R p_station + t.

    Attributes:
        record: (1,) all that `solve_from` tells of it.
        lights_n: lights that it was solved from.
        attitude_error_rad: angle to the attitude prior.
        cost: χ² of the reprojection and of the attitude prior, if that is in use.
        solver: name of the solver.
    """

    record: Records[Solution]
    lights_n: int
    attitude_error_rad: float
    cost: float
    solver: str

    @property
    def rotation_vector(self) -> Array:
        """(3,) Rodrigues vector of R."""
        return self.record["pose"]["rotation_vector"][0]

    @property
    def translation_m(self) -> Array:
        """(3,) t."""
        return self.record["pose"]["translation_m"][0]

    @property
    def rotation(self) -> Array:
        """(3, 3) R."""
        return self.record["rotation"][0]

    @property
    def lights_cost(self) -> float:
        """χ² of the reprojection alone."""
        return self.record["lights_cost"].item()

    @property
    def error_px(self) -> float:
        """Mean residual of the lights that were seen, or of all where none was."""
        return self.record["error_px"].item()

    def T_station_camera(self) -> Array:
        """(4, 4) pose of the camera in the station frame: [Rᵀ, -Rᵀ t]."""
        return self.record["T_station_camera"][0]

    def covariance(self) -> Array:
        """(6, 6) covariance of (camera position in the station frame, small rotation in the camera frame)."""
        return self.record["covariance"][0]


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
        self._lens = lens_of(camera)
        self._max_attitude_rad = math.radians(cfg.max_attitude_error_deg)
        self._ambiguous_rad = math.radians(2.0 * cfg.attitude_sigma_deg)
        self._clear_rad = min(self._ambiguous_rad, self._max_attitude_rad)

    def solve(
        self,
        points_m: Array,
        pixels: Array,
        sigma_px: Array,
        attitude: Attitude,
        start: PnpSolution | None = None,
    ) -> PnpSolution | None:
        """Pose from n ≥ 3 correspondences, None where no solver finds one in front of the camera.

        Args:
            points_m: (n, 3) beacons in the station frame.
            pixels: (n, 2) their images.
            sigma_px: (n,) standard deviation of each image point per axis.
            attitude: the vehicle's own.
            start: the last frame's solution: refined directly, without the solver chosen by count.
        """
        return self.solve_lights(light_table(points_m, pixels, sigma_px), attitude, start)

    def solve_lights(
        self, lights: Records[Light], attitude: Attitude, start: PnpSolution | None = None
    ) -> PnpSolution | None:
        """The same from a table (n,) of lights, some of them perhaps predicted."""
        n = len(lights)
        if n < 3:
            return None
        first = None
        if start is not None:
            first = self._refine(start.record["pose"], lights, attitude, "tracked")
        elif n >= 5:
            first = self._sqpnp(lights, attitude)
        if first is not None and first.attitude_error_rad <= self._clear_rad:
            return first
        tried = [first]
        if first is None or first.attitude_error_rad > self._ambiguous_rad:
            tried.append(self._from_prior(lights, attitude))
        found = [
            solution
            for solution in tried
            if solution is not None and solution.attitude_error_rad <= self._max_attitude_rad
        ]
        return min(found, key=self._judge) if found else None

    def plain(self, points_m: Array, pixels: Array, sigma_px: Array, attitude: Attitude) -> PnpSolution | None:
        """The standard PnP of the comparison: OpenCV's iterative solver, n ≥ 4 lights of a plane, attitude ignored."""
        xy = self._camera.normalise(pixels)
        start = solve_pnp(points_m, xy, cv2.SOLVEPNP_ITERATIVE, 4)
        if start is None:
            return None
        return self._refine(_packed(*start), light_table(points_m, pixels, sigma_px), attitude, "plain")

    def by_count(
        self, points_m: Array, pixels: Array, sigma_px: Array, attitude: Attitude, start: PnpSolution | None
    ) -> PnpSolution | None:
        """Paper A's choice as printed (section 4.3), attitude ignored: five lights or more SQPnP, fewer the iterative.

        Args:
            points_m: (n, 3) beacons in the station frame.
            pixels: (n, 2) their images.
            sigma_px: (n,) standard deviation of each image point per axis.
            attitude: the solution is told how far it is off; it must have no weight in the settings.
            start: where three lights begin, for which OpenCV's iterative solver needs a start; None gives none.
        """
        n = len(points_m)
        if n >= 5:
            return self._sqpnp(light_table(points_m, pixels, sigma_px), attitude)
        if n == 4:
            return self.plain(points_m, pixels, sigma_px, attitude)
        if n < 3 or start is None:
            return None
        return self._refine(start.record["pose"], light_table(points_m, pixels, sigma_px), attitude, "iterative")

    def mirrored(self, solution: PnpSolution, lights: Records[Light], attitude: Attitude) -> PnpSolution | None:
        """The other pose of a plane (Schweighofer & Pinz 2006), refined from the mirror image of a solution.

        Seen from afar, a plane turned by θ about an axis across the line of sight looks like one turned by -θ: R' =
        exp(2 θ a) R, about the lights' centre, with a the unit vector of n × l, n the array's normal away from the
        camera and l the line of sight to its centre.

        Args:
            solution: pose of lights that lie more or less in a plane across the station's x axis.
            lights: (n,) those lights.
            attitude: as in `solve`.

        Returns:
            That pose, which may be the solution itself, or None where there is none.
        """
        middle = lights["place_m"].mean(axis=0)
        centre = solution.rotation @ middle + solution.translation_m
        sight, normal = centre / np.linalg.norm(centre), -solution.rotation[:, 0]
        across = np.asarray(np.cross(normal, sight), dtype=np.float64)
        sine = float(np.linalg.norm(across))
        if sine == 0.0:
            return solution
        angle = 2.0 * math.atan2(sine, float(normal @ sight))
        turn = rotation_of(across * (angle / sine))
        rotation = turn @ solution.rotation
        start = _packed(vector_of(rotation), centre - rotation @ middle)
        return self._refine(start, lights, attitude, solution.solver)

    def project(self, solution: PnpSolution, points_m: Array) -> Array:
        """(k, 2) pixels of station points (k, 3) under a solution."""
        return project(points_m, solution.rotation_vector, solution.translation_m, self._matrix, self._distortion)[0]

    def _judge(self, solution: PnpSolution) -> float:
        return solution.cost + self._attitude_weight * solution.attitude_error_rad**2

    def _sqpnp(self, lights: Records[Light], attitude: Attitude) -> PnpSolution | None:
        start = solve_pnp(*self._parts(lights), cv2.SOLVEPNP_SQPNP, 5)
        return self._refine(_packed(*start), lights, attitude, "sqpnp") if start is not None else None

    def _from_prior(self, lights: Records[Light], attitude: Attitude) -> PnpSolution | None:
        translation = translation_from_rotation(attitude.rotation, *self._parts(lights))
        if translation is None:
            return None
        return self._refine(_packed(vector_of(attitude.rotation), translation), lights, attitude, "iterative")

    def _parts(self, lights: Records[Light]) -> tuple[Array, Array]:
        """Places (n, 3) and normalised images (n, 2) of lights, each of its own memory as OpenCV wants them."""
        return lights["place_m"].copy(), self._camera.normalise(lights["centre_px"].copy())

    def _refine(
        self, start: Records[Pose], lights: Records[Light], attitude: Attitude, solver: str
    ) -> PnpSolution | None:
        """Levenberg–Marquardt on the weighted reprojection error; from the last frame's pose it may stop sooner."""
        tilt_weight = heading_weight = self._prior_weight
        if attitude.heading_sigma_rad is not None:
            heading_weight = min(1.0 / attitude.heading_sigma_rad**2, heading_weight)
        decrement = _DECREMENT_TRACKED if solver == "tracked" else _DECREMENT
        record: Records[Solution] = new_rows(1, dtype=_SOLUTION)
        solve_from(start, lights, attitude.rotation, self._lens, tilt_weight, heading_weight, decrement, record)
        cost = record["cost"].item()
        if cost != cost:
            return None
        return PnpSolution(record, len(lights), record["attitude_error_rad"].item(), cost, solver)


def light_table(points_m: Array, pixels: Array, sigma_px: Array) -> Records[Light]:
    """(n,) seen lights at places (n, 3) in the station frame, with images (n, 2) and their σ (n,)."""
    table = Light.zeros(len(pixels))
    table["place_m"], table["centre_px"], table["sigma_px"], table["is_seen"] = points_m, pixels, sigma_px, True
    return table


def lens_of(camera: Camera) -> Array:
    """(9,) a camera's lens as `numeric.lens` takes it."""
    matrix = camera.matrix
    return np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *camera.distortion])


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


def _packed(rotation_vector: Array, translation_m: Array) -> Records[Pose]:
    return Pose(rotation_vector, translation_m).packed()
