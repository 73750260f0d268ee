"""The only place where signs flip between the marine convention and MuJoCo's.

Coefficients are published for body axes x forward, y starboard, z down (Fossen 2011, SNAME 1950). This package and
MuJoCo use x forward, y port, z up. Both are right-handed and differ by half a turn about x, so for a six-vector
(linear part, angular part) the map is S = diag(1, -1, -1, 1, -1, -1), its own inverse.
"""

from __future__ import annotations

import numpy as np

from auvdock.core.arrays import Array

__all__ = ["flip_matrix", "flip_twist", "flip_vector"]

_SIGNS = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])


def flip_vector(vector: Array) -> Array:
    """A (3,) vector, marine to MuJoCo axes or back."""
    return vector * _SIGNS[:3]


def flip_twist(twist: Array) -> Array:
    """A (6,) velocity ν or wrench τ, marine to MuJoCo axes or back."""
    return twist * _SIGNS


def flip_matrix(matrix: Array) -> Array:
    """A (6, 6) matrix A with τ = A ν, marine to MuJoCo axes or back: S A S."""
    return matrix * np.outer(_SIGNS, _SIGNS)
