"""From counted photons to a table of the halo: single scattering from its integral, the rest from the photons.

The halo is what arrives scattered within a cone about the lamp, over what would arrive by inverse square alone and over
e^{-a r}: radiance integrated over solid angle, as the sum of a camera's pixels is. Photons that cross a sphere outward
in a ring of angles [θ1, θ2] carry radiance × cos θ, so a ring's radiance is their share over π (sin² θ2 - sin² θ1).

Inside 10° the rings' radiance is smoothed over the logarithm of the angle: the likelihood of the counts with a penalty
on third differences, and a weak one on first, so that rings with many photons keep their values, those with few follow
their neighbours, and those with none become flat, as light that was scattered many times is about its middle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.photons.phase import PhaseFunction, load_phase
from auvdock.optics.photons.single import SingleScattering
from auvdock.optics.photons.walk import EXCESS_EDGES, Tally, shoot

__all__ = [
    "ABSORPTION",
    "ANGLE_RAD",
    "BATCHES",
    "RADIUS",
    "HaloGrid",
    "count_photons",
    "left_after",
    "make_grid",
    "ring_radiance",
]

RADIUS = np.geomspace(0.02, 40.0, 40)
"""(40,) b r of a table."""
ABSORPTION = np.geomspace(0.01, 100.0, 24)
"""(24,) a / b of a table."""
_EVEN = 38
ANGLE_RAD = np.radians(np.concatenate([np.geomspace(0.02, 10.0, _EVEN), np.linspace(12.5, 90.0, 32)]))
"""(70,) half angles of a table: even in the logarithm to 10°, then every 2.5°."""
BATCHES = 10
"""Independent runs whose scatter gives the standard error."""

_SLOPE, _BEND = 0.1, 0.004
"""First and third differences that the logarithm of radiance has from ring to ring of 18 %: standard deviations."""
_ROUNDS = 100


@dataclass(frozen=True, eq=False)
class HaloGrid:
    """A table before it is packed."""

    phase: str
    """Name of the phase function."""
    photons: int
    """Photons behind it."""
    log_within: Array
    """(n, k, m) logarithm of the halo over b r, a / b and half angle."""
    error: Array
    """(n, k, m) its standard error: relative to the halo."""


def count_photons(phase: PhaseFunction, photons: int, seed: int, told: Callable[[], object]) -> list[Tally]:
    """Photons over the table's spheres and angles, in `BATCHES` runs with a stream of random numbers each."""
    tallies: list[Tally] = []
    for rng in np.random.default_rng(seed).spawn(BATCHES):
        tallies.append(shoot(phase, photons // BATCHES, RADIUS, ANGLE_RAD, rng))
        told()
    return tallies


def make_grid(name: str, tallies: Sequence[Tally], absorption: Array = ABSORPTION) -> HaloGrid:
    """The table of a phase function; its error by leaving out one batch at a time.

    Args:
        name: of the phase function.
        tallies: batches of photons over the table's angles, as `count_photons` gives them.
        absorption: (k,) a / b.
    """
    once = SingleScattering(load_phase(name))
    single = np.array([[once.within(br, x, ANGLE_RAD) for x in absorption] for br in tallies[0].radius])
    moments = [_moments(tally, absorption) for tally in tallies]
    total = np.sum(moments, axis=0)
    photons = sum(tally.photons for tally in tallies)
    log_within = np.log(single + _within(total, photons))
    left_out = [
        np.log(single + _within(total - one, photons - tally.photons))
        for one, tally in zip(moments, tallies, strict=True)
    ]
    error = math.sqrt((len(tallies) - 1) ** 2 / len(tallies)) * np.std(left_out, axis=0, ddof=1)
    return HaloGrid(name, photons, log_within, error)


def ring_radiance(angle_rad: Array) -> tuple[Array, Array]:
    """∫ cos θ dω and ∫ dω of the rings (m,) inside half angles (m,); the first is the cap about the lamp."""
    edges = np.concatenate([[0.0], angle_rad])
    return math.pi * np.diff(np.sin(edges) ** 2), -2.0 * math.pi * np.diff(np.cos(edges))


def left_after(absorption: Array) -> Array:
    """(k, bins) mean of e^{-(a/b) e} over each bin of excess path, for a / b (k,)."""
    middle = np.sqrt(EXCESS_EDGES[1:] * EXCESS_EDGES[:-1])
    ends = np.exp(-absorption[:, None] * EXCESS_EDGES)
    return (ends[:, 1:] + ends[:, :-1] + 4.0 * np.exp(-absorption[:, None] * middle)) / 6.0


def _moments(tally: Tally, absorption: Array) -> Array:
    """(2, n, k, m) sums of weights and of their squares of what was scattered twice or more."""
    left = left_after(absorption)
    counts = tally.more.astype(float)
    return np.stack([np.einsum("nme,ke->nkm", counts, weight, optimize=True) for weight in (left, left**2)])


def _within(moments: Array, photons: int) -> Array:
    """(n, k, m) light scattered twice or more within the table's half angles."""
    facing, solid = ring_radiance(ANGLE_RAD)
    radiance = moments[0] / (photons * facing)
    inner = slice(1, _EVEN)
    radiance[..., inner] = _smoothed(moments[..., inner], photons * facing[inner])
    # In the cap light peaks more than its neighbours tell: their power law counts as much as three photons there.
    first, second = radiance[..., 1], radiance[..., 2]
    step = math.log(ANGLE_RAD[1] / ANGLE_RAD[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        fall = np.clip(np.nan_to_num(np.log(first / second) / step), 0.0, 1.5)
        one = np.nan_to_num(np.divide(*moments[::-1, ..., inner].sum(axis=-1)))
    guess, prior = first * 2.0 / (2.0 - fall), 3.0 * one
    told = prior > 0.0
    exposure = photons * facing[0]
    radiance[..., 0] = np.where(
        told, (moments[0, ..., 0] + prior) / (exposure + prior / np.where(told, guess, 1.0)), radiance[..., 0]
    )
    return np.cumsum(radiance * solid, axis=-1)


def _smoothed(moments: Array, exposure: Array) -> Array:
    """(n, k, j) radiance of rings (j,) by penalised Poisson likelihood.

    Sums of weights count as photons of one weight, Σw² / Σw over all rings: that of a ring with few photons is noise.

    Args:
        moments: (2, n, k, j) Σw and Σw².
        exposure: (j,) what a radiance of 1 would give as Σw.
    """
    total, square = moments
    rows_total, rows_square = total.sum(axis=-1, keepdims=True), square.sum(axis=-1, keepdims=True)
    empty = (rows_square <= 0.0)[..., 0]
    scale = np.divide(rows_total, rows_square, out=np.ones_like(rows_total), where=rows_square > 0.0)
    counts, exposed = total * scale, exposure * scale
    slopes, bends = (np.diff(np.eye(total.shape[-1]), n=n, axis=0) / sigma for n, sigma in ((1, _SLOPE), (3, _BEND)))
    penalty = slopes.T @ slopes + bends.T @ bends
    mean = np.maximum(rows_total / exposure.sum(), 1e-300)
    log_radiance = np.broadcast_to(np.log(mean), total.shape).copy()
    for _ in range(_ROUNDS):
        expected = exposed * np.exp(log_radiance)
        system = penalty + (expected[..., None] + 1e-9) * np.eye(total.shape[-1])
        uphill = counts - expected - log_radiance @ penalty
        step = np.linalg.solve(system, uphill[..., None])[..., 0]
        # Newton's steps, held short as a whole: the likelihood is concave, so they climb.
        longest = np.max(np.abs(step), axis=-1, keepdims=True)
        log_radiance += step * np.minimum(1.0, 1.0 / np.maximum(longest, 1e-300))
        if np.max(longest[~empty], initial=0.0) < 1e-6:
            break
    return np.where(empty[..., None], 0.0, np.exp(log_radiance))
