"""Which lights a threshold detector cuts out as lights of their own.

`perception.threshold` subtracts what is broader than a window, cuts the image at a floor, and cuts each component again
at higher levels until it falls apart. So a light is found if, at one of these levels, it stands above the level and no
brighter light hangs together with it. Here the image is sampled where this is decided: at the lights, between them and
on a grid about them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from auvdock.core.arrays import Array, BoolArray
from auvdock.perception.spots import CELL_PX
from auvdock.perception.threshold import ThresholdCfg

__all__ = ["separate"]

_LEVELS = (0.0, 0.1, 0.2, 0.28, 0.35, 0.42, 0.5, 0.6, 0.675, 0.75, 0.825, 0.875, 0.9, 0.95, 0.975)
"""Levels between floor and peak: the detector's own cuts, and those of the parts between there and their peaks."""
_BETWEEN = (0.35, 0.5, 0.65)


def separate(
    codes_at: Callable[[Array], Array], pixels: Array, present: BoolArray, sigma_dn: Array, cfg: ThresholdCfg
) -> tuple[BoolArray, Array]:
    """Lights that are cut out on their own (m, k), and all lights' contrast above the background (m, k).

    Args:
        codes_at: codes (m, q) of the image at positions (m, q, 2).
        pixels: (m, k, 2) positions of the lights.
        present: (m, k) whether a light is on the sensor.
        sigma_dn: (m,) noise of the smoothed image.
        cfg: the detector.
    """
    m, k = present.shape
    peak = codes_at(pixels)
    peak = np.where(present, peak, 0.0)
    saddle = np.full((m, k, k), np.inf)
    first, second = np.triu_indices(k, 1)
    for part in _BETWEEN:
        middle = codes_at(pixels[:, first] * (1.0 - part) + pixels[:, second] * part)
        saddle[:, first, second] = np.minimum(saddle[:, first, second], middle)
    saddle[:, second, first] = saddle[:, first, second]
    ground = _background(codes_at, pixels, cfg.background_px)
    floor = np.maximum(cfg.min_contrast, cfg.noise_factor * sigma_dn)[:, None]
    top = (peak - ground).max(axis=1, keepdims=True)
    order = np.arange(k)
    brighter = (peak[:, None, :] > peak[:, :, None]) | (
        (peak[:, None, :] == peak[:, :, None]) & (order[None, None, :] < order[None, :, None])
    )
    brighter &= present[:, None, :]
    found = np.zeros((m, k), dtype=np.bool_)
    for fraction in _LEVELS:
        level = floor + fraction * (top - floor)
        margin = 0.0 if fraction == 0.0 else 3.0 * sigma_dn[:, None]
        above = peak - ground > level + margin
        joined = (saddle - ground[:, :, None] > level[:, :, None]) & brighter
        found |= above & ~joined.any(axis=2)
    return found & present, np.maximum(peak - ground, 0.0)


def _background(codes_at: Callable[[Array], Array], pixels: Array, window_px: int) -> Array:
    """(m, k) grey opening at the lights: the greatest, over windows that hold the light, of the least code in it."""
    m, k = pixels.shape[:2]
    # The detector's window is an odd number of cells; its ends are their centres.
    half_cells = round(window_px / CELL_PX / 2)
    steps = np.arange(-2, 3) * (half_cells * CELL_PX)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    samples = codes_at((pixels[:, :, None] + grid).reshape(m, k * 25, 2)).reshape(m, k, 5, 5)
    best = np.zeros((m, k))
    for i in range(3):
        for j in range(3):
            best = np.maximum(best, samples[:, :, i : i + 3, j : j + 3].min(axis=(2, 3)))
    return best
