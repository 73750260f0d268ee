"""Cholesky's factor of a small symmetric matrix, and what is solved with it (Golub and Van Loan 2013, section 4.2)."""

from __future__ import annotations

import math

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["factorise", "forward", "solve"]


@compiled
def factorise(matrix: Array) -> bool:
    """Put the lower factor of a symmetric matrix into its lower triangle; False where it is not positive definite.

    Only the lower triangle is read.
    """
    for i in range(len(matrix)):
        for j in range(i + 1):
            value = matrix[i, j]
            for k in range(j):
                value -= matrix[i, k] * matrix[j, k]
            if i > j:
                matrix[i, j] = value / matrix[j, j]
            elif value > 0.0:
                matrix[i, i] = math.sqrt(value)
            else:
                return False
    return True


@compiled
def forward(factor: Array, right: Array) -> None:
    """Solve L x = b for a lower factor (n, n), in place of b (n,)."""
    for i in range(len(right)):
        for k in range(i):
            right[i] -= factor[i, k] * right[k]
        right[i] /= factor[i, i]


@compiled
def solve(factor: Array, right: Array) -> None:
    """Solve L Lᵀ x = b for a lower factor (n, n), in place of b (n,)."""
    forward(factor, right)
    size = len(right)
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            right[i] -= factor[k, i] * right[k]
        right[i] /= factor[i, i]
