"""How bright a rotating beacon looks while its beam sweeps past: the pass profile, one family over all waters.

A beam of full angle D (half of the peak intensity) is a Gaussian of σ_b = D / 2 / √(2 ln 2). Scattering widens it and
gives it wings. What it makes of a beam of 10° by single photons (Fournier and Forand's phase function, b r from 0.5 to
25) is met within 4.5 % of the peak, and what Wells' (1973) small-angle spread would make of it within 2 %, by

    g(θ) = (1 + θ² / (2 β w²))^-β,    w = x σ_b,    β = 1.5 + 0.42 / (x - 1),

with the one parameter x > 1, the widening (form and constants ours): x → 1 is the Gaussian itself.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["MIN_WIDENING", "beam_sigma_rad", "pass_profile"]

MIN_WIDENING = 1.01
"""Least widening x that is fitted; g is a Gaussian within 0.5 % then."""
_TAIL = 1.5
_TAIL_RISE = 0.42


def beam_sigma_rad(divergence_deg: float) -> float:
    """σ_b of a Gaussian beam with the full angle `divergence_deg` at half of its peak intensity."""
    return math.radians(divergence_deg) / 2.0 / math.sqrt(2.0 * math.log(2.0))


def pass_profile(angle_rad: Array, sigma_rad: float | Array, widening: float | Array) -> Array:
    """Profile g at beam angles from the line of sight; widening and angle broadcast against each other."""
    x = np.maximum(widening, MIN_WIDENING)
    beta = _TAIL + _TAIL_RISE / (x - 1.0)
    square = (angle_rad / (x * sigma_rad)) ** 2
    return np.exp(-beta * np.log1p(square / (2.0 * beta)))
