"""The halo's table: held to fresh photons, to single scattering in thin water, and refused where it ends."""

import dataclasses
import itertools
import math
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import j0

from auvdock.assets import asset
from auvdock.core.errors import ConfigError
from auvdock.optics.photons.making import ANGLE_RAD, left_after, make_grid, ring_radiance
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.single import SingleScattering
from auvdock.optics.photons.table import halo_names, load_halo, photon_halo_of
from auvdock.optics.photons.walk import shoot
from auvdock.optics.water import load_water

FORAND = "fournier-forand-0.018"
BR = np.array([0.7, 2.6, 6.3])
RATIOS = np.array([0.05, 0.3, 1.0])
READ = np.radians([2.0, 5.0, 10.0, 20.0, 40.0])


@lru_cache(maxsize=1)
def batches():
    phase = load_phase(FORAND)
    return [shoot(phase, 4000, BR, ANGLE_RAD, rng, outer=25.0) for rng in np.random.default_rng(11).spawn(10)]


def test_the_tables_ship_and_are_small():
    assert {FORAND, "petzold-coastal", "petzold-harbour"} <= set(halo_names())
    assert sum(len(asset("halos", name, ".npz").read_bytes()) for name in halo_names()) < 2 * 2**20


def test_table_agrees_with_fresh_photons_within_their_errors():
    # Photons of all orders, not smoothed and without the integral of single scattering, at places off the table's.
    halo, (facing, solid) = load_halo(FORAND), ring_radiance(ANGLE_RAD)
    within = []
    for tally in batches():
        crossed = np.einsum("nme,ke->nkm", tally.once + tally.more, left_after(RATIOS)) / tally.photons
        within.append(np.cumsum(crossed * solid / facing, axis=-1))
    mean, sigma = np.mean(within, axis=0), np.std(within, axis=0, ddof=1) / math.sqrt(len(within))
    for i, br in enumerate(BR):
        for k, x in enumerate(RATIOS):
            fresh, error = (np.interp(READ, ANGLE_RAD, curve[i, k]) for curve in (mean, sigma))
            off = halo.within(br, x, READ) - fresh
            # Ten batches know their error to a quarter; 0.5 % for what lies between the table's places.
            assert np.all(np.abs(off) < 5.0 * error + 0.005 * fresh), (br, x, off / error)
            assert error[-1] / fresh[-1] < 0.02


def test_a_table_made_anew_agrees_within_the_errors_that_it_states():
    made, halo = make_grid(FORAND, batches(), RATIOS), load_halo(FORAND)
    read = np.radians([0.2, 1.0, 5.0, 20.0])
    for i, br in enumerate(BR):
        for k, x in enumerate(RATIOS):
            curve, error = (np.interp(read, ANGLE_RAD, values[i, k]) for values in (made.log_within, made.error))
            off = np.exp(curve) / halo.within(br, x, read) - 1.0
            assert np.all(np.abs(off) < 5.0 * error + 0.01), (br, x, off, error)


@pytest.mark.parametrize("name", halo_names())
@pytest.mark.parametrize("x", [0.03, 0.4, 5.0])
def test_in_thin_water_it_is_single_scattering(name, x):
    once, halo, angle = SingleScattering(load_phase(name)), load_halo(name), np.radians([0.01, 0.2, 2.0, 20.0, 80.0])
    for br in (1e-4, 0.005, 0.02):
        # Of what is scattered, half of b r is scattered again, and mostly comes still.
        assert halo.within(br, x, angle) == pytest.approx(once.within(br, x, angle), rel=0.012 + 0.7 * br)


@given(
    br=st.floats(1e-3, 60.0),
    x=st.floats(0.01, 100.0),
    degrees=st.lists(st.floats(0.0, 90.0), min_size=2, max_size=8),
)
@settings(max_examples=60, deadline=None)
def test_a_wider_cone_never_holds_less(br, x, degrees):
    angle = np.radians(np.sort(degrees))
    within = load_halo(FORAND).within(br, x, angle)
    assert np.all(np.isfinite(within))
    assert np.all(within >= 0.0)
    assert np.all(np.diff(within) >= -1e-9 * within[1:])


def test_absorption_takes_more_of_wider_light_and_a_longer_way_spreads_it():
    halo, angle = load_halo(FORAND), np.radians([0.5, 5.0, 40.0])
    clear, murky = halo.within(5.0, 0.05, angle), halo.within(5.0, 1.0, angle)
    assert np.all(np.diff(murky / clear) < 0.0)
    shares = [halo.within(br, 0.1, angle)[0] / halo.within(br, 0.1, angle)[2] for br in (0.5, 2.0, 8.0, 20.0)]
    assert shares == sorted(shares, reverse=True)


@pytest.mark.parametrize(("br", "x"), [(0.004, 0.1), (3.0, 0.2), (15.0, 1.0)])
def test_radiance_is_the_derivative(br, x):
    halo = load_halo(FORAND)
    edges = np.radians(np.geomspace(0.005, 60.0, 12))
    for low, high in itertools.pairwise(edges):
        angle = np.geomspace(low, high, 400)
        ring = float(np.trapezoid(halo.radiance(br, x, angle) * 2.0 * math.pi * np.sin(angle), angle))
        inner, outer = halo.within(br, x, np.array([low, high]))
        assert ring == pytest.approx(outer - inner, rel=2e-3)


@pytest.mark.parametrize(("br", "x"), [(61.0, 0.1), (0.0, 0.1), (1.0, 0.009), (1.0, math.inf), (math.nan, 0.1)])
def test_beyond_the_table_a_reading_is_refused(br, x):
    with pytest.raises(ConfigError):
        load_halo(FORAND).within(br, x, np.array([1.0]))
    with pytest.raises(ConfigError):
        load_halo(FORAND).within(1.0, 0.1, np.array([1.6]))
    with pytest.raises(ConfigError):
        load_halo("fournier-forand-0.5")


def test_far_beyond_the_table_it_goes_on_as_light_does():
    phase, angle = load_phase(FORAND), np.radians([5.0, 10.0, 20.0, 30.0, 40.0, 90.0])
    ratios, depth = np.array([0.05, 0.15]), np.array([50.0])
    tally = shoot(phase, 6000, depth, angle, np.random.default_rng(2), outer=80.0)
    facing, solid = ring_radiance(angle)
    crossed = np.einsum("nme,ke->nkm", tally.more, left_after(ratios))[0] / tally.photons
    within = np.cumsum(crossed * solid / facing, axis=-1)
    for k, x in enumerate(ratios):
        # 6 % for the straight line, and three errors of some 600 photons within 20° and 2000 within 40°.
        read = load_halo(FORAND).within(50.0, x, angle[[2, 4]])
        assert read == pytest.approx(within[k, [2, 4]], rel=0.2)


@pytest.mark.parametrize("name", ["0.4*petzold-clear+0.6*petzold-coastal", "0.66*petzold-coastal+0.34*petzold-harbour"])
def test_a_mixtures_halo_is_that_of_photons_in_its_phase_function(name):
    halo, phase, (facing, solid) = load_halo(name), load_phase(name), ring_radiance(ANGLE_RAD)
    within = []
    for rng in np.random.default_rng(5).spawn(10):
        tally = shoot(phase, 4000, BR, ANGLE_RAD, rng, outer=25.0)
        crossed = np.einsum("nme,ke->nkm", tally.once + tally.more, left_after(RATIOS)) / tally.photons
        within.append(np.cumsum(crossed * solid / facing, axis=-1))
    mean, sigma = np.mean(within, axis=0), np.std(within, axis=0, ddof=1) / math.sqrt(len(within))
    for i, br in enumerate(BR):
        for k, x in enumerate(RATIOS):
            fresh, error = (np.interp(READ, ANGLE_RAD, curve[i, k]) for curve in (mean, sigma))
            # 5 % for a logarithm that is linear in the shares.
            assert np.all(np.abs(halo.within(br, x, READ) - fresh) < 5.0 * error + 0.05 * fresh), (br, x)


@pytest.mark.parametrize("x", [300.0, 3000.0])
def test_beyond_the_strongest_absorption_it_goes_on_as_single_scattering_does(x):
    once, angle = SingleScattering(load_phase(FORAND)), np.radians([0.2, 2.0, 20.0, 80.0])
    for br in (0.1 / x, 3.0 / x, 20.0 / x):
        assert load_halo(FORAND).within(br, x, angle) == pytest.approx(once.within(br, x, angle), rel=0.07)


@pytest.mark.parametrize("theta0", [0.02, 0.05])
@pytest.mark.parametrize("br", [0.5, 3.0, 15.0])
def test_wells_model_has_wells_transfer_function(br, theta0):
    water = dataclasses.replace(load_water("lake"), phase_function="wells", scattering_angle_rad=theta0)
    halo = photon_halo_of(water)
    edges = np.geomspace(1e-4 * theta0, 1.5, 4000)
    ring = np.diff(halo.within(br, 0.3, edges), prepend=0.0)
    middle = np.concatenate([[0.5 * edges[0]], np.sqrt(edges[1:] * edges[:-1])])
    for k in (0.3, 1.2, 6.0):
        # Wells (1973): of the frequency k / (2π θ0), without absorption and without what is not scattered.
        expected = math.exp(-br) * math.expm1(br * -math.expm1(-k) / k)
        assert float(np.sum(ring * j0(k / theta0 * middle))) == pytest.approx(expected, abs=0.01)
    assert halo.within(br, 0.02, edges[-5:]) == pytest.approx(halo.within(br, 5.0, edges[-5:]))
