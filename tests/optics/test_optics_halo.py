"""The halo that is flown: the photons' tables, read fast, for the wavelengths of a scene's lamps."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from auvdock.optics.halo import halo_of
from auvdock.optics.photons.table import photon_halo_of
from auvdock.optics.water import WaterCfg, load_water
from auvdock.optics.wells import wells_halo

READ = np.radians([0.02, 0.05, 0.2, 0.35, 1.0, 2.0, 5.0, 13.0, 40.0, 90.0])
RATIOS = (0.01, 0.05, 0.14, 0.6, 1.0, 5.0)


def water_of(ratio, b=0.2):
    a = ratio * b
    return WaterCfg("test", "test", (a, a, a), (b, b, b))


@settings(max_examples=60, deadline=None)
@given(st.floats(-7.0, math.log(59.9)), st.sampled_from(RATIOS))
def test_light_within_an_angle_is_the_photons(log_br, ratio):
    """Within 2 %, at whatever b r, as long as absorption leaves anything; radiance within 4 % then."""
    br = math.exp(log_br)
    if br * ratio > 40.0:
        return
    water = water_of(ratio)
    table, photons = halo_of(water), photon_halo_of(water)
    assert table.encircled(br, READ) == pytest.approx(photons.within(br, ratio, READ), rel=0.02)
    assert table.density(br, READ[:-1]) == pytest.approx(photons.radiance(br, ratio, READ[:-1]), rel=0.04)


@pytest.mark.parametrize("br", [0.3, 3.0, 12.0])
def test_density_is_the_derivative_of_encircled_light(br):
    table = halo_of(load_water("pool"))
    edges = np.geomspace(1e-4, 1.5, 40)
    rings = np.diff(table.encircled(br, edges))
    for ring, low, high in zip(rings, edges, edges[1:], strict=False):
        angle = np.linspace(low, high, 200)
        inside = float(np.trapezoid(table.density(br, angle) * 2.0 * math.pi * np.sin(angle), angle))
        assert ring == pytest.approx(inside, rel=0.03)


def test_each_wavelength_has_its_own_absorption_and_scattering():
    water = load_water("lake")
    table, photons = halo_of(water, (450.0, 530.0, 450.0)), photon_halo_of(water)
    assert table.first_row(450.0) != table.first_row(530.0)
    for nm in (450.0, 530.0):
        ratio = water.absorption_at(nm) / water.scattering_at(nm)
        read = table.encircled(4.0, READ, table.first_row(nm))
        assert read == pytest.approx(photons.within(4.0, ratio, READ), rel=0.02)
    assert halo_of(water, (450.0, 530.0)) is table


def test_beyond_the_table_the_last_reading_is_held():
    table = halo_of(load_water("pool"))
    assert np.array_equal(table.encircled(1e4, READ), table.encircled(60.0, READ))
    far, farther = halo_of(water_of(200.0, 0.05)), halo_of(water_of(1000.0, 0.05))
    assert np.array_equal(far.encircled(0.05, READ), farther.encircled(0.05, READ))
    thin, thinner = halo_of(water_of(0.01)), halo_of(water_of(0.001))
    assert thin.encircled(2.0, READ) == pytest.approx(thinner.encircled(2.0, READ))


def test_water_that_does_not_scatter_has_no_halo():
    table = halo_of(dataclasses.replace(load_water("pool"), scattering_per_m=(0.0, 0.0, 0.0)))
    assert np.all(table.scattered(np.zeros(3), 0) == 0.0)
    assert np.all(np.isfinite(table.density_rows(READ)))


def test_no_light_is_counted_from_behind_but_some_is_seen():
    """Radiance goes on beyond 90° without a step and falls; the whole is what lies within 90°."""
    table, angle = halo_of(load_water("pool")), np.radians([89.0, 91.0, 120.0, 150.0, 180.0])
    radiance = table.density(7.0, angle)
    assert radiance[1] == pytest.approx(radiance[0], rel=0.03)
    assert np.all(np.diff(radiance) < 0.0)
    assert radiance[-1] == pytest.approx(radiance[0] * 2.0 / math.pi, rel=0.03)
    assert table.encircled(7.0, np.array([math.pi])) == pytest.approx(table.scattered(np.array([7.0]), 0))


def test_median_angle_holds_half_of_the_light_and_grows_with_scattering():
    table, depths = halo_of(load_water("pool")), np.array([0.1, 1.0, 3.5, 7.0, 15.0])
    medians = table.median_rad(depths, 0)
    assert np.all(np.diff(medians) > 0.0)
    for br, median in zip(depths.tolist(), medians.tolist(), strict=True):
        assert table.encircled(br, np.array([median]))[0] == pytest.approx(
            0.5 * table.scattered(np.array([br]), 0)[0], rel=0.02
        )


def test_a_water_can_name_wells_model():
    water = dataclasses.replace(load_water("pool"), phase_function="wells", scattering_angle_rad=0.031)
    table, model = halo_of(water), wells_halo(0.031)
    for br in (0.5, 3.5, 15.0):
        expected = model.encircled(np.array([br]), READ)[0]
        assert table.encircled(br, READ) == pytest.approx(expected, rel=0.02)
    assert table.phase_per_sr(READ) == pytest.approx(model.phase(READ))
