"""Colours of a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from auvdock.core.contracts import BLUE, RED

__all__ = ["CANDIDATE", "IDENTIFIED", "LOST", "class_colours", "rgba", "wavelength_rgb"]

Colours = NDArray[np.uint32]


def rgba(red: int, green: int, blue: int, alpha: int = 255) -> int:
    """0xRRGGBBAA."""
    return red << 24 | green << 16 | blue << 8 | alpha


IDENTIFIED = rgba(120, 255, 120)
"""A track that is known to be a certain beacon."""
CANDIDATE = rgba(255, 220, 80)
"""A track that is not (yet) known to be one."""
LOST = rgba(150, 150, 150)
"""A track without a detection in this frame."""

_CLASSES = {BLUE: rgba(90, 170, 255), RED: rgba(255, 90, 70)}
_OTHER_CLASS = rgba(230, 230, 230)


def class_colours(class_id: NDArray[np.int64]) -> Colours:
    """(n,) 0xRRGGBBAA of detection classes (n,); grey for classes that a user's detector adds."""
    return np.array([_CLASSES.get(int(value), _OTHER_CLASS) for value in class_id], dtype=np.uint32)


_STOPS_NM = (380.0, 440.0, 490.0, 510.0, 580.0, 645.0, 720.0)
_STOPS_RGB = ((0.4, 0.0, 0.6), (0.0, 0.0, 1.0), (0.0, 1.0, 1.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.0))


def wavelength_rgb(wavelength_nm: float) -> tuple[int, int, int]:
    """Colour of monochromatic light as a screen shows it, 0 to 255 (Bruton 1996, piecewise linear), a little lightened.

    The lightening keeps pure blue readable on a dark background.
    """
    stops = np.array([*_STOPS_RGB, _STOPS_RGB[-1]])
    pure = np.array([np.interp(wavelength_nm, _STOPS_NM, stops[:, channel]) for channel in range(3)])
    red, green, blue = (round(255 * float(part)) for part in 0.25 + 0.75 * pure)
    return red, green, blue
