"""P_out = K1 P_L + K2 P_A with K1 + K2 = I (paper C, section 2.2): the weights of least variance.

Both poses lean on the same attitude of the vehicle, so their errors are correlated: with e = C (… + Λ w), w the error
of the attitude, X = cov(e_L, e_A) = C_L Λ C_A, and the best weights are those of Bar-Shalom & Campo (1986):

    K2 = (C_L - X) (C_L + C_A - X - Xᵀ)⁻¹,    K1 = I - K2.
"""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.linear import solve_positive
from auvdock.core.transforms import make_transform
from auvdock.perception.landing.level import LevelPose, pose_offset, rotated

__all__ = ["agree", "weighted_mean"]


def weighted_mean(lights: LevelPose, tag: LevelPose) -> tuple[Array, Array]:
    """(pose (4, 4), covariance (6, 6)) of both levels; headings are averaged on the circle, as all rotation is."""
    c_l, c_a, x = _covariances(lights, tag)
    offset = pose_offset(lights.T_station_camera, tag.T_station_camera)
    weights = solve_positive(c_l + c_a - x - x.T, (c_l - x).T)
    # Where the difference has no variance in some direction both are the same there: either will do.
    k2 = np.zeros((6, 6)) if weights is None else weights.T
    k1 = np.eye(6) - k2
    step = k2 @ offset
    T = lights.T_station_camera
    pose = make_transform(rotated(T[:3, :3], step[3:]), T[:3, 3] + step[:3])
    covariance = k1 @ c_l @ k1.T + k2 @ c_a @ k2.T + k1 @ x @ k2.T + k2 @ x.T @ k1.T
    return pose, 0.5 * (covariance + covariance.T)


def agree(lights: LevelPose, tag: LevelPose, gate: float) -> bool:
    """Whether the levels' poses lie within the gate (squared Mahalanobis distance) of each other."""
    c_l, c_a, x = _covariances(lights, tag)
    offset = pose_offset(lights.T_station_camera, tag.T_station_camera)
    weighed = solve_positive(c_l + c_a - x - x.T, offset)
    return weighed is not None and float(offset @ weighed) <= gate


def _covariances(lights: LevelPose, tag: LevelPose) -> tuple[Array, Array, Array]:
    c_l, c_a = lights.estimate.covariance, tag.estimate.covariance
    return c_l, c_a, c_l @ lights.prior @ c_a
