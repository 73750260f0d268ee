"""Peak of one pass: the beam angle at which the beacon was brightest, between frames, from a few samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.perception.rotating.profile import MIN_WIDENING, pass_profile

__all__ = ["PassFit", "fit_pass"]

_LOG_EXCESS = np.log(np.geomspace(0.03, 2.0, 7))
_MIN_LOG_EXCESS = math.log(MIN_WIDENING - 1.0)
_OFFSETS = 61
_STEPS = 12
_PRIOR_DOF = 4.0
_MAX_RATIO = 1e100
"""Flux over its standard deviation; no light is so steady."""


class PassFit(NamedTuple):
    """Fit of one pass.

    Attributes:
        offset_rad: beam angle of the peak, in the frame of the samples' angles.
        amplitude: flux at the peak.
        widening: x of `pass_profile`.
        sigma_rad: standard deviation of `offset_rad`, misfit included.
        chi2: weighted sum of squared residuals of the samples.
    """

    offset_rad: float
    amplitude: float
    widening: float
    sigma_rad: float
    chi2: float


def fit_pass(
    angle_rad: Array,
    flux: Array,
    sigma: Array,
    seen: BoolArray,
    beam_sigma_rad: float,
    prior_log_excess: tuple[float, float] = (math.log(0.25), 1.0),
) -> PassFit | None:
    """Least squares of a g(θ_i - δ; x) on the samples over amplitude a, peak δ and widening x.

    Minimises Σ_seen ((F_i - a g_i) / σ_i)² + Σ_unseen (max(0, a g_i - F_i) / σ_i)² + ((ln(x - 1) - μ) / τ)²: a frame in
    which the light was not found tells only that it was dimmer than what a detector finds. A grid gives the start, then
    damped Gauss–Newton steps. The standard deviation is that of the linearised problem, times the root of the reduced
    χ² with four prior degrees of freedom of 1 (so few samples tell little of their own scatter). None where numbers are
    not finite, or too large to square.

    Args:
        angle_rad: (n,) beam angles of the samples; any origin.
        flux: (n,) flux above the steady light; for frames without the light, the least that would have been found.
        sigma: (n,) standard deviations of `flux`.
        seen: (n,) whether the light was found.
        beam_sigma_rad: σ_b of the beam.
        prior_log_excess: mean μ and standard deviation τ of ln(x - 1).

    Raises:
        ValueError: no sample in which the light was found.
    """
    if not seen.any():
        raise ValueError("a pass needs a sample in which the light was found")
    if not (np.isfinite(angle_rad).all() and np.abs(flux / sigma).max() < _MAX_RATIO):
        return None
    mean, spread = prior_log_excess
    if int(seen.sum()) == 1:
        # Anywhere between its neighbours is as likely: the middle, with the deviation of a uniform distribution.
        row = int(seen.argmax())
        gap = float(np.diff(np.sort(angle_rad)).min()) if len(angle_rad) > 1 else 2.0 * beam_sigma_rad
        return PassFit(float(angle_rad[row]), float(flux[row]), 1.0 + math.exp(mean), gap / math.sqrt(12.0), 0.0)
    start = _start(angle_rad, flux, sigma, seen, beam_sigma_rad, prior_log_excess)
    p: Array = np.array(start)
    weight = 1.0 / sigma

    def residuals(q: Array) -> Array:
        model = math.exp(q[1]) * pass_profile(angle_rad - q[0], beam_sigma_rad, 1.0 + math.exp(q[2]))
        r = (model - flux) * weight
        return np.append(np.where(seen, r, np.maximum(r, 0.0)), (q[2] - mean) / spread)

    r = residuals(p)
    cost, damping = float(r @ r), 1e-3
    scale = np.array([beam_sigma_rad, 1.0, 1.0])
    jacobian = _slopes(residuals, p, r, scale)
    for _ in range(_STEPS):
        normal = jacobian.T @ jacobian
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), -jacobian.T @ r)
        trial: Array = p + np.minimum(np.maximum(step, -scale), scale)
        trial[2] = max(trial[2], _MIN_LOG_EXCESS)
        after = residuals(trial)
        if (new_cost := float(after @ after)) < cost:
            done = cost - new_cost < 1e-6
            p, r, cost, damping = trial, after, new_cost, max(damping * 0.3, 1e-9)
            jacobian = _slopes(residuals, p, r, scale)
            if done:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    chi2 = float(r[:-1] @ r[:-1])
    covariance = np.linalg.pinv(jacobian.T @ jacobian)
    dof = max(int(seen.sum()) - 3, 0)
    inflation = max((_PRIOR_DOF + chi2) / (_PRIOR_DOF + dof), 1.0)
    sigma_rad = math.sqrt(max(float(covariance[0, 0]), 0.0) * inflation)
    return PassFit(float(p[0]), math.exp(p[1]), 1.0 + math.exp(p[2]), sigma_rad, chi2)


def _start(
    angle: Array, flux: Array, sigma: Array, seen: BoolArray, beam: float, prior: tuple[float, float]
) -> tuple[float, float, float]:
    """(offset, ln amplitude, ln excess) of the best node of a grid; the amplitude is linear."""
    brightest = float(angle[seen][flux[seen].argmax()])
    gap = float(np.median(np.diff(np.sort(angle)))) if len(angle) > 1 else beam
    reach = max(1.5 * gap, beam)
    offsets = brightest + np.linspace(-reach, reach, _OFFSETS)
    widening = 1.0 + np.exp(_LOG_EXCESS)
    model = pass_profile(angle - offsets[:, None, None], beam, widening[:, None])
    w = np.where(seen, 1.0 / sigma**2, 0.0)
    amplitude = (model * flux * w).sum(axis=2) / np.maximum((model**2 * w).sum(axis=2), 1e-300)
    r = (amplitude[:, :, None] * model - flux) / sigma
    cost = (np.where(seen, r, np.maximum(r, 0.0)) ** 2).sum(axis=2) + ((_LOG_EXCESS - prior[0]) / prior[1]) ** 2
    row, column = np.unravel_index(int(cost.argmin()), cost.shape)
    return float(offsets[row]), math.log(max(float(amplitude[row, column]), 1e-12)), float(_LOG_EXCESS[column])


def _slopes(residuals: Callable[[Array], Array], p: Array, r: Array, scale: Array) -> Array:
    """(n + 1, 3) forward differences."""
    columns: list[Array] = []
    for k in range(3):
        step = 1e-5 * float(scale[k])
        moved = p.copy()
        moved[k] += step
        columns.append((residuals(moved) - r) / step)
    return np.column_stack(columns)
