"""Small pictures of round lights, and small data sets without OpenGL."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array
from auvdock.core.strict import merge
from auvdock.dataset.config import DatasetCfg, load_dataset_cfg
from auvdock.dataset.rules import Light
from auvdock.numeric.constants import BLUE
from auvdock.optics.sensor import SensorScale
from auvdock.optics.settings import ImagingCfg

RADII_PX = np.geomspace(0.35, 120.0, 60)
SCALE = SensorScale(ImagingCfg(), 1.0)
WIDTH, HEIGHT = 96, 64
BLUE_LIGHT = (0.02, 0.3, 1.0)
RED_LIGHT = (1.0, 0.1, 0.02)


def light(
    name: str,
    x: float,
    y: float,
    peak_e: float,
    *,
    sigma_px: float = 1.2,
    colour: tuple[float, float, float] = BLUE_LIGHT,
    **more: Any,
) -> Light:
    """A Gaussian spot."""
    profile = peak_e * np.exp(-0.5 * (RADII_PX / sigma_px) ** 2)
    return Light(name, BLUE, np.array([x, y]), profile[:, None] * np.array(colour), 10.0, 4.0, **more)


def picture(lights: list[Light], background_e: float = 50.0) -> NDArray[np.float32]:
    """(H, W, 3) electrons of lights before an even background."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float64)
    image: Array = np.full((HEIGHT, WIDTH, 3), background_e)
    for item in lights:
        radius = np.hypot(u - item.pixel[0], v - item.pixel[1])
        for channel in range(3):
            image[:, :, channel] += np.interp(radius, RADII_PX, item.profile_e[:, channel])
    return image.astype(np.float32)


def small_cfg(**changes: dict[str, Any]) -> DatasetCfg:
    """The default but for small pictures of four to a scene, without surfaces, and changes of single tables."""
    base = {
        "scenes": {"conditions": 2, "frames": 2},
        "camera": {"width_px": 192, "height_px": 108},
        "nuisance": {"surfaces": False},
    }
    tables = {name: {**base.get(name, {}), **changes.get(name, {})} for name in {*base, *changes}}
    return merge(load_dataset_cfg(), tables)
