"""Angles of scattering, drawn from a phase function's quantiles."""

from __future__ import annotations

from auvdock.numeric.arrays import Array
from auvdock.numeric.compiled import compiled

__all__ = ["turn_of"]

_BY_POWER = 64
"""Quantiles below this one follow a power law."""


@compiled
def turn_of(share: float, quantiles: Array, power: float) -> float:
    """1 - cos Θ of the scattering below which a share in [0, 1) of all lie.

    Args:
        share: evenly distributed where an angle is to be drawn.
        quantiles: (n,) 1 - cos Θ below which 0, 1/(n - 1), … 1 of all scatterings lie.
        power: below the 64th quantile 1 - cos Θ ∝ share^power.
    """
    place = share * (len(quantiles) - 1)
    cell = int(place)
    if cell < _BY_POWER:
        return quantiles[_BY_POWER] * (place / _BY_POWER) ** power
    return quantiles[cell] + (place - cell) * (quantiles[cell + 1] - quantiles[cell])
