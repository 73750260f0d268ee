"""The AprilTag's pattern: cells and their reflectance, places of its corners, and a picture for MuJoCo.

The pattern is measured in cells: u to the right and v down as the tag is read, from the upper left corner of the white
margin, which is one cell wide. The black square runs from 1 to 9, six data cells and its border; the whole to 10.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from auvdock.core.arrays import Array, Image
from auvdock.core.landing_station import TagCfg
from auvdock.numeric.constants import TAG_CELLS, TAG_SQUARE_CELLS

__all__ = [
    "BLACK_SHARE",
    "corners_station_m",
    "reflectances",
    "tag_cells",
    "tag_png",
    "tag_to_station",
]

BLACK_SHARE = 0.1
"""Reflectance of black over white."""


def tag_cells(tag_id: int) -> NDArray[np.bool_]:
    """(10, 10) whether each cell is white, rows from the top; AprilTag family 36h11 as OpenCV draws it."""
    aruco: Any = cv2.aruco
    family = aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)
    square = aruco.generateImageMarker(family, tag_id, TAG_SQUARE_CELLS, borderBits=1)
    cells = np.ones((TAG_CELLS, TAG_CELLS), dtype=np.bool_)
    cells[1:-1, 1:-1] = np.asarray(square) > 127
    return cells


def tag_to_station(tag: TagCfg) -> Array:
    """(3, 3) map from (u, v, 1) in cells to a point of the station frame.

    The tag lies face up with its upper edge towards the head (+x), so u runs to starboard (-y) and v aft (-x).
    """
    cell = tag.size_m / TAG_SQUARE_CELLS
    x, y, z = tag.position_m
    middle = 0.5 * TAG_CELLS * cell
    return np.array([[0.0, -cell, x + middle], [-cell, 0.0, y + middle], [0.0, 0.0, z]])


def corners_station_m(tag: TagCfg, margin_cells: float = 0.0) -> Array:
    """(4, 3) upper left, upper right, lower right and lower left corner of the black square in the station frame.

    Args:
        tag: the tag.
        margin_cells: moves them out from the centre by this many cells along both edges.
    """
    low, high = 1.0 - margin_cells, TAG_CELLS - 1.0 + margin_cells
    corners = np.array([[low, low, 1.0], [high, low, 1.0], [high, high, 1.0], [low, high, 1.0]])
    return corners @ tag_to_station(tag).T


def reflectances(tag: TagCfg) -> NDArray[np.float32]:
    """(12, 12) reflectance of each cell, with a frame of cells around them that reflect nothing."""
    cells = np.where(tag_cells(tag.tag_id), 1.0, BLACK_SHARE) * tag.reflectance
    return np.pad(cells, 1).astype(np.float32)


def tag_png(tag: TagCfg, cell_px: int = 8) -> bytes:
    """A PNG picture (bytes) of the tag with its white margin, row 0 at its upper edge: a texture for MuJoCo's model.

    Args:
        tag: the tag.
        cell_px: pixels along a cell.
    """
    white = round(255.0 * tag.reflectance)
    cells = np.where(tag_cells(tag.tag_id), white, round(white * BLACK_SHARE)).astype(np.uint8)
    picture: Image = np.kron(cells, np.ones((cell_px, cell_px), dtype=np.uint8))
    done, data = cv2.imencode(".png", np.repeat(picture[:, :, None], 3, axis=2))
    if not done:
        raise RuntimeError("OpenCV could not encode a PNG picture")
    return data.tobytes()
