"""What kernels do to single numbers and to vectors of three."""

from __future__ import annotations

import math

import numpy as np

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["Vector", "cross", "halves", "limited", "within_pi"]

Vector = tuple[float, float, float]


@compiled
def limited(value: float, bound: float) -> float:
    """A value brought to within ± bound."""
    return bound if value > bound else -bound if value < -bound else value


@compiled
def within_pi(angle_rad: float) -> float:
    """The same angle in [-π, π]: less the nearest number of whole turns, of two equally near ones the even."""
    return angle_rad - math.tau * np.rint(angle_rad / math.tau)


@compiled
def halves(twist: Array) -> tuple[Vector, Vector]:
    """The linear and the angular part of a velocity or a wrench (6,)."""
    return (twist[0], twist[1], twist[2]), (twist[3], twist[4], twist[5])


@compiled
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Vector:
    """Vector product a × b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
