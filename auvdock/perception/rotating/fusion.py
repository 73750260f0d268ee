"""Several turns together: where the beacon is and how its station lies, from azimuths, bearings and own motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.transforms import wrap_angle
from auvdock.perception.rotating.config import ForwardBeaconCfg

__all__ = ["BeaconEstimate", "Sweep", "fuse"]

_ITERATIONS = 8
_HUBER = 2.0
_DOF = 6.0


class Sweep(NamedTuple):
    """One pass as a measurement.

    Attributes:
        time_s: vehicle time.
        azimuth_rad: azimuth of the camera in the station frame, from the time.
        sigma_rad: its standard deviation, the clock's share left out.
        bearing_rad: compass bearing of the beacon.
        place_m: (2,) place of the camera, dead-reckoned in compass axes.
    """

    time_s: float
    azimuth_rad: float
    sigma_rad: float
    bearing_rad: float
    place_m: Array


class BeaconEstimate(NamedTuple):
    """Beacon and station as the passes so far tell, as seen from the place of the last.

    Attributes:
        bearing_rad: compass bearing of the beacon, in (-π, π].
        range_m: horizontal distance; without parallax that of the prior.
        axis_yaw_rad: compass yaw of the station's approach axis, in (-π, π].
        azimuth_rad: azimuth of the camera, bearing + π - axis yaw, in (-π, π].
        sigma_bearing_rad, sigma_range_m, sigma_axis_rad, sigma_azimuth_rad: standard deviations; the clock's constant
            error is not in them.
        turns: passes behind it.
        beacon_m: (2,) place of the beacon in the axes of `Sweep.place_m`.
    """

    bearing_rad: float
    range_m: float
    axis_yaw_rad: float
    azimuth_rad: float
    sigma_bearing_rad: float
    sigma_range_m: float
    sigma_axis_rad: float
    sigma_azimuth_rad: float
    turns: int
    beacon_m: Array


def fuse(sweeps: list[Sweep], cfg: ForwardBeaconCfg) -> BeaconEstimate:
    """Least squares over bearing β, inverse range ρ (both from the last place) and axis yaw ψ_s.

    The beacon lies at b = p_N + (cos β, sin β) / ρ; pass k at p_k expects β_k = atan2(b - p_k) and, for the camera lies
    opposite, A_k = β_k + π - ψ_s. ρ has a Gaussian prior; residuals beyond two deviations count less (Huber). The
    inverse range is nearly linear in bearings-only sights (Aidala & Hammel 1983). Covariance (JᵀWJ)⁻¹, scaled up by the
    residuals if they are larger than they should be.

    Args:
        sweeps: one or more, oldest first.
        cfg: standard deviations and the prior.

    Raises:
        ValueError: no sweep.
    """
    if not sweeps:
        raise ValueError("nothing to fuse")
    places = np.array([sweep.place_m for sweep in sweeps])
    azimuth = np.array([sweep.azimuth_rad for sweep in sweeps])
    bearing = np.array([sweep.bearing_rad for sweep in sweeps])
    deviation = np.concatenate(
        [np.full(len(sweeps), cfg.bearing_sigma_rad), np.array([max(sweep.sigma_rad, 1e-4) for sweep in sweeps])]
    )
    back = places - places[-1]
    heading = bearing + math.pi - azimuth
    psi = math.atan2(float(np.median(np.sin(heading))), float(np.median(np.cos(heading))))
    p = np.array([float(bearing[-1]), cfg.inverse_range_per_m, psi])
    normal, chi2 = np.eye(3), 0.0
    for _ in range(_ITERATIONS):
        cosine, sine = math.cos(p[0]), math.sin(p[0])
        # Scaled by ρ, so that a beacon at infinity is no special case.
        east, north = cosine - p[1] * back[:, 0], sine - p[1] * back[:, 1]
        square = np.maximum(east**2 + north**2, 1e-6)
        expected = np.arctan2(north, east)
        by_bearing = (cosine * east + sine * north) / square
        by_inverse = (back[:, 0] * north - back[:, 1] * east) / square
        r = np.concatenate([_wrap(bearing - expected), _wrap(azimuth - expected - math.pi + p[2])]) / deviation
        jacobian = np.zeros((len(r), 3))
        jacobian[:, 0] = np.tile(by_bearing, 2)
        jacobian[:, 1] = np.tile(by_inverse, 2)
        jacobian[len(sweeps) :, 2] = -1.0
        jacobian /= deviation[:, None]
        weight = np.minimum(1.0, _HUBER / np.maximum(np.abs(r), 1e-12))
        normal = jacobian.T @ (jacobian * weight[:, None])
        gradient = jacobian.T @ (r * weight)
        prior = 1.0 / cfg.inverse_range_sigma_per_m**2
        normal[1, 1] += prior
        gradient[1] += prior * (cfg.inverse_range_per_m - p[1])
        chi2 = float((weight * r * r).sum())
        step = np.linalg.solve(normal, gradient)
        p = p + step
        p[1] = min(max(p[1], 1e-3), 1.0)
        if float(np.abs(step * np.array([1.0, 20.0, 1.0])).max()) < 1e-7:
            break
    excess = max((_DOF + chi2) / (_DOF + max(2 * len(sweeps) - 3, 0)), 1.0)
    covariance = np.linalg.inv(normal) * excess
    to_azimuth = np.array([1.0, 0.0, -1.0])
    return BeaconEstimate(
        bearing_rad=wrap_angle(float(p[0])),
        range_m=1.0 / float(p[1]),
        axis_yaw_rad=wrap_angle(float(p[2])),
        azimuth_rad=wrap_angle(float(p[0] + math.pi - p[2])),
        sigma_bearing_rad=math.sqrt(covariance[0, 0]),
        sigma_range_m=math.sqrt(covariance[1, 1]) / float(p[1]) ** 2,
        sigma_axis_rad=math.sqrt(covariance[2, 2]),
        sigma_azimuth_rad=math.sqrt(to_azimuth @ covariance @ to_azimuth),
        turns=len(sweeps),
        beacon_m=places[-1] + np.array([math.cos(p[0]), math.sin(p[0])]) / p[1],
    )


def _wrap(angle: Array) -> Array:
    return np.arctan2(np.sin(angle), np.cos(angle))
