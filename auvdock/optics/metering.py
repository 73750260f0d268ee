"""The exposure metering's reading, predicted from the radiometry: what an image would show, without the image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from auvdock.optics.scene import LitScene, View
from auvdock.optics.sensor import SensorScale
from auvdock.optics.spots import Spots

__all__ = ["predicted_share"]


def predicted_share(lit: LitScene, view: View, spots: Spots | None = None) -> Callable[[float], float]:
    """Saturated share of the image as a function of sensitivity in seconds.

    Lights whose centre lies off the sensor, overlap of spots and surfaces are left out.
    """
    shown = lit.spots.spots(view.received, np.flatnonzero(view.inside)) if spots is None else spots
    saturated_e = SensorScale(lit.cfg, 1.0).saturated_e
    model = lit.spots
    return lambda sensitivity_s: model.share(model.saturated_area_px2(shown, saturated_e / sensitivity_s))
