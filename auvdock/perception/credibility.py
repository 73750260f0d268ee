"""Whether a solved pose can be believed: its fit, its own uncertainty, its range, and what chance would have found.

A reprojection error alone accepts poses that no light supports: four spots within a pixel of one another reproject well
at any range, and among a dozen spurious lights some four lie like four of six beacons. A pose is doubted by

1. its fit: χ² of reprojection and attitude prior at the solution, against its distribution for n lights;
2. its range: the standard deviation along the line of sight, σ_r, must be a small share of the range, and no lamp is
   seen farther away than its light reaches;
3. its step from the last pose: no farther off the vehicle's way than the noise of both poses explains;
4. its mirror image: a plane seen from afar has two poses, and where nobody knows the heading of the station, light
   alone must tell which it is (Schweighofer & Pinz 2006);
5. chance: identities that are handed out anew must be far likelier than spurious lights in those places. That is the
   score of multiple-hypothesis tracking (Reid 1979; Blackman & Popoli 1999, section 6.2), with the pose, which nobody
   knows beforehand, integrated out by Laplace's approximation.

All four stand on a light's σ, which is learnt from the poses before: see `Credibility.noise_after`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from auvdock.core.arrays import Array, IntArray
from auvdock.core.camera import Camera
from auvdock.core.checked import Checked
from auvdock.core.limits import OpenShare, Positive
from auvdock.numeric.compiled import compiled
from auvdock.numeric.lights import Solution
from auvdock.numeric.records import Records
from auvdock.perception.pnp import PnpSolution

__all__ = ["Credibility", "CredibilityCfg"]

_NOISE_FRAMES = 15.0
"""Length of the running mean of the lights' variance (ours)."""
_NOISE_MARGIN = 8.0
"""A light counts as so many times the variance that is shown: of the centres that `ThresholdDetector` finds, one in a
hundred is off by 10 times the median, since flakes and neighbours' halos shift it (ours)."""
_LEAST_NOISE, _GREATEST_NOISE = 0.08, 4.0
"""σ stays within 0.28 and 2 times σ_px (ours)."""
_MOST_SURPRISE = 9.0
"""One frame counts at most as three times the σ that is known, believed or not: strays must not widen it (ours)."""


@dataclass(frozen=True)
class CredibilityCfg(Checked):
    """When a solved pose is believed; all thresholds are ours."""

    fit_probability: OpenShare = 0.003
    """A right pose fits worse, or steps farther, with this probability each; one that does is not believed."""
    max_range_sigma: Positive = 0.1
    """Greatest σ_r over the range ..."""
    max_range_sigma_m: Positive = 0.3
    """... and σ_r that is always good enough: both are the error from which on an episode counts a pose as false."""
    max_range_m: Positive = 60.0
    """Lamps are seen no farther than this in any water (paper B saw a 30 W beacon at 50 m)."""
    speed_error_m_s: Positive = 0.5
    """The vehicle's way between two poses is known by its DVL to this speed: its noise, the hull's turning, which moves
    the camera, acceleration since the last pose (ours)."""
    mirror_log_odds: Positive = 6.9
    """Where the station's heading is not known: least natural logarithm of how much likelier a pose is than the other
    pose of the lights' plane; a thousand to one."""
    detection_probability: OpenShare = 0.9
    """Share of the beacons in view that a detector finds, for the odds of a new identification."""
    strays_n: Positive | None = None
    """Spurious lights that the detector is known to show in a frame, at most; more count where more lights are left
    unexplained. None where nobody knows: then all lights of the frame count as if they were."""
    min_log_odds: float = 6.9
    """Least natural logarithm of (probability of these lights if they are the beacons, over that if they are not): a
    thousand to one, as in a landing."""


class Credibility:
    """Judges the poses of one array in one camera."""

    def __init__(self, cfg: CredibilityCfg, camera: Camera, blue_m: Array, attitude_sigma_rad: float) -> None:
        """Keep what every judgement needs.

        Args:
            cfg: thresholds.
            camera: the camera.
            blue_m: (k, 3) blue lamps in the station frame.
            attitude_sigma_rad: standard deviation per axis of the attitude prior in the solutions, 0 for none.
        """
        self._cfg = cfg
        self._camera = camera
        self._blue_m = blue_m
        self._attitude_sigma_rad = attitude_sigma_rad
        self._attitude_rad2 = attitude_sigma_rad**2
        known = 3 if attitude_sigma_rad > 0.0 else 0
        self._freedom = [2.0 * lights + known - 6.0 for lights in range(len(blue_m) + 1)]
        self._worst_fit = [float(chdtri(f, cfg.fit_probability)) if f > 0 else math.inf for f in self._freedom]
        self._worst_step = float(chdtri(3.0, cfg.fit_probability))
        corner = camera.normalise(np.array([[-0.5, -0.5], [camera.width_px - 0.5, camera.height_px - 0.5]]))
        width, height = (corner[1] - corner[0]).tolist()
        # The camera may be anywhere from where the array lies within its field of view and its light's reach.
        self._log_volume = math.log(width * height * cfg.max_range_m**3 / 3.0)
        self._area_px = float(camera.width_px * camera.height_px)

    def holds(self, solution: PnpSolution, heading_known: bool = True) -> bool:
        """Whether fit, σ_r and range are those of a right pose.

        Across the line of sight the attitude prior bounds the error. Where the heading is not known, light alone does,
        and twice the greatest σ of the position counts in place of σ_r.
        """
        cfg = self._cfg
        range_m, variance = _along_sight(solution.record)
        if solution.cost > self._worst_fit[solution.lights_n] or range_m > cfg.max_range_m:
            return False
        if not heading_known:
            variance = 4.0 * float(np.linalg.eigvalsh(solution.covariance()[:3, :3])[-1])
        return variance <= max(cfg.max_range_sigma_m, cfg.max_range_sigma * range_m) ** 2

    def expected_cost(self, lights: int) -> float:
        """Mean of χ² at the pose of so many lights: their coordinates and the prior's, less the pose's six."""
        return self._freedom[lights]

    def follows(self, solution: PnpSolution, before: PnpSolution, way_m: Array, elapsed_s: float) -> bool:
        """Whether the vehicle can have come here from an earlier pose.

        The step less the way by DVL, in excess of what that way may be wrong, must be noise of both poses' lights. The
        attitude prior's error, which makes most of a distant pose's σ, is common to both and moves neither from the
        other: with the prior's weight P⁻¹, light alone makes Σ - Σ P⁻¹ Σ of a pose's covariance Σ.

        Args:
            solution: the pose.
            before: the earlier one.
            way_m: (3,) way since then in the station frame.
            elapsed_s: time since then.
        """
        length_m, variance = _step_off(solution.record, before.record, way_m, self._attitude_rad2)
        excess_m = length_m - self._cfg.speed_error_m_s * elapsed_s
        return excess_m <= 0.0 or excess_m**2 <= self._worst_step * variance

    def is_alone(self, solution: PnpSolution, mirrored: PnpSolution | None) -> bool:
        """Whether a pose is far likelier than the other pose of its plane, or both are one.

        Args:
            solution: the pose.
            mirrored: the other one, see `PnpSolver.mirrored`.
        """
        if mirrored is None:
            return True
        position = solution.T_station_camera()[:3, 3]
        apart_m = float(np.linalg.norm(mirrored.T_station_camera()[:3, 3] - position))
        if apart_m <= max(self._cfg.max_range_sigma_m, self._cfg.max_range_sigma * float(np.linalg.norm(position))):
            return True
        return mirrored.cost - solution.cost >= 2.0 * self._cfg.mirror_log_odds

    def noise_after(self, noise: float, solution: PnpSolution) -> float:
        """What is known of the variance of a light's place, over σ_px², after one more pose: in bounds, with a margin.

        A running mean of the lights' χ² over its expectation (Mehra 1970). That is 2 n - 6 + tr (P Σ)², with P the
        weight of the attitude prior and Σ the pose's covariance: what of the rotation the prior decides, the lights do
        not. σ_px is set for the worst that lights may do. In clear water they do twenty times better: what noise of
        σ_px could explain is none of theirs, and a prior that weighs too much against them biases the pose.

        Args:
            noise: what was known before, and what the lights were solved with: σ of √noise σ_px.
            solution: a pose, believed or not.
        """
        return _noise_after(noise, solution.record, 2.0 * solution.lights_n - 6.0, self._attitude_rad2)

    def log_odds(
        self,
        solution: PnpSolution,
        unused: IntArray,
        others_px: Array,
        sigma_px: float,
        heading_sigma_rad: float | None = None,
    ) -> float:
        """Natural logarithm of the odds that the lights behind a pose are beacons rather than spurious lights.

        For n lights that gave the pose, ln [(P_D A / N)^n ∫ Π N(z_i; pose) p(pose) d(pose)], where N strays lie on the
        area A (as many as there are lights, unless `strays_n` says better); the integral is
        (2π σ²)^{-n} e^{-χ²/2} (2π)³ √|Σ| p(pose), with p uniform over the positions from which lamps can be seen. Each
        further blue lamp that should be in view adds ln(P_D A N(z; pose) / N) for the light nearest to its place, or
        ln(1 - P_D) where there is none.

        Args:
            solution: pose of n lights, all seen.
            unused: rows of `blue_m` that are not among them.
            others_px: (m, 2) other blue lights, seen now or predicted.
            sigma_px: σ of a light's place per axis.
            heading_sigma_rad: σ of the prior about the station's upright axis where it is worse than the rest.
        """
        n = solution.lights_n
        found = self._cfg.detection_probability
        known = self._cfg.strays_n
        strays = n + len(others_px) if known is None else max(known, len(others_px))
        each = math.log(found * self._area_px / (2.0 * math.pi * strays))
        log_pose = 3.0 * math.log(2.0 * math.pi) + 0.5 * float(np.linalg.slogdet(solution.covariance())[1])
        log_pose += self._log_attitude(heading_sigma_rad) - self._log_volume
        odds = n * (each - 2.0 * math.log(sigma_px)) - 0.5 * solution.cost + log_pose
        for gap, spread in self._expected(solution, unused, others_px, sigma_px):
            missed = math.log(1.0 - found)
            if len(gap):
                distance = np.einsum("ij,ij->i", gap, np.linalg.solve(spread, gap.T).T)
                near = each - 0.5 * math.log(np.linalg.det(spread)) - 0.5 * float(distance.min())
                missed = max(missed, near)
            odds += missed
        return odds

    def _log_attitude(self, heading_sigma_rad: float | None) -> float:
        """Logarithm of the prior's density at its middle, or of that of any attitude."""
        if self._attitude_sigma_rad == 0.0:
            return -math.log(8.0 * math.pi**2)
        heading = max(self._attitude_sigma_rad, heading_sigma_rad or 0.0)
        sigmas = (self._attitude_sigma_rad, self._attitude_sigma_rad, heading)
        return -sum(math.log(sigma * math.sqrt(2.0 * math.pi)) for sigma in sigmas)

    def _expected(
        self, solution: PnpSolution, rows: IntArray, others_px: Array, sigma_px: float
    ) -> Iterator[tuple[Array, Array]]:
        """For each lamp in view: (m, 2) from its place to every other light, and the place's covariance (2, 2), px."""
        points = self._blue_m[rows] @ solution.rotation.T + solution.translation_m
        points = points[self._camera.in_view(points)]
        places = self._camera.project(points)
        focal_x, focal_y = float(self._camera.matrix[0, 0]), float(self._camera.matrix[1, 1])
        covariance = solution.covariance()
        for (x, y, z), place in zip(points.tolist(), places, strict=True):
            by_point = np.array([[focal_x / z, 0.0, -focal_x * x / z**2], [0.0, focal_y / z, -focal_y * y / z**2]])
            # y = R (X - c), and the camera turns by φ: dy = -R dc + y × φ.
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            by_pose = by_point @ np.hstack([-solution.rotation, cross])
            yield others_px - place, by_pose @ covariance @ by_pose.T + sigma_px**2 * np.eye(2)


@compiled
def _along_sight(solution: Records[Solution]) -> tuple[float, float]:
    """Distance of the camera from the station, and the variance of its position along that line, m²."""
    T, covariance = solution[0].T_station_camera, solution[0].covariance
    square = variance = 0.0
    for i in range(3):
        square += T[i, -1] * T[i, -1]
        for j in range(3):
            variance += T[i, -1] * covariance[i, j] * T[j, -1]
    return math.sqrt(square), variance / square


@compiled
def _step_off(
    solution: Records[Solution], before: Records[Solution], way_m: Array, attitude_rad2: float
) -> tuple[float, float]:
    """Length of the step between two poses less the way (3,), and the variance along it by both poses' lights, m²."""
    step, square = np.empty(3), 0.0
    for i in range(3):
        step[i] = solution[0].T_station_camera[i, -1] - before[0].T_station_camera[i, -1] - way_m[i]
        square += step[i] * step[i]
    length_m = math.sqrt(square)
    for i in range(3):
        step[i] /= length_m
    variance = _noise_along(solution[0], step, attitude_rad2) + _noise_along(before[0], step, attitude_rad2)
    return length_m, variance


@compiled
def _noise_along(solution: Solution, along: Array, attitude_rad2: float) -> float:
    """Variance of the position along a direction (3,) that the noise of the lights makes, m²."""
    variance, covariance = 0.0, solution.covariance
    for j in range(3):
        by_attitude = 0.0
        for i in range(3):
            variance += along[i] * covariance[i, j] * along[j]
            by_attitude += along[i] * covariance[i, 3 + j]
        if attitude_rad2 > 0.0:
            variance -= by_attitude * by_attitude / attitude_rad2
    return max(variance, 0.0)


@compiled
def _noise_after(noise: float, solution: Records[Solution], freedom: float, attitude_rad2: float) -> float:
    """`Credibility.noise_after` where lights alone have so many degrees of freedom."""
    if attitude_rad2 > 0.0:
        # How many of the rotation's three numbers the prior decides: tr (P Σ)².
        by_prior = (solution[0].covariance[3:, 3:] / attitude_rad2).ravel()
        freedom += min(np.dot(by_prior, by_prior), 3.0)
    if freedom <= 0.0:
        return noise
    shown = min(_NOISE_MARGIN * solution[0].lights_cost / freedom, _MOST_SURPRISE)
    return min(max(noise * (1.0 + (shown - 1.0) / _NOISE_FRAMES), _LEAST_NOISE), _GREATEST_NOISE)
