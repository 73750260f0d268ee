"""The exposure metering's reading, predicted from the radiometry: what an image would show, without the image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.flash import FlashOptics
from auvdock.optics.scene import LitScene
from auvdock.optics.sensor import SensorScale
from auvdock.optics.spots import Spots
from auvdock.optics.view import View

__all__ = ["predicted_share", "veil_share"]


def predicted_share(
    lit: LitScene, view: View, spots: Spots | None = None, metered: float = 1.0
) -> Callable[[float], float]:
    """Saturated share of the image as a function of sensitivity in seconds.

    With `metered` below 1 it is the share that is brighter than so much of the saturation level. Lights whose centre
    lies off the sensor, overlap of spots and surfaces are left out; the veil counts.
    """
    shown = FlashOptics(lit).spots(view) if spots is None else spots
    saturated_e = SensorScale(lit.setup.imaging, 1.0).saturated_e * metered
    model = lit.spots
    veil_e_s = lit.veil_e_s(view.depth_m)

    def share(sensitivity_s: float) -> float:
        level = saturated_e / sensitivity_s
        return model.share(model.saturated_area_px2(shown, level)) + veil_share(veil_e_s, level)

    return share


def veil_share(veil_e_s: Array, level_e_s: float) -> float:
    """Share of samples that a uniform veil (3,) lifts above a level, both in electrons per second."""
    return float(np.mean(veil_e_s >= level_e_s))
