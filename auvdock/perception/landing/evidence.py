"""How much more likely the station's lights explain a naming than spots that have nothing to do with them.

The odds of k named spots against as many strays, the pose integrated out by Laplace's method (MacKay 2003, chapter 27;
for tracks in clutter Blackman & Popoli 1999, section 6.2). Strays lie anywhere, λ = n/A of them per square pixel. The
station may lie anywhere in the image and at any height that the pressure gauge leaves, a volume V of camera places; its
attitude has the prior Λ_θ of `LevelSolver`; each light is seen or not with equal chance:

    O = |Λ_θ|^½ (2π)^(3/2) / (V |H + Λ|^½) · Π 1 / (2π σ_i² λ) · t_ν(χ²) · 2^-m.

t_ν is the density of the residuals over that of a perfect fit, Student's in place of Gauss's since σ itself is only
known roughly: halos that merge and flicker move a light by several of its σ.

Among strays alone the sum of O over all namings, the one that names nothing included, is 1 in the mean, for it is a
ratio of densities. So odds above T appear in no more than one of T frames (Markov's inequality; strays that crowd
together or follow the lights break it): that is what a threshold on O means.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.perception.landing.level import LevelPose

__all__ = ["log_odds"]

_NU = 4.0
"""Degrees of freedom of σ, ours: it is believed as if it came from four frames."""


def log_odds(
    pose: LevelPose, sigma_px: Array, lights_n: int, spots_n: int, image_px: tuple[int, int], volume_m3: float
) -> float:
    """Log odds ln O of a naming.

    Args:
        pose: the pose that its lights give.
        sigma_px: (k,) standard deviation of each named spot, per axis.
        lights_n: m, lights of the station.
        spots_n: n, spots in the image, the named ones among them.
        image_px: width and height of the image.
        volume_m3: V.
    """
    k = len(sigma_px)
    dof = 2 * k - 3
    # The information of the pixels as their σ says, without what the fit made of it.
    pixels = pose.information * max(1.0, pose.cost / dof)
    sign, log_det = np.linalg.slogdet(pixels + pose.prior)
    if sign <= 0.0:
        return -math.inf
    log_prior = float(np.linalg.slogdet(pose.prior[3:, 3:])[1])
    place = 0.5 * (log_prior - float(log_det)) + 1.5 * math.log(math.tau) - math.log(volume_m3)
    per_px2 = spots_n / (image_px[0] * image_px[1])
    spots = -float(np.log(math.tau * per_px2 * sigma_px * sigma_px).sum())
    half = 0.5 * (_NU + dof)
    fit = math.lgamma(half) - math.lgamma(0.5 * _NU) - 0.5 * dof * math.log(0.5 * _NU)
    fit -= half * math.log1p(pose.cost / _NU)
    return place + spots + fit - lights_n * math.log(2.0)
