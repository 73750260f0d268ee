"""The beam spread against a numeric convolution, its limits and its energy."""

import math

import numpy as np
import pytest

from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.halo import halo_table

LN2 = math.log(2.0)


def convolved(br, theta0, half, angle):
    """∫ f(θ - ψ) h(ψ) d²ψ and the mean of ψ along θ by quadrature in real space."""
    psi = np.geomspace(1e-5, 8.0, 2000)
    way = np.linspace(0.0, 2.0 * math.pi, 361)[:-1]
    density = halo_table(theta0).density(br, psi) / -math.expm1(-br)
    apart2 = angle**2 + psi[:, None] ** 2 - 2.0 * angle * psi[:, None] * np.cos(way)
    f = np.exp(-LN2 * apart2 / half**2)
    total = np.trapezoid(f.mean(axis=1) * density * 2.0 * math.pi * psi, psi)
    along = np.trapezoid((f * np.cos(way)).mean(axis=1) * density * 2.0 * math.pi * psi**2, psi)
    return total, along / total


@pytest.mark.parametrize("br", [0.3, 1.75, 7.0, 15.75])
@pytest.mark.parametrize("theta0", [0.02, 0.05])
def test_is_the_convolution(br, theta0):
    half = math.radians(5.0)
    spread = beam_spread(halo_table(theta0), half)
    for degrees in (0.5, 2.0, 5.0, 10.0, 15.0, 30.0, 90.0):
        angle = math.radians(degrees)
        share, lead = convolved(br, theta0, half, angle)
        assert spread.share(np.array([br]), np.array([angle]))[0] == pytest.approx(share, rel=0.015)
        assert spread.lead_rad(np.array([br]), np.array([angle]))[0] == pytest.approx(lead, rel=0.02)


@pytest.mark.parametrize("br", [0.1, 7.0, 30.0])
def test_keeps_the_light(br):
    """∫ g d²θ = ∫ f d²θ: small-angle scattering moves light, it loses none. The halo's far tail is left out: 1 %."""
    half = math.radians(5.0)
    angle = np.geomspace(1e-4, math.pi, 4000)
    share = beam_spread(halo_table(0.02), half).share(np.full(len(angle), br), angle)
    total = np.trapezoid(share * 2.0 * math.pi * angle, angle)
    tail = 2.0 * math.pi * share[-1] * math.pi**2  # ∝ θ^-3 beyond π
    assert total + tail == pytest.approx(math.pi * half**2 / LN2, rel=0.01)


def test_few_events_of_little_deflection_leave_the_beam():
    angle = np.radians([0.0, 3.0, 6.0])
    half = math.radians(5.0)
    share = beam_spread(halo_table(0.001), half).share(np.full(3, 0.001), angle)
    assert share == pytest.approx(np.exp(-LN2 * (angle / half) ** 2), rel=0.02)


def test_wide_beam_is_unchanged():
    angle = np.radians([0.0, 20.0, 40.0])
    half = math.radians(40.0)
    share = beam_spread(halo_table(0.02), half).share(np.full(3, 2.0), angle)
    assert share == pytest.approx(np.exp(-LN2 * (angle / half) ** 2), rel=0.07)


def test_more_scattering_wider_beam():
    spread, far = beam_spread(halo_table(0.02), math.radians(5.0)), math.radians(20.0)
    br = np.array([0.5, 2.0, 8.0, 20.0])
    on, off = spread.share(br, np.zeros(4)), spread.share(br, np.full(4, far))
    assert np.all(np.diff(on) < 0.0)
    assert np.all(np.diff(off / on) > 0.0)
    lead = spread.lead_rad(br, np.full(4, far))
    assert np.all((lead > 0.0) & (lead < far * 1.01))
    assert spread.share(np.zeros(0), np.zeros(0)).shape == (0,)
