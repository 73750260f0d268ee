"""Light scattered once from an isotropic lamp, as an integral over the scattering angle.

Seen from a distance R at the angle θ off the lamp, light that was scattered by Θ came the way d = R cos(Θ/2 - θ) /
cos(Θ/2), and the element of the line of sight over the squared distance from the lamp is dΘ / (R sin θ). Hence its
radiance over what arrives from the lamp by inverse square alone is b R / sin θ × ∫_θ^π p(Θ) e^{-c d} dΘ.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.photons.phase import PhaseFunction

__all__ = ["SingleScattering"]

_ANGLES, _NODES = 500, 96
_LEAST_RAD = 1e-8


class SingleScattering:
    """Light scattered once by one phase function, over what arrives by inverse square alone and over e^{-a R}."""

    def __init__(self, phase: PhaseFunction) -> None:
        """Lay out the angles: Gauss and Legendre's over log Θ, even steps over log θ."""
        node, weight = np.polynomial.legendre.leggauss(_NODES)
        self._angle = np.geomspace(_LEAST_RAD, math.pi / 2.0, _ANGLES)
        angle = self._angle[:, None]
        span = np.log(math.pi / angle)
        turned = np.minimum(angle * np.exp(0.5 * (node + 1.0) * span), math.pi * (1.0 - 1e-15))
        # d / R - 1, without the difference of nearly equal cosines.
        self._detour = 2.0 * np.sin((turned - angle) / 2.0) * np.sin(angle / 2.0) / np.cos(turned / 2.0)
        self._scattered = phase.density(turned) * turned * weight * 0.5 * span

    def within(self, br: float, absorption: float, angle_rad: Array) -> Array:
        """(m,) radiance integrated over cones about the lamp: ∫ radiance × 2π sin θ dθ.

        Args:
            br: scattering b R.
            absorption: a / b.
            angle_rad: (m,) half angles above 0, to π / 2.
        """
        rings = 2.0 * math.pi * self._angle * self._times_sine(br, absorption)
        step = math.log(self._angle[1] / self._angle[0])
        slope = math.log(rings[1] / rings[0]) / step
        within = rings[0] / slope + np.concatenate([[0.0], np.cumsum(0.5 * (rings[1:] + rings[:-1])) * step])
        return np.exp(np.interp(np.log(angle_rad), np.log(self._angle), np.log(within)))

    def _times_sine(self, br: float, absorption: float) -> Array:
        """(500,) radiance × sin θ over the angles laid out."""
        left = np.exp(-(1.0 + absorption) * br * self._detour)
        return br * math.exp(-br) * np.einsum("ij,ij->i", self._scattered, left)
