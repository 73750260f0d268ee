"""Jellyfish that shine: a bell with a bright rim and tentacles, soft and with a colour near the lamps'.

A bell is a thin shell. Along a ray at the distance ρ (in bell radii) from its middle the shell is 1 / √(1 - ρ² + ε)
thick, so its limb is brighter than its middle. The rim of Aequorea victoria glows at 508 nm, in spots; other jellies
scatter the light of lamps. Radiance, size and number are ours: such that they look like lights to a threshold.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array

__all__ = ["add_jellyfish"]

_MOST = 3
_RADIUS_PX = (4.0, 40.0)
_SOFT = 0.05
_COLOURS = np.array([[0.02, 0.6, 1.0], [0.05, 1.0, 0.75], [0.6, 0.7, 1.0], [1.0, 0.35, 0.3]])
"""Red, green, blue of blue, green, pale and red ones."""
_TENTACLES = 6


def add_jellyfish(electrons: NDArray[np.float32], full_e: float, rng: np.random.Generator) -> int:
    """Add one to three to an image (H, W, 3) of electrons, with up to 0.7 of `full_e`, the saturation level.

    Returns:
        How many.
    """
    height, width = electrons.shape[:2]
    count = int(rng.integers(1, _MOST + 1))
    for _ in range(count):
        radius = float(np.exp(rng.uniform(*np.log(_RADIUS_PX))))
        flat, turn = float(rng.uniform(0.45, 1.0)), float(rng.uniform(-math.pi, math.pi))
        centre = rng.uniform(0.0, (width, height))
        level = float(np.exp(rng.uniform(math.log(0.02), math.log(0.7)))) * full_e
        colour = _COLOURS[int(rng.integers(len(_COLOURS)))] * level
        picture = _picture(radius, flat, turn, rng)
        _add(electrons, picture, centre, colour.astype(np.float32))
    return count


def _picture(radius: float, flat: float, turn: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """(k, k) brightness of one, at most 1."""
    reach = math.ceil(2.6 * radius) + 3
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float64)
    along, across = u * math.cos(turn) + v * math.sin(turn), -u * math.sin(turn) + v * math.cos(turn)
    rho2 = (along / radius) ** 2 + (across / (flat * radius)) ** 2
    shell = np.where(rho2 < 1.0, 1.0 / np.sqrt(np.maximum(1.0 - rho2, 0.0) + _SOFT), 0.0) * math.sqrt(_SOFT)
    bell = shell * (0.5 + 0.5 / (1.0 + np.exp(-4.0 * across / radius)))
    rim = np.exp(-0.5 * ((np.sqrt(rho2) - 1.0) * radius / max(0.06 * radius, 0.7)) ** 2)
    spots = 0.5 + 0.5 * np.sin(np.arctan2(across / flat, along) * rng.integers(8, 30) + rng.uniform(0.0, 6.3))
    picture = bell + 0.6 * rim * spots * (across > 0.0)
    for offset in rng.uniform(-0.7, 0.7, _TENTACLES):
        sway = 0.15 * radius * np.sin(across / (0.5 * radius) + rng.uniform(0.0, 6.3))
        line = np.exp(-0.5 * ((along - offset * radius - sway) / max(0.03 * radius, 0.6)) ** 2)
        picture += 0.25 * line * np.exp(-np.maximum(across, 0.0) / radius) * (across > 0.0)
    blurred = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), max(0.05 * radius, 0.8))
    return np.asarray(blurred / max(float(blurred.max()), 1e-6), dtype=np.float32)


def _add(
    electrons: NDArray[np.float32],
    picture: NDArray[np.float32],
    centre: Array,
    colour: NDArray[np.float32],
) -> None:
    """Add a picture (k, k) of a colour (3,) about a pixel (2,)."""
    height, width = electrons.shape[:2]
    reach = len(picture) // 2
    x, y = round(float(centre[0])), round(float(centre[1]))
    left, top, right, bottom = (
        max(x - reach, 0),
        max(y - reach, 0),
        min(x + reach + 1, width),
        min(y + reach + 1, height),
    )
    if left < right and top < bottom:
        part = picture[top - y + reach : bottom - y + reach, left - x + reach : right - x + reach]
        electrons[top:bottom, left:right] += part[:, :, None] * colour
