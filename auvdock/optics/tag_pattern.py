"""The AprilTag's pattern: cells, places of its corners, a blurred texture of it, and a picture for MuJoCo.

The pattern is measured in cells: u to the right and v down as the tag is read, from the upper left corner of the white
margin, which is one cell wide. The black square runs from 1 to 9, six data cells and its border; the whole to 10.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from auvdock.core.arrays import Array, Image
from auvdock.core.landing_station import TagCfg

__all__ = ["BLACK_SHARE", "CELLS", "TagPattern", "corners_station_m", "tag_cells", "tag_png", "tag_to_station"]

CELLS = 10
"""Cells along an edge, white margin included."""
SQUARE_CELLS = 8
"""Cells along an edge of the black square, whose size is the tag's."""
BLACK_SHARE = 0.1
"""Reflectance of black over white."""
_REACH_SIGMAS = 4.5
_PIECE = 16384
_UNCOVERED = 1e-6
"""A smaller share that is not the tag's is none."""


def tag_cells(tag_id: int) -> NDArray[np.bool_]:
    """(10, 10) whether each cell is white, rows from the top; AprilTag family 36h11 as OpenCV draws it."""
    aruco: Any = cv2.aruco
    family = aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)
    square = aruco.generateImageMarker(family, tag_id, SQUARE_CELLS, borderBits=1)
    cells = np.ones((CELLS, CELLS), dtype=np.bool_)
    cells[1:-1, 1:-1] = np.asarray(square) > 127
    return cells


def tag_to_station(tag: TagCfg) -> Array:
    """(3, 3) map from (u, v, 1) in cells to a point of the station frame.

    The tag lies face up with its upper edge towards the head (+x), so u runs to starboard (-y) and v aft (-x).
    """
    cell = tag.size_m / SQUARE_CELLS
    x, y, z = tag.position_m
    middle = 0.5 * CELLS * cell
    return np.array([[0.0, -cell, x + middle], [-cell, 0.0, y + middle], [0.0, 0.0, z]])


def corners_station_m(tag: TagCfg, margin_cells: float = 0.0) -> Array:
    """(4, 3) upper left, upper right, lower right and lower left corner of the black square in the station frame.

    Args:
        tag: the tag.
        margin_cells: moves them out from the centre by this many cells along both edges.
    """
    low, high = 1.0 - margin_cells, CELLS - 1.0 + margin_cells
    corners = np.array([[low, low, 1.0], [high, low, 1.0], [high, high, 1.0], [low, high, 1.0]])
    return corners @ tag_to_station(tag).T


class TagPattern:
    """The reflectance of a tag, blurred as pixels and lens blur it.

    The cells' edges are straight and the point spread function is a Gaussian, so in the tag's plane the blurred pattern
    is A(v) B A(u)ᵀ with A the share of each cell under a Gaussian, a difference of two normal distribution functions.
    """

    def __init__(self, tag: TagCfg) -> None:
        """Take the tag's cells."""
        self._cells = np.where(tag_cells(tag.tag_id), 1.0, BLACK_SHARE) * tag.reflectance

    def texels(self, cells_per_texel: float, sigma_u: float, sigma_v: float) -> tuple[float, int]:
        """Cell coordinate of the texture's first texel, and the number of texels along an edge."""
        first = -_REACH_SIGMAS * max(sigma_u, sigma_v)
        return first, math.ceil((CELLS - 2.0 * first) / cells_per_texel) + 1

    def texture(
        self,
        cells_per_texel: float,
        sigma_u: float,
        sigma_v: float,
        window: tuple[int, int, int, int] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Reflectance × coverage and coverage, (rows, columns) each; None for the latter where all is covered.

        Args:
            cells_per_texel: distance of texels, in cells.
            sigma_u: standard deviation of the blur along u, in cells.
            sigma_v: along v.
            window: texels from (x0, y0) up to (x1, y1), all of them with None.
        """
        first, count = self.texels(cells_per_texel, sigma_u, sigma_v)
        x0, y0, x1, y1 = window if window is not None else (0, 0, count, count)
        place = np.asarray(first + cells_per_texel * np.arange(count), dtype=np.float64)
        across, down = _shares(place[x0:x1], sigma_u), _shares(place[y0:y1], sigma_v)
        reflected = np.empty((len(down), len(across)), dtype=np.float32)
        striped = down @ self._cells.astype(np.float32)
        # In pieces too small for BLAS to call its threads, which stall where there are more workers than processors.
        rows = max(_PIECE // len(across), 1)
        for top in range(0, len(down), rows):
            np.matmul(striped[top : top + rows], across.T, out=reflected[top : top + rows])
        covered, columns = down.sum(axis=1), across.sum(axis=1)
        inside = min(float(covered.min()), float(columns.min())) >= 1.0 - _UNCOVERED
        return reflected, None if inside else covered[:, None] * columns


def _shares(place: Array, sigma: float) -> NDArray[np.float32]:
    """(n, 10) share of each cell under a Gaussian at each place (n,)."""
    edges = np.arange(CELLS + 1)
    return np.diff(ndtr((edges[None, :] - place[:, None]) / max(sigma, 1e-6)), axis=1).astype(np.float32)


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
