"""Narrow beams by photons: held to reciprocity, to the isotropic lamp, to energy and to closed integrals."""

import math
from functools import lru_cache

import numpy as np
import pytest

from auvdock.numeric.scattering import turn_of
from auvdock.optics.light import beam_profile
from auvdock.optics.photons.beam import arriving, beam_share, halo_beam, leaving
from auvdock.optics.photons.beam_walk import ARRIVAL_DEG, CONE_DEG, LEFT_DEG, shoot_beams
from auvdock.optics.photons.cone import cone_table
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.photons.table import load_halo

FORAND = "fournier-forand-0.018"
BR = np.array([0.5, 3.0, 12.0])
ABSORPTION = np.array([0.1, 0.6])
LEFT = np.radians(LEFT_DEG)
FRONT = ARRIVAL_DEG.index(90.0)
ALIKE = np.ones((len(LEFT), 1))


@lru_cache(maxsize=2)
def batches(seed=5):
    rngs = np.random.default_rng(seed).spawn(10)
    return [shoot_beams(load_phase(FORAND), 3000, BR, ABSORPTION, rng, outer=40.0) for rng in rngs]


def mean_and_sigma(values):
    return np.mean(values, axis=0), np.std(values, axis=0, ddof=1) / math.sqrt(len(values))


def assert_same(one, other, sigma, rel=0.0):
    """Ten batches know their error to a quarter, hence five of them for the farthest of some dozens."""
    assert np.all(np.abs(one - other) < 5.0 * sigma + rel * np.abs(other)), (one / other, sigma / other)


def test_the_beam_spread_is_the_point_spread():
    # By ψ, arriving from anywhere, as by the angle of arrival, having left anywhere.
    edges = [1.0, 5.0, 10.0, 20.0, 40.0, 60.0, 90.0, 180.0]
    left, arrive = [LEFT_DEG.index(x) for x in edges], [ARRIVAL_DEG.index(x) for x in edges]
    by_left = [np.diff(np.cumsum(leaving(t), axis=-1)[..., left], prepend=0.0) for t in batches()]
    by_arrival = [np.diff(arriving(t, ALIKE)[:, :, 0, arrive], prepend=0.0) for t in batches()]
    (one, sigma), (two, other) = mean_and_sigma(by_left), mean_and_sigma(by_arrival)
    # 2 %: the ring of 80° to 90° counts as one.
    assert_same(one, two, np.hypot(sigma, other), rel=0.02)
    assert np.median(np.hypot(sigma, other) / two) < 0.045


def test_a_beam_all_around_is_the_isotropic_lamp_of_the_table():
    share = beam_share(LEFT, 1e6, np.radians([0.0, 70.0]))
    assert share == pytest.approx(np.ones_like(share), abs=1e-6)
    mean, sigma = mean_and_sigma([arriving(tally, share)[..., : FRONT + 1] for tally in batches()])
    halo, angle = load_halo(FORAND), np.radians(ARRIVAL_DEG[: FRONT + 1])
    for i, br in enumerate(BR):
        for k, x in enumerate(ABSORPTION):
            assert_same(mean[i, k, 1], halo.within(br, x, angle), sigma[i, k, 1], rel=0.005)


def test_what_is_expected_in_a_narrow_cone_is_what_arrives_there():
    cones = len(CONE_DEG)
    expected, sigma = mean_and_sigma([t.expected.sum(axis=2) / t.photons for t in batches()])
    awaited, other = mean_and_sigma(
        [np.cumsum(t.crossed[:, :cones].sum(axis=2), axis=1) / t.photons for t in batches()]
    )
    assert_same(expected[:, 2], awaited[:, 2], np.hypot(sigma, other)[:, 2])
    assert np.median(np.hypot(sigma, other)[:, 2] / awaited[:, 2]) < 0.05


def test_without_absorption_energy_is_kept():
    near, far = np.array([0.5, 1.2, 2.4]), np.array([3.0, 6.0, 12.0])
    for radius in (near, far):
        net = []
        for rng in np.random.default_rng(2).spawn(10):
            tally = shoot_beams(load_phase(FORAND), 400, radius, np.array([0.0]), rng, outer=30.0)
            outward = tally.crossed[:, : FRONT + 1].sum(axis=(1, 2, 3)) + tally.unscattered
            inward = tally.crossed[:, FRONT + 1 :].sum(axis=(1, 2, 3))
            assert np.all(inward > 0)
            net.append((outward - inward) / tally.photons)
        if radius is near:  # none is split
            assert net == pytest.approx(np.ones((10, len(radius))))
        else:  # kept on the average of those that are ended
            mean, sigma = mean_and_sigma(net)
            assert_same(np.ones(len(radius)), mean, sigma)
            assert np.all(sigma < 0.05)


def scattered_once(name, br, x, beam_deg, off_axis):
    """∫ dω f b ∫ ds p(Θ) e^{-c (s + d - R)} R² / d² along the rays of a beam, ds / d² = dΘ / (R sin ψ)."""
    psi = np.geomspace(1e-6, math.pi * (1.0 - 1e-6), 1500)[:, None]
    turned = psi + (math.pi - psi) * np.geomspace(1e-6, 1.0 - 1e-9, 1500)
    way = (np.sin(turned - psi) + np.sin(psi)) / np.sin(turned) - 1.0
    lost = load_phase(name).density(turned.ravel()).reshape(turned.shape) * np.exp(-(1.0 + x) * br * way)
    along = np.trapezoid(lost, turned, axis=1)
    azimuth = (np.arange(720) + 0.5) * math.pi / 720
    cosine = np.cos(psi) * math.cos(off_axis) + np.sin(psi) * math.sin(off_axis) * np.cos(azimuth)
    mean = beam_profile(np.arccos(np.clip(cosine, -1.0, 1.0)), beam_deg).mean(axis=1)
    return float(np.trapezoid(2.0 * math.pi * mean * br * math.exp(-br) * along * psi[:, 0], np.log(psi[:, 0])))


@pytest.mark.parametrize("beam_deg", [10.0, 60.0])
def test_in_thin_water_it_is_single_scattering_along_the_beam(beam_deg):
    br, x, off_axis = np.array([0.05]), np.array([0.3]), np.radians([0.0, 5.0, 15.0])
    share = beam_share(LEFT, beam_deg, off_axis)
    rngs = np.random.default_rng(8).spawn(10)
    tallies = [shoot_beams(load_phase(FORAND), 20_000, br, x, rng, outer=3.0) for rng in rngs]
    mean, sigma = mean_and_sigma([arriving(tally, share)[0, 0, :, -1] for tally in tallies])
    expected = [scattered_once(FORAND, 0.05, 0.3, beam_deg, theta) for theta in off_axis]
    # Half of b r is scattered again, and mostly comes still.
    assert_same(mean, np.array(expected), sigma, rel=0.04)
    assert np.all(sigma < 0.08 * mean)


@pytest.mark.parametrize("beam_deg", [10.0, 60.0])
def test_a_table_of_the_halo_tells_a_beams_light(beam_deg):
    off_axis = np.radians([0.0, 5.0, 10.0, 20.0, 40.0])
    share = beam_share(LEFT, beam_deg, off_axis)
    mean, sigma = mean_and_sigma([arriving(tally, share)[..., -1] for tally in batches()])
    for i, br in enumerate(BR):
        for k, x in enumerate(ABSORPTION):
            assert_same(halo_beam(load_halo(FORAND), br, x, beam_deg, off_axis), mean[i, k], sigma[i, k], rel=0.01)


def test_two_seeds_agree_within_their_errors():
    share = beam_share(LEFT, 10.0, np.radians([0.0, 5.0, 10.0, 20.0]))
    (one, sigma), (two, other) = (mean_and_sigma([arriving(t, share) for t in batches(seed)]) for seed in (5, 6))
    off = ((one - two) / np.hypot(sigma, other))[..., 2::6]
    assert np.max(np.abs(off)) < 5.0
    # As large as errors are: neither the same stream nor an error too wide.
    assert 0.5 < np.sqrt(np.mean(off**2)) < 1.7


@pytest.mark.parametrize("half_deg", [0.2, 3.0, 40.0])
def test_a_cone_gets_its_share(half_deg):
    phase, half = load_phase(FORAND), math.radians(half_deg)
    place = np.linspace(-3.0, math.sqrt(math.log(math.pi / half)), 2000)
    (row,) = cone_table(phase, np.array([math.log(math.sin(half))]), place)
    off = half * np.exp(np.sign(place) * place**2)
    # From its middle what is scattered by less; from all sides alike its share of the sphere.
    assert row[0] == pytest.approx(phase.share_within(half), rel=2e-3)
    assert np.trapezoid(0.5 * np.sin(off) * row, off) == pytest.approx(0.5 * (1.0 - math.cos(half)), rel=3e-3)


def test_a_cone_gets_what_is_drawn_into_it():
    phase, half, rng = load_phase(FORAND), math.radians(8.0), np.random.default_rng(3)
    versine = np.array([turn_of(share, phase.quantiles, phase.power) for share in rng.random(40_000)])
    for off_deg in (4.0, 7.5, 9.0, 25.0):
        off = math.radians(off_deg)
        turn = np.sqrt(versine * (2.0 - versine)) * np.cos(2.0 * math.pi * rng.random(len(versine)))
        hit = float(np.mean((1.0 - versine) * math.cos(off) + turn * math.sin(off) > math.cos(half)))
        place = math.copysign(math.sqrt(abs(math.log(off / half))), off - half)
        share = float(cone_table(phase, np.array([math.log(math.sin(half))]), np.array([place]))[0, 0])
        assert hit == pytest.approx(share, abs=4.0 * math.sqrt(share / len(versine)))
