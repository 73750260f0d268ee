"""Volume of a region that a predicate defines: voxels, refined where the region's surface passes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion

from auvdock.core.arrays import Array, BoolArray
from auvdock.core.errors import ConfigError

__all__ = ["VoxelRegion", "fill_region"]

_NEIGHBOURS = np.ones((3, 3, 3), dtype=np.bool_)
_MAX_ROUNDS = 40


@dataclass(frozen=True, eq=False)
class VoxelRegion:
    """A region as a set of cubes.

    Attributes:
        inside: (nx, ny, nz) cubes whose centre belongs to the region.
        low_m: (3,) corner of the first cube.
        voxel_m: side of a cube.
        coarser_m3: volume with cubes of twice the side.
        evaluations: number of places at which the predicate was asked.
    """

    inside: BoolArray
    low_m: Array
    voxel_m: float
    coarser_m3: float
    evaluations: int

    @property
    def volume_m3(self) -> float:
        """Number of cubes times their volume."""
        return float(np.count_nonzero(self.inside)) * self.voxel_m**3

    @property
    def surface_voxels(self) -> int:
        """Cubes of the region with a neighbour outside."""
        return int(np.count_nonzero(self._skin()))

    @property
    def discretisation_error_m3(self) -> float:
        """Estimate of the volume's error: the change from voxels of twice the side."""
        return abs(self.volume_m3 - self.coarser_m3)

    def centres_m(self, mask: BoolArray | None = None) -> Array:
        """(n, 3) centres of the cubes in `mask` (of the region by default)."""
        index = np.argwhere(self.inside if mask is None else mask)
        return self.low_m + (index + 0.5) * self.voxel_m

    def surface_m(self) -> Array:
        """(n, 3) centres of the cubes of the region with a neighbour outside."""
        return self.centres_m(self._skin())

    def _skin(self) -> BoolArray:
        return self.inside & np.logical_not(np.asarray(binary_erosion(self.inside, _NEIGHBOURS), dtype=np.bool_))

    def contains(self, points_m: Array) -> BoolArray:
        """(n,) whether points (n, 3) lie in a cube of the region."""
        index = np.floor((points_m - self.low_m) / self.voxel_m).astype(np.int64)
        within = np.all((index >= 0) & (index < np.array(self.inside.shape)), axis=1)
        clipped = np.clip(index, 0, np.array(self.inside.shape) - 1)
        return within & self.inside[clipped[:, 0], clipped[:, 1], clipped[:, 2]]


def fill_region(
    predicate: Callable[[Array], BoolArray],
    low_m: Array,
    high_m: Array,
    voxel_m: float,
    levels: int = 2,
) -> VoxelRegion:
    """Voxels of side `voxel_m` whose centre satisfies a predicate.

    The box is first filled with voxels 2^levels times as large. Those next to a change are split into eight and asked
    again, and so on; at each level the search follows the surface until no neighbour is left unasked. A part of the
    region thinner than the largest voxel can be missed.

    Args:
        predicate: (n,) truth at places (n, 3).
        low_m: (3,) corner of the box.
        high_m: (3,) opposite corner; the box is enlarged to whole voxels.
        voxel_m: side of the smallest voxels.
        levels: number of halvings.

    Raises:
        ConfigError: a voxel that is not a length, or so small that memory would not hold the box.
    """
    if not (np.isfinite(voxel_m) and voxel_m > 0.0):
        raise ConfigError("voxel_m", voxel_m, "a length above 0 m")
    side = voxel_m * 2**levels
    shape = np.maximum(np.ceil((high_m - low_m) / side - 1e-9).astype(np.int64), 1)
    if float(np.prod(shape.astype(np.float64))) * 8.0**levels > 2e8:
        raise ConfigError("voxel_m", voxel_m, "a longer side, the box has more than 200 million voxels of it")
    index = np.argwhere(np.ones(shape, dtype=np.bool_))
    inside = predicate(low_m + (index + 0.5) * side).reshape(shape)
    count, coarser = len(index), float(np.count_nonzero(inside)) * side**3
    for _ in range(levels):
        coarser = float(np.count_nonzero(inside)) * side**3
        side /= 2.0
        inside, asked = _refine(predicate, inside, low_m, side)
        count += asked
    return VoxelRegion(inside, low_m, side, coarser, count)


def _refine(
    predicate: Callable[[Array], BoolArray], coarse: BoolArray, low_m: Array, side: float
) -> tuple[BoolArray, int]:
    fine = coarse.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)
    asked = np.zeros(fine.shape, dtype=np.bool_)
    for _ in range(_MAX_ROUNDS):
        grown = np.asarray(binary_dilation(fine, _NEIGHBOURS), dtype=np.bool_)
        changing = grown & np.logical_not(np.asarray(binary_erosion(fine, _NEIGHBOURS, border_value=1)))
        todo = np.argwhere(changing & ~asked)
        if len(todo) == 0:
            break
        truth = predicate(low_m + (todo + 0.5) * side)
        fine[todo[:, 0], todo[:, 1], todo[:, 2]] = truth
        asked[todo[:, 0], todo[:, 1], todo[:, 2]] = True
    return fine, int(np.count_nonzero(asked))
