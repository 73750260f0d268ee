"""The planner's radiometry is the renderer's, many poses at a time; the closed form of a lone lamp; detectability."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from auvdock.core.beacons import BeaconLayout, ring_layout
from auvdock.core.camera import CameraCfg
from auvdock.core.errors import ConfigError
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import make_transform, rotation_looking_along
from auvdock.optics.detection_model import load_detection_model
from auvdock.optics.lens import Lens
from auvdock.optics.radiometry import LightSet
from auvdock.optics.settings import ExposureCfg, ImagingCfg
from auvdock.optics.water import WaterCfg, load_water
from auvdock.perception.threshold import ThresholdCfg
from auvdock.planning.detectability import Detectability
from auvdock.planning.region import PlanCfg, forward_camera, guidance_space, make_detectability
from auvdock.planning.sight import SMOOTHING_PX2, Sight
from auvdock.planning.voxels import fill_region

UP = np.array([0.0, 0.0, 1.0])


def places(count, rng):
    return rng.uniform((0.5, -6.0, -3.0), (15.0, 6.0, 5.0), (count, 3))


@pytest.mark.parametrize("water", ["pool", "lake"])
def test_irradiance_and_pixels_equal_those_of_one_pose_at_a_time(water):
    layout = load_conical_station().layout
    lights = LightSet(layout, load_water(water))
    camera = forward_camera(CameraCfg())
    sight = Sight(camera, load_water(water), layout, ImagingCfg())
    points = places(40, np.random.default_rng(3))
    many = np.array(sight.look(points)).reshape(len(points), lights.count)
    lens = Lens(camera, ImagingCfg())
    for index, point in enumerate(points):
        rotation = rotation_looking_along(sight.target_m - point, UP)
        one = lights.arrive(make_transform(rotation, point), lens.projection)
        for name in ("core_w_m2", "halo_w_m2", "range_m", "ray_camera"):
            np.testing.assert_allclose(many[index][name], one[name], rtol=1e-9, atol=1e-12)
        shown = one["inside"]
        np.testing.assert_array_equal(many[index]["inside"], shown)
        np.testing.assert_allclose(many[index]["pixel"][shown], one["pixel"][shown], atol=1e-9)


def lone_isotropic_lamp(imaging, absorption):
    """Four lamps of which three are out, and the first shines evenly in all directions; water does not scatter."""
    water = WaterCfg("test", "closed form", (absorption,) * 3, (0.0, 0.0, 0.0))
    ring = ring_layout(4, 0.01, beam_angle_deg=360.0)
    dark = [dataclasses.replace(lamp, power_w=1e-12) for lamp in ring[1:]]
    lamp = dataclasses.replace(ring[0], position_m=(0.0, 0.0, 0.0))
    layout = BeaconLayout((lamp, *dark))
    sight = Sight(forward_camera(CameraCfg()), water, layout, imaging)
    sight.lights.lamps["minus_profile"] = 0.0
    sight.lights.lamps["peak_w_sr"] = sight.lights.lamps["flux_w"] / (4.0 * math.pi)
    sight.target_m = np.zeros(3)
    return sight


@pytest.mark.parametrize("absorption", [0.0, 0.3])
def test_one_isotropic_lamp_in_water_that_does_not_scatter_gives_the_sphere(absorption):
    exposure = ExposureCfg(automatic=False, initial_s=2e-5)
    imaging = ImagingCfg(exposure=exposure, lamp_radius_m=0.0)
    sight = lone_isotropic_lamp(imaging, absorption)
    threshold = ThresholdCfg()
    sees = Detectability(sight, load_detection_model("threshold"), threshold)
    # In closed form: Φ e^{-a r} / (4π r²) spread over the spot gives the threshold code at its centre.
    floor_dn = max(threshold.min_contrast, threshold.noise_factor * 0.5)
    root = math.sqrt(imaging.full_well_e + imaging.read_noise_e**2) - imaging.read_noise_e
    electrons = (floor_dn / 255.0 * root + imaging.read_noise_e) ** 2 - imaging.read_noise_e**2
    sigma2 = imaging.lens_sigma_px**2 + SMOOTHING_PX2
    centre = math.exp(-0.5 * float(sight.spots.radii_px[0]) ** 2 / sigma2) / (2.0 * math.pi * sigma2)
    per_irradiance = float(sight.channel[0, 2]) * exposure.initial_s * centre
    intensity = float(sight.lights.lamps["flux_w"][0]) / (4.0 * math.pi)

    def excess(r):
        return intensity * math.exp(-absorption * r) / r**2 * per_irradiance - electrons

    radius = float(np.asarray(brentq(excess, 0.01, 500.0)))
    box = 1.1 * radius * np.ones(3)
    region = fill_region(lambda points: sees.seen(points, 1), -box, box, radius / 20.0)
    assert region.volume_m3 == pytest.approx(4.0 / 3.0 * math.pi * radius**3, rel=0.01)


@pytest.mark.parametrize("water", ["pool", "lake"])
def test_halving_the_voxel_changes_the_volume_by_less_than_one_percent(water):
    layout = load_conical_station().layout
    sees = make_detectability(layout, PlanCfg(water=water))
    coarse = guidance_space(layout, PlanCfg(water=water, resolution=28), sees)
    fine = guidance_space(layout, PlanCfg(water=water, resolution=56), sees)
    assert fine.volume_m3 == pytest.approx(coarse.volume_m3, rel=0.01)
    assert fine.region is not None
    assert abs(fine.volume_m3 - coarse.volume_m3) <= 5.0 * coarse.error_m3 + 0.01 * fine.volume_m3


def test_turbid_water_and_a_higher_demand_shrink_the_region():
    layout = load_conical_station().layout
    volumes = [
        guidance_space(layout, PlanCfg("pool", c, min_lights=needed, resolution=24)).volume_m3
        for c, needed in ((0.3, 4), (0.6, 4), (0.6, 6))
    ]
    assert volumes[0] > volumes[1] > volumes[2] > 0.0


def test_mirror_symmetric_station_gives_a_mirror_symmetric_answer():
    sees = make_detectability(load_conical_station().layout, PlanCfg())
    points = places(300, np.random.default_rng(5))
    left = sees.sighting(points * np.array([1.0, -1.0, 1.0])).count
    right = sees.sighting(points).count
    assert np.count_nonzero(left != right) <= 0.01 * len(points)


def test_lights_off_the_sensor_are_not_found():
    sees = make_detectability(load_conical_station().layout, PlanCfg())
    near = sees.sighting(np.array([[0.3, 0.0, 0.0]]))
    assert near.count[0] == 0


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"min_lights": 0}, "min_lights"), ({"resolution": 4}, "resolution"), ({"water": "tea"}, "pool")],
)
def test_refuses_settings_without_a_region(settings, words):
    with pytest.raises(ConfigError, match=words):
        make_detectability(load_conical_station().layout, PlanCfg(**settings))


def test_refuses_more_lights_than_there_are():
    with pytest.raises(ConfigError, match="at most 6"):
        make_detectability(load_conical_station().layout, PlanCfg(min_lights=7))
