"""Light of the rotating beacon: where it goes, how it falls off, what is drawn of it."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from optics_scene import DEPTH_M, T_WORLD_STATION, camera, far_ring

from auvdock.core.beacons import BeaconLayout
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import make_transform
from auvdock.optics.beam_image import BeamImage
from auvdock.optics.beam_spread import beam_spread
from auvdock.optics.imaging import ExposureCfg, ImagingCfg, UnderwaterCamera
from auvdock.optics.light import beam_profile, profile_solid_angle_sr
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.phase_function import fournier_forand
from auvdock.optics.photons.phase import load_phase
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import WaterCfg, load_water

BEACON = RotatingBeaconCfg(position_m=(0.0, 0.0, 0.0))
POOL = load_water("pool")
NO_SCATTERING = WaterCfg("absorbing", "test", (0.05, 0.05, 0.05), (0.0, 0.0, 0.0))


def eye(water=POOL, exposure_s=1e-3, beacon=BEACON, nuisance=None):
    fixed = ExposureCfg(automatic=False, initial_s=exposure_s, max_s=max(exposure_s, 0.016))
    cfg = ImagingCfg(noise=False, surfaces=False, exposure=fixed)
    seen = BeaconLayout(far_ring())
    setup = OpticalSetup(camera(320, 180), water, seen, T_WORLD_STATION, cfg, nuisance or NuisanceCfg(), beacon)
    return UnderwaterCamera(setup)


def place(range_m, bearing_rad=0.0, up_m=0.0):
    """A camera at a bearing from the beacon that looks straight at its axis of rotation."""
    angle = bearing_rad + math.pi
    c, s = math.cos(angle), math.sin(angle)
    position = np.array([range_m * math.cos(bearing_rad), range_m * math.sin(bearing_rad), up_m - DEPTH_M])
    return make_transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), position)


def off(degrees, bearing_rad=0.0):
    """Station time at which the beam's azimuth is so many degrees beyond a bearing."""
    return (math.degrees(bearing_rad) + degrees) / 360.0 / BEACON.rate_rev_s


def lamp_of(unit):
    """Index of the rotating beacon's lamp."""
    assert unit.lit.rotating is not None
    return unit.lit.rotating.lamp


def beam_of(unit, range_m, degrees):
    beam = unit.lit.look(place(range_m), off(degrees)).beam
    assert beam is not None
    return beam


def streak(unit, range_m, degrees):
    """(h, w) electrons of the beam beside its lamp."""
    image = np.zeros((*unit.lit.lens.shape, 3), dtype=np.float32)
    lit = unit.lit
    BeamImage(lit.lens, lit.lights, lamp_of(unit)).add(image, beam_of(unit, range_m, degrees), 1.0)
    return image[:, :, 2].astype(float)


def test_core_is_the_profile_times_beer_lambert():
    unit = eye()
    for range_m, degrees in ((5.0, 0.0), (5.0, 4.0), (12.0, -7.0)):
        arrivals = unit.lit.look(place(range_m, 0.4), off(degrees, 0.4)).arrivals
        lamp = lamp_of(unit)
        peak = 30.0 * 0.35 / profile_solid_angle_sr(10.0)
        share = float(beam_profile(np.array(math.radians(degrees)), 10.0))
        expected = peak * share * math.exp(-0.40 * range_m) / range_m**2
        assert arrivals["core_w_m2"][lamp] == pytest.approx(expected, rel=1e-9)


def test_scattered_light_is_seen_off_the_axis_and_only_with_scattering():
    lamp = lamp_of(eye())
    unit, total = eye(), []
    for degrees in (0.0, 10.0, 20.0, 60.0):
        halo = unit.lit.look(place(20.0), off(degrees)).arrivals["halo_w_m2"][lamp]
        total.append(float(halo + beam_of(unit, 20.0, degrees).light_w_m2.sum()))
    assert all(one > 2.0 * other > 0.0 for one, other in itertools.pairwise(total))
    clear = eye(NO_SCATTERING)
    assert clear.lit.look(place(20.0), off(20.0)).arrivals["halo_w_m2"][lamp] == 0.0
    assert beam_of(clear, 20.0, 20.0).light_w_m2.max() == 0.0


def test_beam_turns_counter_clockwise():
    unit = eye()
    lamp = lamp_of(unit)
    times = np.arange(0.0, 2.0, 0.02)
    for bearing in (1.2, -2.5, math.pi):
        halo = [unit.lit.look(place(15.0, bearing), float(t)).arrivals["halo_w_m2"][lamp] for t in times]
        assert math.remainder(BEACON.azimuth_rad(times[np.argmax(halo)]) - bearing, math.tau) == pytest.approx(
            0.0, abs=math.radians(2.0)
        )


def test_station_time_turns_the_beam_and_vehicle_time_stamps_the_frame():
    unit = eye()
    frame = unit.capture(place(15.0), 7.3, station_time_s=0.0)
    assert frame.time_s == 7.3
    assert np.array_equal(frame.image, eye().capture(place(15.0), 0.0).image)


def test_streak_points_where_the_beam_goes():
    unit = eye()
    columns = np.arange(unit.lit.lens.shape[1])
    middle = (len(columns) - 1) / 2.0
    right, left = (streak(unit, 8.0, sign * 60.0) for sign in (1.0, -1.0))
    # A beam that has turned past the camera, to +y, goes to the right as the camera sees it.
    assert right.sum(axis=0) @ columns / right.sum() > middle + 5.0
    assert left == pytest.approx(right[:, ::-1], rel=0.02, abs=1e-3 * right.max())
    assert right == pytest.approx(right[::-1], rel=0.02, abs=1e-3 * right.max())


def test_streak_fades_with_distance_and_along_itself():
    unit = eye()
    near, far = streak(unit, 6.0, 90.0), streak(unit, 18.0, 90.0)
    # The whole decays at least with absorption and the distance (a line source: 1 / r).
    assert far.sum() < near.sum() / 3.0 * math.exp(-0.05 * 12.0)
    row = near[near.shape[0] // 2, near.shape[1] // 2 + 4 :]
    assert row[0] > row[len(row) // 2] > row[-1] > 0.0
    assert streak(eye(NO_SCATTERING), 6.0, 90.0).max() == 0.0


def test_image_holds_the_light_of_the_pieces():
    """Electrons on the sensor of a beam far from the border: the light of its pieces that lie within the image."""
    unit = eye()
    beam = beam_of(unit, 4.0, 150.0)
    image = streak(unit, 4.0, 150.0)
    factor2 = unit.lit.lens.factor**2
    inside = np.abs(beam.rays_camera[:, 0] / beam.rays_camera[:, 2]) < math.tan(math.radians(40.0))
    channel = unit.lit.lights.lamps["electrons_per_j"][lamp_of(unit), 2] * unit.lit.lens.aperture_m2
    expected = channel * float(beam.light_w_m2[inside].sum())
    assert image.sum() * factor2 == pytest.approx(expected, rel=0.15)


def test_facing_beam_is_round_and_one_beside_is_long():
    unit = eye()
    facing, beside = (unit.electrons(unit.lit.look(place(20.0), off(d)), 1.0)[:, :, 2].astype(float) for d in (0, 15))

    def aspect(image):
        """Height over width of the part brighter than a third of the peak."""
        lit = image > image.max() / 3.0
        return np.ptp(np.flatnonzero(lit.any(axis=1))) / np.ptp(np.flatnonzero(lit.any(axis=0)))

    assert aspect(facing) == pytest.approx(1.0, abs=0.15)
    assert aspect(beside) < 0.8


@pytest.mark.parametrize("range_m", [10.0, 25.0, 45.0])
def test_no_direction_outshines_the_facing_one(range_m):
    """The image's peak falls from the facing beam on, whatever part of the light is drawn as lamp or as beam."""
    unit = eye()
    views = [unit.lit.look(place(range_m), off(degrees)) for degrees in (0.0, 2.0, 4.0, 8.0, 16.0)]
    peaks = [float(unit.electrons(view, 1.0).max()) for view in views]
    assert np.all(np.diff(peaks) < 0.0)


def test_long_exposure_averages_the_turn():
    """The mean over the exposure of the light at many instants, to 1 % at the default rate and 16 ms."""
    unit = eye()
    lamp = lamp_of(unit)
    for degrees in (0.0, 6.0):
        middle = off(degrees)
        arrivals = unit.lit.look(place(15.0), middle, exposure_s=0.016).arrivals
        instants = middle + 0.016 * (np.arange(40) + 0.5 - 20.0) / 40.0
        each = [unit.lit.look(place(15.0), float(t)).arrivals["core_w_m2"][lamp] for t in instants]
        assert arrivals["core_w_m2"][lamp] == pytest.approx(np.mean(each), rel=0.01)


def test_mirror_image_shines_when_the_beacon_does():
    nuisance = NuisanceCfg(surface_reflection="severe")
    unit = eye(nuisance=nuisance)
    lamp, image = lamp_of(unit), unit.lit.lights.count - 1
    facing = unit.lit.look(place(25.0), off(0.0)).arrivals
    aside = unit.lit.look(place(25.0), off(60.0)).arrivals
    assert facing["halo_w_m2"][lamp] > 30.0 * aside["halo_w_m2"][lamp] > 0.0
    # The image's light leaves the beam at atan(16 / 25) = 33° when it faces the camera, at 65° when it does not.
    assert facing["halo_w_m2"][image] > 3.0 * aside["halo_w_m2"][image] > 0.0
    assert facing["halo_w_m2"][image] < 0.1 * facing["halo_w_m2"][lamp]


def test_elevation_lifts_the_beam():
    tilted = dataclasses.replace(BEACON, elevation_deg=20.0)
    unit = eye(beacon=tilted)
    lamp = lamp_of(unit)
    up = 15.0 * math.tan(math.radians(20.0))
    high = unit.lit.look(place(15.0, up_m=up), 0.0).arrivals
    level = unit.lit.look(place(15.0), 0.0).arrivals
    assert high["core_w_m2"][lamp] > 10.0 * level["core_w_m2"][lamp]


def test_phase_function_is_normalised():
    angle = np.geomspace(1e-7, math.pi, 100_001)
    weight = 2.0 * math.pi * np.sin(angle)
    forand = fournier_forand(angle)
    assert np.trapezoid(forand * weight, angle) == pytest.approx(1.0, abs=2e-3)
    back = angle > math.pi / 2.0
    # Mobley et al. (2002): 1.83 % backscattering, Petzold's average.
    assert np.trapezoid((forand * weight)[back], angle[back]) == pytest.approx(0.0183, abs=2e-4)


@pytest.mark.parametrize("degrees", [0.0, 6.0, 30.0, 100.0])
def test_lamp_and_pieces_hold_the_beams_scattered_light(degrees):
    unit, r = eye(), 20.0
    view = unit.lit.look(place(r), off(degrees))
    assert view.beam is not None
    total = float(view.arrivals["halo_w_m2"][lamp_of(unit)] + view.beam.light_w_m2.sum())
    table, br = unit.lit.lights.halo, np.array([0.35 * r])
    share = beam_spread(table, 0, math.radians(5.0)).share(br, np.radians([degrees]))[0]
    peak = 30.0 * 0.35 / profile_solid_angle_sr(10.0)
    expected = peak * math.exp(-0.05 * r) / r**2 * table.scattered(br, 0)[0] * share
    assert total == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("degrees", [40.0, 90.0, 130.0])
def test_seen_from_the_side_light_comes_from_along_the_beam(degrees):
    """In thin water by single scattering: between φ1 and φ2 off the lamp ∫ p(θ + φ) e^{-a (s + d)} dφ."""
    thin, r = WaterCfg("thin", "test", (0.02, 0.02, 0.02), (0.01, 0.01, 0.01)), 6.0
    unit = eye(thin, beacon=dataclasses.replace(BEACON, divergence_deg=2.0))
    view = unit.lit.look(place(r), off(degrees))
    assert view.beam is not None
    theta = math.radians(degrees)
    phase, edge = load_phase("fournier-forand-0.018"), view.beam.edge_rad

    def between(first, last):
        phi = np.linspace(first, last, 2000)
        way = r * (np.sin(phi) + math.sin(theta)) / np.sin(theta + phi)
        return float(np.trapezoid(phase.density(theta + phi) * np.exp(-0.02 * way), phi))

    whole = between(0.0, float(edge[-1]))
    light = view.beam.light_w_m2
    total = float(light.sum() + view.arrivals["halo_w_m2"][lamp_of(unit)])
    for k in range(1, len(light)):
        assert light[k] / total == pytest.approx(between(float(edge[k]), float(edge[k + 1])) / whole, abs=0.02)
