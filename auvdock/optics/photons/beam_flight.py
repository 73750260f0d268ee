"""Flights of single photons from a point source, what they bring to spheres about it, and what they are expected to.

Narrow cones about the source are rarely hit. What arrives in them unscattered after a scattering at distance ρ is
therefore expected instead of awaited: a ray arrives at R within a half angle θ if it passes the source by less than
h = R sin θ, hence if the scattering sends it into the cone of sin α = h / ρ about the outward direction, and if it then
flies R - ρ without another. Each scattering between 0.7 R and R, the first included, adds P(Θ, α) e^{-(R - ρ)}
(`optics.photons.cone`): a number below 1, so its variance is bounded. What was scattered last further in is awaited:
its end may lie at another ψ than its beginning, while beyond 0.7 R they differ by less than θ / 2, which is left out,
as is the last flight's detour, a share of θ² a R / 4 or less.

And photons that fly nearly outward, from b r = 2.5 to the last sphere, are split in four within each of three angles,
and ended in three of four cases when they leave one (Kahn & Harris 1951): those near a cone are many and light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.numeric.compiled import compiled
from auvdock.numeric.records import Record, Records, new_rows
from auvdock.numeric.scattering import turn_of

__all__ = ["fly"]

_MOST_SCATTERINGS = 20_000
_MOST_FLYING = 4096
"""Photons that a split one may have become at a time."""
_NEAR = 0.7
"""Share of R from which the last scattering's light is expected."""
_SPLIT = 4.0
"""What a photon that is split becomes."""


@dataclass
class Photon(Record):
    """One on its way."""

    place: Annotated[Array, 3]
    """From the source; it left along z."""
    heading: Annotated[Array, 3]
    """Unit vector."""
    path: float
    """Flown so far."""
    rho: float
    """Distance of its last scattering from the source."""
    inside: int
    """Spheres that it is outside of."""
    order: int
    """Scatterings so far."""
    level: int
    """How often it was split in four."""


_PHOTON = Photon.dtype()


@compiled
def _bin_of(cosine: float, edges: Array) -> int:
    """First bin whose outer edge's cosine (n,), descending, lies below a cosine."""
    low, high = 0, len(edges) - 1
    while low < high:
        middle = (low + high) // 2
        if cosine > edges[middle]:
            high = middle
        else:
            low = middle + 1
    return low


@compiled
def _share_of(off: float, sine: float, table: Array, grid: Array) -> float:
    """P(Θ, α) at off = Θ and sin α, linear between the table's rows and columns; see `cone_table`."""
    up = (math.log(sine) - grid[0]) / grid[1]
    log_ratio = math.log(max(off, 1e-9) / math.asin(sine))
    root = math.sqrt(abs(log_ratio))
    right = ((root if log_ratio > 0.0 else -root) - grid[2]) / grid[3]
    up = min(max(up, 0.0), table.shape[0] - 1.0)
    right = min(max(right, 0.0), table.shape[1] - 1.0)
    row, column = min(int(up), table.shape[0] - 2), min(int(right), table.shape[1] - 2)
    up -= row
    right -= column
    low = table[row, column] * (1.0 - right) + table[row, column + 1] * right
    high = table[row + 1, column] * (1.0 - right) + table[row + 1, column + 1] * right
    return low * (1.0 - up) + high * up


@compiled
def _expect(
    rho: float,
    bins: tuple[int, int],
    off: float,
    weight: Array,
    radius: Array,
    sines: Array,
    table: Array,
    grid: Array,
    expected: Array,
) -> None:
    """Add what a scattering is to send through the spheres further out within the cones.

    Args:
        rho: distance of the scattering from the source.
        bins: first sphere further out, and bin of ψ.
        off: Θ, angle of the direction before the scattering with the outward one.
        weight: (k,) left after absorption.
        radius: (n,) spheres.
        sines: (c,) of the cones' half angles.
        table: see `cone_table`.
        grid: (4,) its first logarithm and step, first place and step.
        expected: (n, c, p, k).
    """
    for i in range(bins[0], len(radius)):
        if rho < _NEAR * radius[i]:
            break
        arrives = math.exp(rho - radius[i])
        for c in range(len(sines)):
            share = arrives * _share_of(off, min(radius[i] * sines[c] / rho, 1.0), table, grid)
            for k in range(len(weight)):
                expected[i, c, bins[1], k] += share * weight[k]


@compiled
def _leave(weight: Array, absorption: Array, excess: float, level: int) -> None:
    """Put e^{-(a/b) e} of a photon that was split so often into weight (k,)."""
    for k in range(len(weight)):
        weight[k] = _SPLIT**-level * math.exp(-absorption[k] * excess)


@compiled
def _level(cosine: float, rho: float, split: Array) -> int:
    """How often a photon is split that flies at a cosine with the outward direction at a distance; see `_SPLIT_DEG`."""
    level = 0
    if split[0] < rho < split[1]:
        while level < len(split) - 2 and cosine > split[2 + level]:
            level += 1
    return level


@compiled
def _turn(heading: Array, versine: float, about: float) -> None:
    """Turn a direction (3,) by 1 - cos χ, at an azimuth about it; the axes across are those of Duff et al. (2017)."""
    u, v, w = heading
    sign = 1.0 if w >= 0.0 else -1.0
    first = -1.0 / (sign + w)
    second = u * v * first
    sine = math.sqrt(versine * (2.0 - versine))
    one, two, ahead = sine * math.cos(about), sine * math.sin(about), 1.0 - versine
    heading[0] = ahead * u + one * (1.0 + sign * u * u * first) + two * second
    heading[1] = ahead * v + one * sign * second + two * (sign + v * v * first)
    heading[2] = ahead * w - one * sign * u - two * v


@compiled
def _cross(
    photon: Photon,
    flight: float,
    radius: Array,
    absorption: Array,
    asked: tuple[Array, Array, Array, Array, Array],
    told: tuple[IntArray, Array, Array],
    weight: Array,
) -> float:
    """Move a photon on by a flight and count the spheres that it crosses; cosine of its direction with the radius then.

    Args:
        photon: which.
        flight: how far.
        radius: (n,) spheres.
        absorption: (k,) a / b.
        asked: see `fly`.
        told: see `fly`.
        weight: (k,) room.
    """
    arrival, left, sines, _, _ = asked
    unscattered, crossed, expected = told
    place, heading = photon.place, photon.heading
    along = place[0] * heading[0] + place[1] * heading[1] + place[2] * heading[2]
    across2 = max(place[0] * place[0] + place[1] * place[1] + place[2] * place[2] - along * along, 0.0)
    end = along + flight
    rho2 = across2 + end * end
    low = photon.inside
    if along < 0.0:  # inward first
        reached2 = across2 if end > 0.0 else rho2
        while low > 0 and radius[low - 1] * radius[low - 1] > reached2:
            low -= 1
    high, inwards = low, photon.inside - low
    if end > 0.0:
        while high < len(radius) and radius[high] * radius[high] <= rho2:
            high += 1
    for passing in range(inwards + high - low):
        inward = passing < inwards
        sphere = photon.inside - 1 - passing if inward else low + passing - inwards
        if photon.order == 0:
            unscattered[sphere] += 1
            continue
        r = radius[sphere]
        reach = math.sqrt(max(r * r - across2, 0.0)) * (-1.0 if inward else 1.0)
        _leave(weight, absorption, photon.path + reach - along - r, photon.level)
        arriving, leaving = _bin_of(reach / r, arrival), _bin_of((place[2] + heading[2] * (reach - along)) / r, left)
        for k in range(len(weight)):
            crossed[sphere, arriving, leaving, k] += weight[k]
        if photon.rho < _NEAR * r:
            for c in range(arriving, len(sines)):
                for k in range(len(weight)):
                    expected[sphere, c, leaving, k] += weight[k]
    photon.inside = high
    photon.path += flight
    photon.rho = math.sqrt(rho2)
    for i in range(3):
        place[i] += heading[i] * flight
    return min(max(end / photon.rho, -1.0), 1.0)


@compiled
def _split(photons: Records[Photon], top: int, split: Array, chance: float) -> int:
    """Split the topmost photon, or end it, as its new direction demands; the topmost then, -1 for none.

    Args:
        photons: those that wait, and the one that flies on top.
        top: its row.
        split: (5,) see `_level`.
        chance: evenly distributed over [0, 1).
    """
    photon = photons[top]
    place, heading = photon.place, photon.heading
    along = place[0] * heading[0] + place[1] * heading[1] + place[2] * heading[2]
    level = _level(along / photon.rho, photon.rho, split)
    copies = _SPLIT ** (level - photon.level)
    if copies < 1.0:
        photon.level = level
        return top if chance < copies else top - 1
    if copies > 1.0 and top + copies <= len(photons):
        photon.level = level
        for _ in range(int(copies) - 1):
            photons[top + 1] = photons[top]
            top += 1
    return top


@compiled
def fly(
    photons: int,
    quantiles: Array,
    power: float,
    radius: Array,
    absorption: Array,
    limits: Array,
    asked: tuple[Array, Array, Array, Array, Array],
    told: tuple[IntArray, Array, Array],
    rng: np.random.Generator,
) -> None:
    """Walks of so many photons.

    Args:
        photons: how many.
        quantiles: see `PhaseFunction.quantiles`.
        power: see `PhaseFunction.power`.
        radius: (n,) spheres.
        absorption: (k,) a / b.
        limits: (7,) distance and excess path from where a photon is given up; from where to where it is split, and
            the cosines within which it is.
        asked: cosines of the edges of the angle of arrival and of ψ, sines of the cones, their table and its grid.
        told: unscattered (n,), crossed (n, m, p, k) and expected (n, c, p, k), to which light is added.
        rng: random numbers.
    """
    _, left, sines, table, grid = asked
    weight = np.empty(len(absorption))
    flying: Records[Photon] = new_rows(_MOST_FLYING, dtype=_PHOTON)
    for _ in range(photons):
        top = 0
        photon = flying[0]
        photon.place[:] = 0.0
        photon.heading[:] = 0.0
        photon.heading[2] = 1.0
        photon.path = photon.rho = 0.0
        photon.inside = photon.order = photon.level = 0
        while top >= 0:
            photon = flying[top]
            cosine = _cross(photon, -math.log(1.0 - rng.random()), radius, absorption, asked, told, weight)
            photon.order += 1
            excess = photon.path - photon.rho
            if photon.rho > limits[0] or excess > limits[1] or photon.order > _MOST_SCATTERINGS:
                top -= 1
                continue
            if photon.inside < len(radius) and photon.rho >= _NEAR * radius[photon.inside]:
                _leave(weight, absorption, excess, photon.level)
                off = math.acos(cosine) if photon.order > 1 else 0.0
                bins = (photon.inside, _bin_of(photon.place[2] / photon.rho, left))
                _expect(photon.rho, bins, off, weight, radius, sines, table, grid, told[2])
            _turn(photon.heading, turn_of(rng.random(), quantiles, power), 2.0 * math.pi * rng.random())
            top = _split(flying, top, limits[2:], rng.random())
