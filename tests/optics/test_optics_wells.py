"""Wells' model of the halo, which is there for comparison: his transfer function, energy, shape."""

import itertools
import math

import numpy as np
import pytest
from scipy.special import j0

from auvdock.optics.wells import wells_halo, wells_transfer

BR = [0.01, 0.1, 0.7, 2.0, 5.0, 10.0, 18.0]


@pytest.mark.parametrize("br", BR)
def test_hankel_transform_of_the_table_is_wells_function(br):
    theta0 = 0.02
    table = wells_halo(theta0)
    # The tail of small-angle theory runs to infinite angles; 400 θ0 leaves out less than 1 % of it.
    angle = np.exp(np.linspace(math.log(1e-6), math.log(8.0), 60001))
    density = table.density(np.array([br]), np.minimum(angle, 4.0))[0] * np.where(angle > 4.0, (4.0 / angle) ** 3, 1.0)
    for psi in (1.0, 4.0, 12.0):
        weight = density * j0(2.0 * math.pi * psi * angle) * 2.0 * math.pi * angle
        transform = float(np.trapezoid(weight, angle))
        expected = float(wells_transfer(br, np.array([psi]), theta0)[0])
        assert transform == pytest.approx(expected, abs=0.006 * -math.expm1(-br))


@pytest.mark.parametrize("br", BR)
def test_halo_and_core_hold_what_is_not_absorbed(br):
    encircled = float(wells_halo(0.02).encircled(np.array([br]), np.array([4.0]))[0, 0])
    # At 4 rad a single scattering has θ0 / 4 of its light left to come, several that many times more.
    missing = 0.02 * max(br, 1.0) / (2.0 * 4.0)
    assert encircled + math.exp(-br) + missing * -math.expm1(-br) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("br", [0.3, 3.0, 12.0])
def test_density_is_the_derivative_of_encircled_light(br):
    table = wells_halo(0.05)
    edges = np.geomspace(0.01, 1.0, 30)
    rings = np.diff(table.encircled(np.array([br]), edges)[0])
    for ring, low, high in zip(rings, edges, edges[1:], strict=False):
        angle = np.linspace(low, high, 200)
        inside = float(np.trapezoid(table.density(np.array([br]), angle)[0] * 2.0 * math.pi * angle, angle))
        assert ring == pytest.approx(inside, rel=0.02)


def half_width_deg(range_m: float, pixel_deg: float) -> float:
    """Half width of the halo as a camera with such a pixel resolves it."""
    angle = np.radians(np.linspace(pixel_deg / 2.0, 20.0, 20000))
    density = wells_halo(0.02).density(np.array([0.35 * range_m]), angle)[0]
    return float(np.degrees(angle[np.argmax(density < density[0] / 2.0)]))


def test_half_width_grows_with_range():
    widths = [half_width_deg(r, 0.1) for r in (6.0, 15.0, 25.0, 35.0, 45.0)]
    assert all(low < high for low, high in itertools.pairwise(widths))
    assert half_width_deg(6.0, 0.1) == pytest.approx(0.1, abs=0.05)
    assert half_width_deg(35.0, 0.1) == pytest.approx(3.0, abs=0.5)


def test_table_scales_with_the_scattering_angle():
    angle = np.array([0.003, 0.02, 0.1])
    depth = np.array([2.0])
    narrow, wide = wells_halo(0.02).density(depth, angle)[0], wells_halo(0.04).density(depth, 2.0 * angle)[0]
    assert narrow == pytest.approx(4.0 * wide, rel=1e-3)


def test_phase_function_is_that_of_one_scattering():
    """It is normalised in the plane, and what is scattered once has spread by it evenly over the way."""
    plane = np.geomspace(1e-7, 1e4, 100_001)
    table = wells_halo(0.02)
    assert np.trapezoid(table.phase(plane) * 2.0 * math.pi * plane, plane) == pytest.approx(1.0, abs=1e-3)
    # Scattered at a share u of the way by β, light is seen at u β off the lamp; seen within θ are β < θ / u.
    theta, u = 0.03, (np.arange(2000) + 0.5) / 2000.0
    seen = float(np.mean(1.0 - 0.02 / np.hypot(theta / u, 0.02)))
    assert table.encircled(np.array([0.002]), np.array([theta]))[0, 0] == pytest.approx(0.002 * seen, rel=0.01)
