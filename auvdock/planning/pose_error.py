"""How precisely the lights that are found fix the camera's place: dilution of precision."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array
from auvdock.planning.detectability import Detectability, Sighting

__all__ = ["position_sigma_m"]


def position_sigma_m(sees: Detectability, points_m: Array, sighting: Sighting) -> Array:
    """(m,) standard deviation of the camera's place, √trace, from the lights found; `inf` with fewer than four.

    The Cramér–Rao bound of the pose: covariance (Σ Jᵀ J / σ²)⁻¹ with J = (f / Z) [1 0 -x; 0 1 -y] [-R, [q]×], where
    q = R (p - c) is a light in the camera's frame, (x, y) = (q₁, q₂) / Z its normalised image and σ the precision of
    its centre. Lens distortion is left out: it scales J by less than the uncertainty of σ.
    """
    sight = sees.sight
    rotation = sight.frames(points_m)
    lights = sight.lights.lamps["place_m"][sight.array]
    q = np.einsum("mij,mnj->mni", rotation, lights[None] - points_m[:, None])
    z = np.maximum(q[:, :, 2], 1e-3)
    x, y = q[:, :, 0] / z, q[:, :, 1] / z
    zero, one = np.zeros_like(x), np.ones_like(x)
    image = np.stack([np.stack([one, zero, -x], axis=-1), np.stack([zero, one, -y], axis=-1)], axis=2)
    cross = np.stack(
        [
            np.stack([zero, -q[:, :, 2], q[:, :, 1]], axis=-1),
            np.stack([q[:, :, 2], zero, -q[:, :, 0]], axis=-1),
            np.stack([-q[:, :, 1], q[:, :, 0], zero], axis=-1),
        ],
        axis=2,
    )
    motion = np.concatenate([np.broadcast_to(-rotation[:, None], cross.shape), cross], axis=3)
    weight = sighting.found * (float(sight.camera.matrix[0, 0]) / z) / sighting.sigma_px
    jacobian = np.einsum("mnij,mnjk->mnik", image, motion) * weight[:, :, None, None]
    information = np.einsum("mnij,mnik->mjk", jacobian, jacobian)
    sigma = np.full(len(points_m), np.inf)
    enough = np.flatnonzero(sighting.count >= 4)
    if len(enough):
        # A ridge far below any real information keeps degenerate arrays invertible: their error comes out huge.
        ridge = 1e-9 * np.eye(6)
        covariance = np.linalg.inv(information[enough] + ridge)
        sigma[enough] = np.sqrt(np.trace(covariance[:, :3, :3], axis1=1, axis2=2))
    return sigma
