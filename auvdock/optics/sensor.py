"""The image sensor: electrons to 8 bits, with shot noise, read noise and saturation.

With mean signal e and read noise σ_r, an electron count has variance e + σ_r². In u = √(e + σ_r²) that noise has the
standard deviation 1/2 at every level (Anscombe 1948), so noise costs one addition: u' = u + n/2 with n from a tile of
standard normal numbers, drawn once per reset and read at a random offset per frame. The output code is

    DN = 255 (u' - σ_r) / (√(full well / gain + σ_r²) - σ_r)     for the encoding "sqrt",
    DN = 255 (u'² - σ_r²) gain / full well                       for "linear",

rounded and clipped to 0…255. In both, the decoded electrons have a variance that is linear in their mean, slope 1.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
from auvdock.numeric.compiled import compiled
from auvdock.numeric.constants import SATURATED_CODE
from auvdock.numeric.records import Records
from auvdock.optics.meeting import CodeScale, codes, noise_dn
from auvdock.optics.settings import ImagingCfg

__all__ = ["Sensor", "SensorScale", "saturated_share"]

_SPARE_PX = 64


class SensorScale:
    """The code's scale at one exposure: electrons ↔ DN, without noise.

    Attributes:
        read_e: read noise in electrons.
        full_scale_e: electrons of the greatest code.
        dn_per_root: codes per √electron.
        saturated_e: electrons at which a sample counts as saturated.
        law: the same for compiled code, one row.
    """

    def __init__(self, cfg: ImagingCfg, gain: float) -> None:
        """Precompute the constants."""
        self._linear = cfg.encoding == "linear"
        self._read2 = cfg.read_noise_e**2
        self.read_e = cfg.read_noise_e
        self.full_scale_e = cfg.full_well_e / gain
        self.dn_per_root = 255.0 / (math.sqrt(self.full_scale_e + self._read2) - cfg.read_noise_e)
        if self._linear:
            self.saturated_e = SATURATED_CODE * self.full_scale_e / 255.0
        else:
            self.saturated_e = (SATURATED_CODE / self.dn_per_root + self.read_e) ** 2 - self._read2
        linear = 255.0 / self.full_scale_e if self._linear else 0.0
        noise_dn = math.sqrt(0.25 * self.dn_per_root**2 + 1.0 / 12.0)
        scale = CodeScale(linear, self.read_e, self.dn_per_root, noise_dn, self.saturated_e)
        self.law: Records[CodeScale] = scale.packed()

    def codes(self, electrons: Array) -> Array:
        """Unrounded, unclipped codes of electrons, any shape."""
        return codes(electrons.ravel(), self.law).reshape(electrons.shape)

    def electrons(self, codes: Array) -> Array:
        """Electrons of codes, any shape; inverse of `codes`."""
        if self._linear:
            return codes * (self.full_scale_e / 255.0)
        return (codes / self.dn_per_root + self.read_e) ** 2 - self._read2

    def metered_code(self, metered: float) -> int:
        """Code from which samples count in the exposure metering, at a share of the saturation level."""
        if metered == 1.0:
            return SATURATED_CODE
        return round(float(self.codes(np.array([metered * self.saturated_e]))[0]))

    def noise_dn(self, electrons: Array) -> Array:
        """Standard deviation of the code at a signal in electrons, quantisation included."""
        return noise_dn(electrons.ravel(), self.law).reshape(electrons.shape)


class Sensor:
    """Turns a buffer of electrons into the image."""

    def __init__(self, width_px: int, height_px: int, cfg: ImagingCfg) -> None:
        """Allocate nothing but sizes; the noise tile comes with `reset`."""
        self._cfg = cfg
        self._size = (height_px, width_px)
        self._tile: NDArray[np.float32] | None = None
        self._rng = np.random.default_rng(0)

    def reset(self, rng: np.random.Generator) -> None:
        """Take a generator of its own and draw the noise tile."""
        self._rng = rng
        height, width = self._size
        if self._cfg.noise:
            shape = (height + _SPARE_PX, width + _SPARE_PX, 3)
            self._tile = rng.standard_normal(shape, dtype=np.float32)

    def expose(self, electrons: NDArray[np.float32], gain: float) -> Image:
        """Image (H, W, 3) uint8 of mean electrons float32, (H, W, 3) or more to the right and below."""
        cfg = self._cfg
        scale = SensorScale(cfg, gain)
        height, width = self._size
        image = np.empty((height, width, 3), dtype=np.uint8)
        y = x = 0
        tile = self._tile
        if tile is None:
            tile = np.zeros((height, width, 3), dtype=np.float32)
        else:
            y, x = self._rng.integers(0, _SPARE_PX + 1, 2).tolist()
        linear = cfg.encoding == "linear"
        k = 255.0 / scale.full_scale_e if linear else scale.dn_per_root
        _expose(
            _rows(electrons), _rows(tile), y, 3 * x, np.float32(cfg.read_noise_e), np.float32(k), linear, _rows(image)
        )
        return image


def _rows(image: NDArray[Any]) -> NDArray[Any]:
    """(h, 3 w) view of an image (h, w, 3)."""
    return image.reshape(len(image), -1)


@compiled
def _expose(
    electrons: NDArray[np.float32],
    tile: NDArray[np.float32],
    y: int,
    x: int,
    read_e: np.float32,
    k: np.float32,
    linear: bool,
    image: Image,
) -> None:
    """Codes (h, n) of electrons (h, n or more) with the noise tile shifted by (y, x): the module's equations."""
    height, width = image.shape
    read2 = read_e * read_e
    half, top = np.float32(0.5), np.float32(255.0)
    codes = np.empty(width, dtype=np.int32)
    for row in range(height):
        mean, noise, out = electrons[row][:width], tile[row + y][x : x + width], image[row]
        if linear:
            for i in range(width):
                root = np.sqrt(mean[i] + read2) + half * noise[i]
                codes[i] = np.int32(min(k * (root * root - read2) + half, top))
        else:
            for i in range(width):
                codes[i] = np.int32(min(k * (np.sqrt(mean[i] + read2) + (half * noise[i] - read_e)) + half, top))
        # A loop of its own: only so both become vector instructions.
        for i in range(width):
            out[i] = max(codes[i], 0)


def saturated_share(image: Image, code: int = SATURATED_CODE) -> float:
    """Share of an image's samples at or above a code."""
    flat = image.reshape(image.shape[0], -1)
    return cv2.countNonZero(cv2.threshold(flat, code - 1, 255, cv2.THRESH_BINARY)[1]) / flat.size
