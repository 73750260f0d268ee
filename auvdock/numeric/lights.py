"""The table of lights that a pose is solved from, and the array of numbers that its solution is.

The table has a row (7,) for each light: X, Y, Z in the station frame in m, then the columns named here.
"""

from __future__ import annotations

__all__ = [
    "ATTITUDE",
    "COST",
    "COVARIANCE",
    "ERROR",
    "PIXEL",
    "RESIDUAL",
    "ROTATION",
    "SEEN",
    "SIGMA",
    "TRANSFORM",
    "TRANSLATION",
]

PIXEL, SIGMA, SEEN = 3, 5, 6
"""Columns of the table: u and v, σ of either in px, and 1 or 0 for seen or predicted."""
TRANSLATION, ROTATION, TRANSFORM, COVARIANCE, ATTITUDE, COST, ERROR, RESIDUAL = 3, 6, 15, 31, 67, 68, 69, 70
"""Where a solution's parts begin, after the rotation vector; what they are: `perception.pnp_refine.solve_from`."""
