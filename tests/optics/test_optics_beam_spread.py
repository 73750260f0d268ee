"""The beam spread against a numeric convolution on the sphere, its limits and its energy."""

import math

import numpy as np
import pytest

from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.halo import halo_of
from auvdock.optics.light import profile_solid_angle_sr
from auvdock.optics.photons.table import photon_halo_of
from auvdock.optics.water import WaterCfg, load_water

LN2 = math.log(2.0)
POOL = load_water("pool")


def spread_of(half_deg, water=POOL):
    return beam_spread(halo_of(water), 0, math.radians(half_deg))


def convolved(br, half, angle):
    """∫ f h dω and the mean of ψ along the beam, over the rays within 90° of the line of sight, in the pool."""
    psi = np.geomspace(1e-5, math.pi / 2.0, 1500)
    way = np.linspace(0.0, 2.0 * math.pi, 721)[:-1]
    photons = photon_halo_of(POOL)
    density = photons.radiance(br, 0.05 / 0.35, psi) / photons.within(br, 0.05 / 0.35, psi[-1:])
    cosine = math.cos(angle) * np.cos(psi)[:, None] + math.sin(angle) * np.sin(psi)[:, None] * np.cos(way)
    f = np.exp(-LN2 * np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2 / half**2)
    ring = density * 2.0 * math.pi * np.sin(psi)
    total = np.trapezoid(f.mean(axis=1) * ring, psi)
    along = np.trapezoid((f * np.cos(way)).mean(axis=1) * ring * psi, psi)
    return total, along / total


@pytest.mark.parametrize("br", [0.3, 1.75, 7.0, 15.75])
@pytest.mark.parametrize("half_deg", [2.0, 5.0, 30.0])
def test_is_the_convolution(br, half_deg):
    """Within 2 %, and on the axis the light that reaches in below the first angle of the quadrature is little."""
    spread = spread_of(half_deg)
    for degrees in (0.5, 2.0, 5.0, 10.0, 15.0, 30.0, 70.0):
        angle = math.radians(degrees)
        share, lead = convolved(br, math.radians(half_deg), angle)
        if degrees + 2.5 * half_deg < 90.0:  # else rays from beyond 90° count too
            assert spread.share(np.array([br]), np.array([angle]))[0] == pytest.approx(share, rel=0.02)
            assert spread.lead_rad(np.array([br]), np.array([angle]))[0] == pytest.approx(lead, rel=0.03)


@pytest.mark.parametrize("br", [0.1, 7.0, 30.0])
def test_keeps_the_light(br):
    """∫ g dω = ∫ f dω ∫ h dω: what is folded is moved and not lost; h holds some light beyond 90° besides."""
    half = 5.0
    angle = np.geomspace(1e-4, math.pi, 4000)
    share = spread_of(half).share(np.full(len(angle), br), angle)
    total = np.trapezoid(share * 2.0 * math.pi * np.sin(angle), angle)
    table, wide = halo_of(POOL), np.linspace(0.5 * math.pi, math.pi - 1e-6, 500)
    density = table.density(br, wide) / table.scattered(np.array([br]), 0)
    behind = np.trapezoid(density * 2.0 * math.pi * np.sin(wide), wide)
    assert total == pytest.approx(profile_solid_angle_sr(2.0 * half) * (1.0 + behind), rel=0.01)


def test_an_even_lamp_is_unchanged():
    share = spread_of(1000.0).share(np.full(3, 3.0), np.array([0.0, 0.5, 1.5]))
    table, wide = halo_of(POOL), np.linspace(0.5 * math.pi, math.pi - 1e-6, 500)
    density = table.density(3.0, wide) / table.scattered(np.array([3.0]), 0)
    behind = np.trapezoid(density * 2.0 * math.pi * np.sin(wide), wide)
    assert share == pytest.approx(1.0 + behind, rel=0.01)


def test_far_from_the_axis_light_is_scattered_once_in_thin_water():
    """A narrow beam at θ off: I0 Ω b r ∫ p(θ + φ) dφ / sin θ is what is scattered into the receiver along the beam."""
    water = WaterCfg("thin", "test", (1e-4, 1e-4, 1e-4), (0.01, 0.01, 0.01))
    table, br = halo_of(water), 0.02
    spread = spread_of(2.0, water)
    for degrees in (20.0, 40.0, 60.0):
        theta = math.radians(degrees)
        turn = np.linspace(theta, math.pi, 4000)
        once = br / math.sin(theta) * np.trapezoid(table.phase_per_sr(turn), turn) * profile_solid_angle_sr(4.0)
        g = spread.share(np.array([br]), np.array([theta]))[0] * table.scattered(np.array([br]), 0)[0]
        assert g == pytest.approx(once, rel=0.04)
        # It left the lamp along the beam.
        assert spread.lead_rad(np.array([br]), np.array([theta]))[0] == pytest.approx(theta, rel=0.03)


def test_more_scattering_wider_beam():
    spread, far = spread_of(5.0), math.radians(20.0)
    br = np.array([0.5, 2.0, 8.0, 20.0])
    on, off = spread.share(br, np.zeros(4)), spread.share(br, np.full(4, far))
    assert np.all(np.diff(on) < 0.0)
    assert np.all(np.diff(off / on) > 0.0)
    lead = spread.lead_rad(br, np.full(4, far))
    assert np.all((lead > 0.0) & (lead < far * 1.01))
    assert spread.share(np.zeros(0), np.zeros(0)).shape == (0,)
