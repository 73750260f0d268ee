"""The lamps of a view as the rules of the labels want them: by themselves, with name, class, place and profile."""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array
from auvdock.dataset.rules import Foreign, Light
from auvdock.numeric.constants import BLUE, RED
from auvdock.optics.flash import FlashOptics
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.spots import Spots
from auvdock.optics.view import View

__all__ = ["Onlooker"]

_RED_CHANNEL, _GREEN_CHANNEL = 0, 1


class Onlooker:
    """Knows whose each lamp of a scene is; made once for a condition."""

    def __init__(self, imager: UnderwaterCamera, margin_px: float) -> None:
        """Name the lamps.

        Args:
            imager: the camera, reset: strangers have their places.
            margin_px: how far outside the image a light may be centred and still be told of.
        """
        self.lit, self._margin_px = imager.lit, margin_px
        self._flash = FlashOptics(imager.lit)
        setup, lights = imager.lit.setup, imager.lit.lights
        names = [beacon.name for beacon in setup.layout.beacons]
        names += ["rotating"] if setup.rotating is not None else []
        own, strangers = len(names), setup.nuisance.interference_level.count
        names += [f"stranger{k}" for k in range(strangers)]
        names += [f"mirror{k}" for k in range(lights.count - len(names))]
        brightest = np.argmax(lights.column("electrons_per_j"), axis=1)
        self._names = names
        self._class = np.where(brightest == _RED_CHANNEL, RED, BLUE)
        self._foreign: list[Foreign] = []
        for k in range(lights.count):
            if k < own:
                self._foreign.append("")
            elif k < own + strangers:
                # No lamp of a station is green.
                self._foreign.append("negative" if brightest[k] == _GREEN_CHANNEL else "stranger")
            else:
                self._foreign.append("mirror")
        lamps = lights.lamps
        self._c_per_m = lamps["absorption_per_m"] + lamps["scattering_per_m"]

    @property
    def radii_px(self) -> Array:
        """(k,) radii of the lights' profiles."""
        return self.lit.spots.radii_px

    def spots(self, view: View) -> Spots:
        """The lights whose centre is on the sensor, as spots."""
        return self._flash.spots(view)

    def lights(self, view: View, exposure_s: float) -> list[Light]:
        """All lamps that shine onto the sensor or just beside it."""
        arrivals = view.arrivals.copy()
        pixels, near = self.lit.lens.locate(arrivals["ray_camera"].copy(), self._margin_px)
        arrivals["pixel"], arrivals["inside"] = pixels, near & view.in_sight
        spots = self.spots(view._replace(arrivals=arrivals))
        lights: list[Light] = []
        lamps, pixels = spots.rows["lamp"], spots.rows["pixel"].copy()
        if spots.flash is not None:
            pixels[spots.flash.place] += spots.flash.middle_px * spots.flash.way
        channel_e = spots.rows["channel"] * exposure_s
        for k, lamp in enumerate(lamps.tolist()):
            range_m = float(arrivals["range_m"][lamp])
            lights.append(
                Light(
                    name=self._names[lamp],
                    class_id=int(self._class[lamp]),
                    pixel=pixels[k],
                    profile_e=spots.profile[k][:, None] * channel_e[k],
                    range_m=range_m,
                    c_range=float(self._c_per_m[lamp]) * range_m,
                    foreign=self._foreign[lamp],
                )
            )
        return lights
