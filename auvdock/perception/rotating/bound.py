"""Cramér–Rao bound on the time at which a rotating beacon's beam passes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.perception.rotating.profile import pass_profile

__all__ = ["PassBound", "PassSignal", "mean_bound", "peak_bound"]


class PassSignal(NamedTuple):
    """What a pass sends into the measured disc, frame by frame.

    Attributes:
        peak_e: photo-electrons of the beacon in one frame at the peak.
        background_e: photo-electrons of everything else in the disc in one frame.
        read_variance_e2: read noise of the disc: pixels × σ_r².
        widening: x of `pass_profile`.
    """

    peak_e: float
    background_e: float
    read_variance_e2: float
    widening: float


class PassBound(NamedTuple):
    """The bound as beam angle and as time."""

    angle_rad: float
    time_s: float


def peak_bound(
    signal: PassSignal, beam_sigma_rad: float, rate_rev_s: float, frame_rate_hz: float, phase: float
) -> PassBound:
    """Least standard deviation of an unbiased estimate of the peak from one pass.

    Samples N_i = a g(θ_i - δ; x) + B with θ_i = 2π s (i + phase) / f and variance v_i = N_i + σ_r² (photon noise and
    read noise, both as Gaussian of known variance). Fisher information of p = (δ, a, ln(x - 1)):
    I_jk = Σ_i ∂_j N_i ∂_k N_i / v_i, and var δ ≥ (I⁻¹)_δδ (Kay 1993, Fundamentals of Statistical Signal Processing,
    section 3.9, without the term from the variance's own dependence on p). Amplitude and widening are unknown, B known.

    Args:
        signal: light of the pass.
        beam_sigma_rad: σ_b of the beam.
        rate_rev_s: s.
        frame_rate_hz: f.
        phase: in [0, 1): where between two frames the peak falls.
    """
    step = math.tau * rate_rev_s / frame_rate_hz
    angle: Array = step * (np.arange(-_half(step), _half(step) + 1, dtype=np.float64) + phase)
    excess = math.log(max(signal.widening - 1.0, 1e-6))

    def light(offset: float, amplitude: float, log_excess: float) -> Array:
        return amplitude * pass_profile(angle - offset, beam_sigma_rad, 1.0 + math.exp(log_excess))

    a, h = signal.peak_e, 1e-4
    slopes = np.column_stack(
        [
            (light(h * beam_sigma_rad, a, excess) - light(-h * beam_sigma_rad, a, excess)) / (2.0 * h * beam_sigma_rad),
            light(0.0, 1.0, excess),
            (light(0.0, a, excess + h) - light(0.0, a, excess - h)) / (2.0 * h),
        ]
    )
    variance = light(0.0, a, excess) + signal.background_e + signal.read_variance_e2
    information = slopes.T @ (slopes / variance[:, None])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    inverse = np.linalg.pinv(information * scale[:, None] * scale)
    angle_rad = math.sqrt(max(float(inverse[0, 0]), 0.0)) * float(scale[0])
    return PassBound(angle_rad, angle_rad / (math.tau * rate_rev_s))


def mean_bound(
    signal: PassSignal, beam_sigma_rad: float, rate_rev_s: float, frame_rate_hz: float, phases: int = 16
) -> PassBound:
    """Root mean square of `peak_bound` over where between two frames the peak falls."""
    bounds = [
        peak_bound(signal, beam_sigma_rad, rate_rev_s, frame_rate_hz, (k + 0.5) / phases).angle_rad
        for k in range(phases)
    ]
    angle_rad = math.sqrt(sum(bound * bound for bound in bounds) / phases)
    return PassBound(angle_rad, angle_rad / (math.tau * rate_rev_s))


def _half(step: float) -> int:
    """Frames on either side of the peak that see any of the beam: a quarter turn."""
    return max(2, math.ceil(0.5 * math.pi / step))
