"""Paper B's formulae: scan rate, error budget, azimuth from time, deviation angles by line of sight (equations 3 to 6).

Paper B, "Deep Learning-Based Docking Scheme for Autonomous Underwater Vehicles with an Omnidirectional Rotating
Optical Beacon", section 4.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.camera import Camera

__all__ = ["azimuth_from_time_deg", "deviation_angles_rad", "error_budget_deg", "max_scan_rate_rev_s"]


def max_scan_rate_rev_s(frame_rate_hz: float, observable_deg: float) -> float:
    """Greatest scan rate at which every turn is seen in at least one frame: s' = f a / 360° (equation 3).

    Args:
        frame_rate_hz: f, the camera's rate.
        observable_deg: a, full angle within which the beam is seen. The paper takes the beam's 10°, hence 0.83 rev/s at
            30 Hz; scattering widens it (see `docs/rotating_beacon.md`).
    """
    return frame_rate_hz * observable_deg / 360.0


def error_budget_deg(frame_rate_hz: float, rate_rev_s: float, observational_error_deg: float) -> float:
    """Greatest azimuth error of a method that picks a frame: e' = 360° s / f + e (equation 4); 8° at 30 Hz, 0.5, 2°."""
    return 360.0 * rate_rev_s / frame_rate_hz + observational_error_deg


def azimuth_from_time_deg(detected_s: float, initial_s: float, rate_rev_s: float) -> float:
    """Azimuth in [0, 360) from the time of the beam's passing: A = ((t_det - t_init) mod 1/s) s 360° (equation 5)."""
    return ((detected_s - initial_s) % (1.0 / rate_rev_s)) * rate_rev_s * 360.0


def deviation_angles_rad(u_px: float, v_px: float, camera: Camera) -> tuple[float, float]:
    """Horizontal and vertical deviation angle (right, down) of a light at a pixel, by the paper's equation 6.

    α = atan(2 u / M tan α0), β = atan(2 v / N tan β0), with (u, v) counted from the image's centre, M × N the image's
    width and height, and α0, β0 *half* of the fields of view. The paper calls M the number of rows and α0, β0 the
    fields of view; taken literally, a light at the image's edge would lie 85° off the axis instead of 42.5°. Equation 6
    knows no distortion: the two angles agree with the camera's data on the image's axes only.
    """
    # The data sheet's fields of view: rays through the middles of the image's edges.
    middle = np.array([(camera.width_px - 1) / 2, (camera.height_px - 1) / 2])
    edges = np.array([[camera.width_px - 0.5, middle[1]], [middle[0], camera.height_px - 0.5]])
    (tan_alpha0, _), (_, tan_beta0) = camera.normalise(edges).tolist()
    u, v = u_px - float(middle[0]), v_px - float(middle[1])
    return (
        math.atan(2.0 * u / camera.width_px * tan_alpha0),
        math.atan(2.0 * v / camera.height_px * tan_beta0),
    )
