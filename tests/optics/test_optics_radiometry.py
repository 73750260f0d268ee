import dataclasses
import math

import numpy as np
import pytest
from optics_scene import DEPTH_M, camera, one_lamp, pose, station_layout

from auvdock.core.beacons import BeaconLayout
from auvdock.core.transforms import invert
from auvdock.optics.lens import Lens
from auvdock.optics.light import beam_profile, peak_intensity_w_sr
from auvdock.optics.photons.table import photon_halo_of
from auvdock.optics.radiometry import LightSet
from auvdock.optics.settings import ImagingCfg
from auvdock.optics.water import WaterCfg, load_water

LENS = Lens(camera(), ImagingCfg())
UP = np.array([0.0, 0.0, DEPTH_M])
LOOKING = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def seen_from(layout, water, x, y=0.0, z=0.0):
    T_station_camera = np.eye(4)
    T_station_camera[:3, :3] = LOOKING
    T_station_camera[:3, 3] = (x, y, z)
    return LightSet(layout, water).arrive(T_station_camera, LENS.projection)


@pytest.mark.parametrize("angle_deg", [5.0, 20.0, 45.0, 120.0, 360.0])
def test_beam_integrates_to_the_flux(angle_deg):
    lamp = dataclasses.replace(one_lamp().beacons[-1], beam_angle_deg=angle_deg)
    polar = np.linspace(0.0, math.pi, 200001)
    ring = beam_profile(polar, angle_deg) * 2.0 * math.pi * np.sin(polar)
    flux = peak_intensity_w_sr(lamp) * float(np.trapezoid(ring, polar))
    assert flux == pytest.approx(lamp.power_w * lamp.efficiency, rel=1e-4)


@pytest.mark.parametrize("angle_deg", [10.0, 45.0, 90.0])
def test_intensity_is_halved_at_half_the_beam_angle(angle_deg):
    assert float(beam_profile(np.array([math.radians(angle_deg) / 2.0]), angle_deg)[0]) == pytest.approx(0.5)


def test_core_falls_as_the_closed_form_without_scattering():
    water = WaterCfg("absorbing", "test", (0.1, 0.2, 0.4), (0.0, 0.0, 0.0))
    peak = peak_intensity_w_sr(one_lamp().beacons[-1])
    for r in (1.0, 5.0, 20.0, 45.0):
        arrivals = seen_from(one_lamp(), water, r)
        assert arrivals["core_w_m2"][-1] == pytest.approx(peak * math.exp(-0.1 * r) / r**2, rel=1e-9)
        assert arrivals["halo_w_m2"][-1] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("r", [1.0, 8.0, 30.0, 60.0])
def test_core_and_halo_hold_what_photons_say(r):
    water = load_water("pool")
    arrivals = seen_from(one_lamp(), water, r)
    peak = peak_intensity_w_sr(one_lamp().beacons[-1])
    assert arrivals["core_w_m2"][-1] == pytest.approx(peak * math.exp(-0.40 * r) / r**2, rel=1e-9)
    halo = photon_halo_of(water).within(0.35 * r, 0.05 / 0.35, np.array([math.pi / 2.0]))[0]
    assert arrivals["halo_w_m2"][-1] == pytest.approx(peak * math.exp(-0.05 * r) / r**2 * halo, rel=0.01)


@pytest.mark.parametrize("name", ["II", "lake"])
def test_little_is_scattered_on_a_short_way(name):
    """Core and halo together are what absorption leaves, but for longer ways and what is scattered back."""
    water = load_water(name)
    a, b = water.absorption_per_m[0], water.scattering_per_m[0]
    r = 0.05 / b
    arrivals = seen_from(one_lamp(), water, r)
    total = arrivals["core_w_m2"][-1] + arrivals["halo_w_m2"][-1]
    peak = peak_intensity_w_sr(one_lamp().beacons[-1])
    assert total == pytest.approx(peak * math.exp(-a * r) / r**2, rel=0.01)


def test_each_lamp_has_the_halo_of_its_colour():
    water = load_water("pool")
    for nm in (450.0, 530.0, 620.0):
        a, b = water.absorption_at(nm), water.scattering_at(nm)
        other = dataclasses.replace(one_lamp(nm).beacons[-1], name="other")
        lamps = BeaconLayout((*one_lamp(620.0).beacons, other))
        arrivals = seen_from(lamps, water, 12.0)
        halo = photon_halo_of(water).within(12.0 * b, a / b, np.array([math.pi / 2.0]))[0]
        share = arrivals["halo_w_m2"][-1] / arrivals["core_w_m2"][-1]
        assert share == pytest.approx(halo * math.exp(12.0 * b), rel=0.01)


@pytest.mark.parametrize("name", ["I", "IB", "II", "III", "clear", "pool", "lake"])
def test_red_fades_before_blue(name):
    water = load_water(name)

    def loss(nm):
        near, far = (seen_from(one_lamp(nm), water, r) for r in (3.0, 25.0))
        return (far["core_w_m2"][-1] + far["halo_w_m2"][-1]) / (near["core_w_m2"][-1] + near["halo_w_m2"][-1])

    assert loss(620.0) < loss(450.0)


def test_off_axis_light_follows_the_beam():
    water = load_water("clear")
    r = 10.0
    angle = math.radians(20.0)
    ahead = seen_from(one_lamp(), water, r)
    aside = seen_from(one_lamp(), water, r * math.cos(angle), r * math.sin(angle))
    ratio = aside["core_w_m2"][-1] / ahead["core_w_m2"][-1]
    assert ratio == pytest.approx(float(beam_profile(np.array([angle]), 60.0)[0]), rel=1e-6)


def test_entrance_lamps_hide_behind_the_funnel():
    layout = station_layout()
    red = list(layout.indices("entrance"))
    water = load_water("clear")
    # Lamps 1.13 m behind a mouth of 1 m radius: the line to (0.5, 3) crosses the mouth's plane outside the rim.
    aside = seen_from(layout, water, 0.5, 3.0)
    assert np.all(aside["core_w_m2"][red] == 0.0)
    assert np.all(aside["core_w_m2"][list(layout.indices("array"))] > 0.0)
    # From (3, 1) it crosses well within, and from inside the funnel nothing is in between.
    for place in ((3.0, 1.0), (10.0, 3.0), (-0.5, 0.2)):
        assert np.all(seen_from(layout, water, *place)["core_w_m2"][red] > 0.0)


def test_directions_are_those_of_the_camera():
    T_station_body = invert(pose(0.0)) @ pose(0.0)
    assert np.allclose(T_station_body, np.eye(4))
    arrivals = seen_from(one_lamp(), load_water("clear"), 10.0, 2.0, 1.0)
    direction = LOOKING.T @ (np.array([-10.0, -2.0, -1.0]) / math.sqrt(105.0))
    assert arrivals["ray_camera"][-1] == pytest.approx(direction)
    assert arrivals["range_m"][-1] == pytest.approx(math.sqrt(105.0))
