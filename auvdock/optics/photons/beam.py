"""Light of a narrow beam that arrives scattered: its profile over the photons of `optics.photons.beam_walk`.

A lamp sends I0 f(γ) to the angle γ off its axis, f = exp(-ln 2 (γ / θ_h)²). Of photons sent out evenly, one that left
at ψ from the line of sight stands for what such a lamp sends there. Its axis lies at θ from the line of sight, and
photons are alike all around that line, so it counts with f in the mean over the azimuth φ,

    F(ψ, θ) = (1 / 2π) ∫ f(γ) dφ,    cos γ = cos ψ cos θ + sin ψ sin θ cos φ.

What arrives is radiance integrated over solid angle (scalar irradiance, what a camera's pixels sum up to): crossings
count 1 / |cos| of the angle of arrival. Its sum over all directions, over I0 e^{-a r} / r², is g(θ).

By reciprocity (Mertens & Replogle 1977) photons that left at ψ and arrive from anywhere are as many as those of an
isotropic lamp that arrive under ψ and left anywhere. So g = ∫ F(ψ, θ) h(ψ) 2π sin ψ dψ, with h the halo's radiance,
which `halo_beam` reads from a table. The half sphere before the receiver, up to 90° about the lamp, gets less: what
comes from behind is not in it.
"""

from __future__ import annotations

import math

import numpy as np

from auvdock.core.arrays import Array
from auvdock.optics.light import beam_profile
from auvdock.optics.photons.beam_walk import ARRIVAL_DEG, CONE_DEG, BeamTally
from auvdock.optics.photons.making import ring_radiance
from auvdock.optics.photons.table import PhotonHalo

__all__ = ["arriving", "beam_share", "halo_beam", "leaving"]

_AZIMUTHS, _NODES = 360, 4


def arriving(tally: BeamTally, share: Array) -> Array:
    """(n, k, j, m) scattered light within the half angles `ARRIVAL_DEG` (m,), over I0 e^{-a r} / r².

    Args:
        tally: photons.
        share: (p, j) what counts of photons that left in the bins of ψ: of `beam_share`; 1 for an isotropic lamp.
    """
    facing, solid = ring_radiance(np.radians(ARRIVAL_DEG))
    crossed = np.einsum("nmpk,pj->nkjm", tally.crossed, share, optimize=True) * np.abs(solid / facing)
    cones = len(CONE_DEG)
    crossed[..., :cones] = np.diff(
        np.einsum("ncpk,pj->nkjc", tally.expected, share, optimize=True), axis=-1, prepend=0.0
    )
    return np.cumsum(crossed, axis=-1) / tally.photons


def leaving(tally: BeamTally) -> Array:
    """(n, k, p) scattered light from all directions by the bins of ψ, as of an isotropic lamp: the beam spread."""
    facing, solid = ring_radiance(np.radians(ARRIVAL_DEG))
    return np.einsum("nmpk,m->nkp", tally.crossed, np.abs(solid / facing), optimize=True) / tally.photons


def beam_share(edges_rad: Array, beam_deg: float, off_axis_rad: Array) -> Array:
    """(p, j) F(ψ, θ) in the mean over rings of ψ.

    Args:
        edges_rad: (p,) outer edges of the rings; the first begins at 0.
        beam_deg: full angle of the beam, 2 θ_h.
        off_axis_rad: (j,) θ.
    """
    edges = np.concatenate([[0.0], edges_rad])
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    psi = (edges[:-1, None] + np.diff(edges)[:, None] * 0.5 * (node + 1.0))[..., None]
    azimuth = (np.arange(_AZIMUTHS) + 0.5) * math.pi / _AZIMUTHS
    solid = weight * np.sin(psi[..., 0])
    columns: list[Array] = []
    for theta in off_axis_rad:
        cosine = np.cos(psi) * math.cos(theta) + np.sin(psi) * math.sin(theta) * np.cos(azimuth)
        mean = beam_profile(np.arccos(np.clip(cosine, -1.0, 1.0)), beam_deg).mean(axis=-1)
        columns.append(np.sum(mean * solid, axis=1) / solid.sum(axis=1))
    return np.stack(columns, axis=1)


def halo_beam(halo: PhotonHalo, br: float, absorption: float, beam_deg: float, off_axis_rad: Array) -> Array:
    """(j,) g by reciprocity from a table of the halo; what left backward, ψ > 90°, is in no table and left out.

    Args:
        halo: table.
        br: b r.
        absorption: a / b.
        beam_deg: full angle of the beam.
        off_axis_rad: (j,) θ.
    """
    edges = np.radians(np.concatenate([np.geomspace(0.01, 1.0, 40), np.arange(1.25, 90.1, 0.25)]))
    rings = np.diff(halo.within(br, absorption, edges), prepend=0.0)
    return rings @ beam_share(edges, beam_deg, off_axis_rad)
