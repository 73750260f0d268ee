"""Walks of single photons: held to what must come out whatever the code, and to a walk in plain coordinates."""

import math
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.assets import asset
from auvdock.core.errors import ConfigError
from auvdock.core.strict import load_toml
from auvdock.numeric.scattering import turn_of
from auvdock.optics.phase_function import fournier_forand
from auvdock.optics.photons.making import left_after, ring_radiance
from auvdock.optics.photons.mixture import mixture_name, shares_of
from auvdock.optics.photons.phase import MeasuredPhase, load_phase, phase_names
from auvdock.optics.photons.single import SingleScattering
from auvdock.optics.photons.walk import shoot

FORAND = "fournier-forand-0.018"
RADIUS = np.array([0.1, 0.5, 1.0, 2.0, 3.0])
ANGLE = np.radians([0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 90.0])
ABSORPTION = np.array([0.0, 0.2, 1.0, 20.0])


@lru_cache(maxsize=4)
def tally(seed, name=FORAND, photons=40_000):
    return shoot(load_phase(name), photons, RADIUS, ANGLE, np.random.default_rng(seed), outer=12.0)


def crossings(counts):
    """Sum of e^{-(a/b) e} over photons by sphere, a / b and ring, and its standard error."""
    left = left_after(ABSORPTION)
    total = np.einsum("nme,ke->nkm", counts, left)
    return total, np.sqrt(np.einsum("nme,ke->nkm", counts, left**2))


def test_energy_is_kept_without_absorption():
    # Outward less inward crossings of any sphere: each photon ends far outside, none is lost on the way.
    out = tally(0)
    assert out.lost == 0
    assert out.net.tolist() == [out.photons] * len(RADIUS)
    gone = out.unscattered + out.once.sum(axis=(1, 2)) + out.more.sum(axis=(1, 2))
    assert np.all(gone >= out.photons)
    assert gone[-1] > out.photons  # some come back in and go out again


def test_unscattered_light_is_beers():
    out = tally(0)
    expected = np.exp(-RADIUS)
    sigma = np.sqrt(expected * (1.0 - expected) / out.photons)
    assert np.all(np.abs(out.unscattered / out.photons - expected) < 4.0 * sigma)


@pytest.mark.parametrize("name", [*phase_names(), "fournier-forand-0.006", "fournier-forand-0.05"])
def test_drawn_angles_have_the_phase_functions_mean_cosine(name):
    phase = load_phase(name)
    shares = (np.arange(200_000) + 0.5) / 200_000
    drawn = np.array([turn_of(share, phase.quantiles, phase.power) for share in shares[::20]])

    angle = np.geomspace(1e-16, math.pi, 60_001)
    per_log = 2.0 * math.pi * np.sin(angle) * phase.density(angle) * angle
    total, mean = (float(np.trapezoid(per_log * factor, np.log(angle))) for factor in (1.0, np.cos(angle)))
    assert total == pytest.approx(1.0, abs=1e-4)
    assert 1.0 - drawn.mean() == pytest.approx(mean, abs=3e-4)
    assert phase.mean_cosine == pytest.approx(mean, abs=3e-4)
    # And not only their mean: as many lie below an angle as the function says.
    for degrees in (0.01, 0.1, 1.0, 10.0, 90.0):
        below = float(np.mean(drawn < 1.0 - math.cos(math.radians(degrees))))
        assert below == pytest.approx(phase.share_within(math.radians(degrees)), abs=3e-4)


def test_fournier_and_forands_function_is_the_one_of_the_optics():
    phase, angle = load_phase(FORAND), np.geomspace(1e-5, 3.1, 200)
    assert phase.density(angle) == pytest.approx(fournier_forand(angle), rel=1e-4)
    assert load_phase("fournier-forand-0.05").backscatter_ratio == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize("name", ["petzold-clear", "petzold-coastal", "petzold-harbour"])
def test_measured_functions_integrate_to_what_the_report_prints(name):
    measured, phase = load_toml(MeasuredPhase, asset("phases", name)), load_phase(name)
    # Printed to two digits; the report's own quadrature.
    assert phase.backscatter_ratio == pytest.approx(measured.backscatter_ratio, abs=6e-4)
    assert phase.share_within(math.radians(0.1)) == pytest.approx(measured.share_below, rel=0.01)
    printed = measured.function_per_m_sr[20] / measured.scattering_per_m
    assert float(phase.density(np.radians(measured.angle_deg[20:21]))[0]) == pytest.approx(printed, rel=0.01)


def test_a_mixture_scatters_as_its_parts_do_together():
    shares = {"petzold-clear": 0.3, "petzold-harbour": 0.7}
    mixed, angle = load_phase(mixture_name(shares)), np.radians([0.01, 1.0, 30.0, 120.0])
    parts = [(share, load_phase(name)) for name, share in shares.items()]
    assert mixed.mean_cosine == pytest.approx(sum(share * part.mean_cosine for share, part in parts))
    assert mixed.backscatter_ratio == pytest.approx(sum(share * part.backscatter_ratio for share, part in parts))
    assert mixed.density(angle) == pytest.approx(sum(share * part.density(angle) for share, part in parts), rel=1e-3)


@given(share=st.floats(1e-6, 1.0 - 1e-6))
def test_a_mixtures_name_keeps_its_shares_to_the_bit(share):
    shares = {"petzold-clear": 1.0 - share, "petzold-coastal": share}
    assert shares_of(mixture_name(shares)) == shares


MIXTURES = ["0.5*petzold-clear", "0.5*petzold-clear+x*petzold-harbour", "0.6*petzold-clear+0.6*petzold-harbour"]


@pytest.mark.parametrize("name", ["fournier-forand-x", "fournier-forand-0.9", "petzold", *MIXTURES])
def test_an_unknown_phase_function_is_refused(name):
    with pytest.raises(ConfigError):
        load_phase(name)


@pytest.mark.parametrize("name", [FORAND, "petzold-coastal"])
def test_single_scattering_is_its_closed_integral(name):
    out = tally(1, name)
    facing, solid = ring_radiance(ANGLE)
    total, sigma = crossings(out.once)
    once = SingleScattering(load_phase(name))
    for i, br in enumerate(RADIUS):
        for k, x in enumerate(ABSORPTION):
            rings = np.diff(once.within(br, x, ANGLE), prepend=0.0) * facing / solid * out.photons
            known = (sigma[i, k] > 0.0) & (rings > 20.0)
            known[-1] = False  # radiance is not even over 60° to 90°
            assert known.sum() >= 4
            off = (total[i, k] - rings)[known] / sigma[i, k][known]
            assert np.all(np.abs(off) < 4.5), (br, x, off)


def test_two_seeds_agree_within_their_errors():
    (one, sigma), (two, other) = crossings(tally(0).more), crossings(tally(1).more)
    spread = np.hypot(sigma, other)
    known = spread > 4.0
    off = (one - two)[known] / spread[known]
    assert known.sum() > 60
    assert np.max(np.abs(off)) < 4.5
    # As large as errors are, not much smaller either: neither the same stream nor an error too wide.
    assert 0.6 < np.sqrt(np.mean(off**2)) < 1.5


def test_same_seed_same_counts():
    one, two = (shoot(load_phase(FORAND), 300, RADIUS, ANGLE, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one.more, two.more)
    assert np.array_equal(one.once, two.once)


def test_a_walk_in_plain_coordinates_arrives_alike():
    # Positions and directions as vectors, by NumPy: nothing of the symmetry that the compiled walk rests on. Counted at
    # b r = 3 by the angle between direction and radius, with what an a / b of 0.2 leaves of each photon.
    phase, rng, radius, count = load_phase(FORAND), np.random.default_rng(3), 3.0, 30_000
    place, way = np.zeros((count, 3)), rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    path, found = np.zeros(count), np.zeros(len(ANGLE))
    square = np.zeros(len(ANGLE))
    while len(place):
        flight = rng.exponential(size=len(place))
        along = np.einsum("ij,ij->i", place, way)
        inside = np.einsum("ij,ij->i", place, place) - along**2
        exit_at = np.sqrt(np.maximum(radius**2 - inside, 0.0)) - along
        crosses = (inside < radius**2) & (exit_at > 0.0) & (exit_at <= flight)
        where = place[crosses] + exit_at[crosses, None] * way[crosses]
        cosine = np.einsum("ij,ij->i", where, way[crosses]) / radius
        sine = np.linalg.norm(np.cross(where, way[crosses]), axis=1) / radius
        weight = np.exp(-0.2 * (path[crosses] + exit_at[crosses] - radius)) * (sine > 1e-12)
        ring = np.minimum(np.searchsorted(ANGLE, np.arctan2(sine, cosine), side="right"), len(ANGLE) - 1)
        found += np.bincount(ring, weight, minlength=len(ANGLE))
        square += np.bincount(ring, weight**2, minlength=len(ANGLE))
        place, path = place + flight[:, None] * way, path + flight
        kept = np.einsum("ij,ij->i", place, place) < 12.0**2
        place, way, path = place[kept], way[kept], path[kept]
        cos_turn = 1.0 - np.interp(rng.random(len(way)), np.arange(len(phase.quantiles)) / 16384.0, phase.quantiles)
        side = np.cross(way, rng.normal(size=way.shape))
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        way = cos_turn[:, None] * way + np.sqrt(np.maximum(1.0 - cos_turn**2, 0.0))[:, None] * side
        way /= np.linalg.norm(way, axis=1, keepdims=True)
    out = tally(0)
    total, sigma = crossings(out.once + out.more)
    ours, error = total[-1, 1] / out.photons, sigma[-1, 1] / out.photons
    off = (found / count - ours) / np.hypot(error, np.sqrt(square) / count)
    assert np.all(found > 30.0)
    assert np.all(np.abs(off) < 4.0), off
