"""Single photons from a point source, by the angle at which they left it and the angle under which they arrive.

As in `optics.photons.walk`, but with the photon's place and direction in coordinates: it leaves along z, and where it
crosses a sphere about the source at p, it left at ψ = angle(z, p) from the line of sight and arrives at the angle θ of
its direction with p, 0 straight from the source and beyond 90° inward. Source and water are the same on all sides, so
the crossings by ψ and θ serve every beam in every direction: photons that left at ψ count with what the beam sends
there. Absorption is weighed in along the true path, e^{-(a/b) e} for the path R + e.

Light in narrow cones about the source is in part expected instead of awaited, and photons are split on their way to
them: `optics.photons.beam_flight`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from auvdock.core.arrays import Array, IntArray
from auvdock.optics.photons.beam_flight import fly
from auvdock.optics.photons.cone import cone_table
from auvdock.optics.photons.phase import PhaseFunction

__all__ = ["ARRIVAL_DEG", "CONE_DEG", "LEFT_DEG", "BeamTally", "shoot_beams"]

CONE_DEG = (0.2, 0.5, 1.0)
"""Half angles of the cones in which light is expected rather than awaited."""
ARRIVAL_DEG = (
    *CONE_DEG,
    *(2.0, 5.0),
    *np.arange(10.0, 40.0, 2.5).tolist(),
    *np.arange(40.0, 90.0, 5.0).tolist(),
    *np.arange(90.0, 181.0, 10.0).tolist(),
)
"""Outer edges of the bins of the angle of arrival."""
LEFT_DEG = (*np.arange(0.5, 30.0, 0.5).tolist(), *np.arange(30.0, 90.0, 1.0).tolist(), *range(90, 181, 5))
"""Outer edges of the bins of ψ."""

_LEAST_LOG = -16.0
"""What absorption has left less of than e^-16 is given up."""
_SPLIT_DEG, _SPLIT_FROM = (8.0, 2.5, 0.8), 2.5
"""From b r = 2.5 on, photons that fly within these angles of the outward direction are split each time."""
_SINES, _PLACES = 160, 400
"""Rows and columns of the table of cones; between them it is linear, to 0.2 % in the mean."""


@dataclass(frozen=True, eq=False)
class BeamTally:
    """Light that crosses spheres, by sphere, angle of arrival, ψ and a / b, over e^{-a R}, in photons."""

    photons: int
    """Photons sent out."""
    radius: Array
    """(n,) b r of the spheres, ascending."""
    absorption: Array
    """(k,) a / b."""
    unscattered: IntArray
    """(n,) photons that had not been scattered."""
    crossed: Array
    """(n, 37, 138, k) scattered light in the bins of `ARRIVAL_DEG` and `LEFT_DEG`."""
    expected: Array
    """(n, 3, 138, k) scattered light within `CONE_DEG` and the bins of `LEFT_DEG`, in part expected, not awaited."""


def shoot_beams(
    phase: PhaseFunction,
    photons: int,
    radius: Array,
    absorption: Array,
    rng: np.random.Generator,
    outer: float = 60.0,
) -> BeamTally:
    """Send out photons and count them.

    Args:
        phase: what scatters them.
        photons: how many.
        radius: (n,) b r of the spheres, ascending.
        absorption: (k,) a / b, 0 or more.
        rng: of this run.
        outer: b r from where a photon is given up.
    """
    sines, table, grid = _cones(phase)
    arrival, left = np.cos(np.radians(ARRIVAL_DEG)), np.cos(np.radians(LEFT_DEG))
    arrival[-1] = left[-1] = -2.0  # -1 but for rounding
    n, k = len(radius), len(absorption)
    crossed, expected = np.zeros((n, len(arrival), len(left), k)), np.zeros((n, len(sines), len(left), k))
    unscattered = np.zeros(n, np.int64)
    longest = -_LEAST_LOG / max(float(absorption.min()), 1e-9)
    limits = np.array([outer, longest, _SPLIT_FROM, radius[-1], *np.cos(np.radians(_SPLIT_DEG))])
    fly(
        photons,
        phase.quantiles,
        phase.power,
        radius,
        absorption,
        limits,
        (arrival, left, sines, table, grid),
        (unscattered, crossed, expected),
        rng,
    )
    return BeamTally(photons, radius, absorption, unscattered, crossed, expected)


@lru_cache(maxsize=4)
def _cones(phase: PhaseFunction) -> tuple[Array, Array, Array]:
    """Sines of `CONE_DEG` (c,), the share scattered into cones, and where its rows and columns lie, (4,)."""
    sines = np.sin(np.radians(CONE_DEG))
    log_sine = np.linspace(math.log(sines[0]), 0.0, _SINES)
    farthest = math.sqrt(math.log(math.pi / math.asin(sines[0])))
    place = np.linspace(-farthest, farthest, _PLACES)
    grid = np.array([log_sine[0], log_sine[1] - log_sine[0], place[0], place[1] - place[0]])
    return sines, cone_table(phase, log_sine, place), grid
