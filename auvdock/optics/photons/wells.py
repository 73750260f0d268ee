"""Wells' (1973) small-angle halo, for comparison with the one by photons.

His optical transfer function of a path r is e^{-(a+b) r} e^{b r F(ψ)} with F = (1 - e^{-k}) / k, k = 2π θ0 ψ. F is the
mean of e^{-k u} for u uniform on [0, 1], so e^{-b r} e^{b r F} is the mean of e^{-k S} where S is the sum of N such u
and N is Poisson distributed with mean b r. And e^{-2π s ψ} is the transform of s / (2π (θ² + s²)^{3/2}), of which the
share 1 - s / √(θ² + s²) lies within θ: Wells' halo is a mixture of those over s = θ0 S. What was scattered once is in
closed form.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["wells_within"]

_BINS_PER_UNIT, _BINS = 64, 4096


def wells_within(theta0_rad: float, br: Array, angle_rad: Array) -> Array:
    """(n, m) halo within half angles (m,) at b r (n,), over what arrives by inverse square alone and e^{-a r}."""
    uniform = np.zeros(_BINS)
    uniform[: _BINS_PER_UNIT + 1] = 1.0 / _BINS_PER_UNIT
    uniform[[0, _BINS_PER_UNIT]] /= 2.0
    transform = np.fft.rfft(uniform)
    twice_or_more = np.array(
        [np.fft.irfft(np.exp(x * (transform - 1.0)) - math.exp(-x) * (1.0 + x * transform)) for x in br]
    )
    s, t = np.arange(_BINS) / _BINS_PER_UNIT, angle_rad / theta0_rad
    s[0] = 0.25 / _BINS_PER_UNIT
    within = np.maximum(twice_or_more, 0.0) @ (1.0 - s / np.hypot(t[:, None], s)).T
    return within + (br * np.exp(-br))[:, None] * (t + 1.0 - np.hypot(t, 1.0))
