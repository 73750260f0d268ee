"""Lamps: radiant intensity from power, efficiency and beam profile."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.beacons import BeaconCfg

__all__ = ["beam_profile", "peak_intensity_w_sr", "profile_solid_angle_sr"]


def beam_profile(angle_rad: Array, beam_angle_deg: float) -> Array:
    """Intensity over peak intensity at an angle from the beam's axis.

    f(θ) = exp(-ln 2 (θ / θ_h)²) with θ_h half of the full beam angle: the intensity is halved at θ_h.
    """
    half = math.radians(beam_angle_deg) / 2
    return np.exp(-math.log(2.0) * (angle_rad / half) ** 2)


@lru_cache(maxsize=256)
def profile_solid_angle_sr(beam_angle_deg: float) -> float:
    """Equivalent solid angle ∫ f(θ) 2π sin θ dθ over the sphere, in steradian (trapezoid, 1e-6 relative)."""
    angle = np.linspace(0.0, math.pi, 20001)
    return float(np.trapezoid(beam_profile(angle, beam_angle_deg) * 2.0 * math.pi * np.sin(angle), angle))


def peak_intensity_w_sr(beacon: BeaconCfg) -> float:
    """On-axis radiant intensity in W/sr: power × efficiency over the profile's solid angle."""
    return beacon.power_w * beacon.efficiency / profile_solid_angle_sr(beacon.beam_angle_deg)
