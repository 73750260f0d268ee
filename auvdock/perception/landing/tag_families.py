"""Families of square tags by name: AprilTag's (Olson 2011; Wang & Olson 2016) and ArUco's (Garrido-Jurado 2014)."""

from __future__ import annotations

from typing import Literal, get_args

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.core.errors import ConfigError

__all__ = ["TAG_FAMILIES", "TagCodes", "TagFamily", "equalised"]

TagFamily = Literal["36h11", "36h10", "25h9", "16h5", "4x4", "5x5", "6x6", "7x7"]
"""AprilTag's by bits and least Hamming distance, ArUco's by their data cells; those have 1000 tags each, of which the
smaller sets of 50, 100 and 250 are the first."""
TAG_FAMILIES: tuple[TagFamily, ...] = get_args(TagFamily)
_DICTIONARIES: dict[TagFamily, int] = {
    "36h11": cv2.aruco.DICT_APRILTAG_36h11,
    "36h10": cv2.aruco.DICT_APRILTAG_36h10,
    "25h9": cv2.aruco.DICT_APRILTAG_25h9,
    "16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "4x4": cv2.aruco.DICT_4X4_1000,
    "5x5": cv2.aruco.DICT_5X5_1000,
    "6x6": cv2.aruco.DICT_6X6_1000,
    "7x7": cv2.aruco.DICT_7X7_1000,
}
_CLIP, _TILES = 2.0, (8, 8)
"""Of the equalisation: greatest count of a code over the mean, and tiles over the searched patch."""


class TagCodes:
    """The codes of those tags of a family that are looked for.

    Attributes:
        numbers: of these tags within the family.
        cells: along an edge of the black square, its border of one included.
        dictionary: the codes as OpenCV takes them.
    """

    def __init__(self, family: TagFamily, numbers: tuple[int, ...] | None) -> None:
        """Take the codes of `numbers` out of the family; None takes all.

        Raises:
            ConfigError: no such family, or no such tag in it.
        """
        if family not in _DICTIONARIES:
            raise ConfigError("tag_family", family, f"one of {', '.join(TAG_FAMILIES)}")
        whole = cv2.aruco.getPredefinedDictionary(_DICTIONARIES[family])
        size = len(whole.bytesList)
        self.numbers = tuple(range(size)) if numbers is None else numbers
        wrong = [number for number in self.numbers if not 0 <= number < size]
        if wrong:
            raise ConfigError("tag_id", wrong[0], f"0 to {size - 1}, family {family} has {size} tags")
        self.cells = whole.markerSize + 2
        codes = np.ascontiguousarray(whole.bytesList[list(self.numbers)])
        self.dictionary = cv2.aruco.Dictionary(codes, whole.markerSize, whole.maxCorrectionBits)


def equalised(grey: Image) -> Image:
    """(H, W) with contrast equalised tile by tile and limited against noise (CLAHE, Zuiderveld 1994)."""
    return np.asarray(cv2.createCLAHE(_CLIP, _TILES).apply(grey), dtype=np.uint8)
