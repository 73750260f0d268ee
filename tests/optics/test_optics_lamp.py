import itertools
import math

import numpy as np
import pytest
from landing_scene import above, belly_camera, fixed, landing_camera, platform_scene
from scipy.integrate import quad

from auvdock.core.errors import ConfigError
from auvdock.core.strict import from_mapping
from auvdock.optics.lamp import LampCfg, VehicleLamp
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.lens import Lens
from auvdock.optics.light import beam_profile, profile_solid_angle_sr
from auvdock.optics.water import WaterCfg, load_water

LENS = Lens(belly_camera(), landing_imaging())
CFG = LampCfg()
VACUUM = WaterCfg("nothing", "test", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def lamp(water, cfg=CFG):
    return VehicleLamp(cfg, LENS, load_water(water) if isinstance(water, str) else water)


def single_scattering(water, ray, upper_m, band):
    """The integral of the module's docstring by adaptive quadrature, written out anew."""
    flux = CFG.power_w * CFG.efficiency * CFG.band_shares[band]
    peak = flux / profile_solid_angle_sr(CFG.beam_angle_deg)
    bb = float(water.backscattering[band])
    loss = float(water.absorption[band]) + bb

    def source(s):
        total = 0.0
        for position in CFG.positions_m:
            offset = s * ray - np.array(position)
            d = max(float(np.linalg.norm(offset)), 0.03)
            angle = math.acos(min(max(offset[2] / d, -1.0), 1.0))
            profile = float(beam_profile(np.array([angle]), CFG.beam_angle_deg)[0])
            total += peak * profile / d**2 * math.exp(-loss * d)
        return total * math.exp(-loss * s) * bb / (2.0 * math.pi)

    return quad(source, 0.0, upper_m, limit=200, points=[0.1, min(0.5, 0.9 * upper_m)])[0]


@pytest.mark.parametrize("name", ["clear", "pool", "lake"])
@pytest.mark.parametrize("distance_m", [0.3, 1.0, 4.0])
def test_backscatter_table_is_the_integral(name, distance_m):
    water = load_water(name)
    unit = lamp(name)
    rows, columns = LENS.shape
    table = unit.backscatter(np.full((rows, columns), distance_m, dtype=np.float32))
    for row, column in ((0, 0), (rows // 2, columns // 2), (rows - 1, columns // 3)):
        ray = LENS.rays[row * columns + column]
        wanted = [single_scattering(water, ray, distance_m, band) for band in range(3)]
        assert unit.backscatter_at(ray[None, :], distance_m)[0] == pytest.approx(wanted, rel=2e-3)
        # The table interpolates over 40 depths and a grid of 32 px.
        assert table[row, column] == pytest.approx(wanted, rel=0.03)
        pixel = (np.array([[column, row]]) + 0.5) * LENS.factor - 0.5
        assert unit.backscatter_near(pixel, distance_m)[0] == pytest.approx(table[row, column], rel=1e-4)


def test_backscatter_vanishes_without_water_and_grows_with_scattering():
    assert float(lamp(VACUUM).backscatter().max()) == 0.0
    levels = []
    for b in (0.1, 0.3, 1.0, 3.0):
        water = WaterCfg("turbid", "test", (0.05, 0.06, 0.3), (b, b, b))
        levels.append(lamp(water).backscatter())
    for dim, bright in itertools.pairwise(levels):
        assert np.all(bright > dim)


def test_backscatter_grows_with_the_distance_of_what_ends_it_and_then_no_more():
    unit = lamp("pool")
    distances = np.geomspace(0.1, 30.0, 12)
    values = np.array([unit.backscatter_at(np.array([[0.0, 0.0, 1.0]]), d)[0, 0] for d in distances])
    assert np.all(np.diff(values) > 0.0)
    # Light dies with distance: five sixths of it come from the first 2 m.
    assert values[-1] < 1.2 * np.interp(2.0, distances, values)
    rows, columns = LENS.shape
    assert unit.backscatter()[rows // 2, columns // 2, 0] == pytest.approx(values[-1], rel=0.02)


def test_backscatter_is_symmetric_about_the_lamps():
    table = lamp("pool").backscatter()
    rays = LENS.rays.reshape(*LENS.shape, 3)
    row = int(np.argmin(np.abs(rays[:, 0, 1])))
    left, right = (int(np.argmin(np.abs(rays[row, :, 0] - x))) for x in (-0.2, 0.2))
    assert table[row, left] == pytest.approx(table[row, right], rel=0.03)


def test_irradiance_falls_with_the_square_and_follows_the_beam():
    cfg = LampCfg(positions_m=((0.0, 0.0, 0.0),))
    unit = lamp(VACUUM, cfg)
    near, far = unit.irradiance(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 3.0]]))
    assert near == pytest.approx(unit.peak_w_sr)
    assert near == pytest.approx(9.0 * far)
    half = math.radians(cfg.beam_angle_deg) / 2.0
    aside = unit.irradiance(np.array([[math.sin(half), 0.0, math.cos(half)]]))[0]
    assert aside == pytest.approx(0.5 * math.cos(half) * unit.peak_w_sr)
    assert unit.irradiance(np.zeros((0, 3))).shape == (0, 3)
    assert np.all(unit.irradiance(np.array([[0.0, 0.0, -1.0]])) == 0.0)


def test_irradiance_in_water_keeps_what_is_scattered_forwards():
    water = load_water("pool")
    unit = lamp(water, LampCfg(positions_m=((0.0, 0.0, 0.0),)))
    got = unit.irradiance(np.array([[0.0, 0.0, 2.0]]))[0]
    assert got == pytest.approx(unit.peak_w_sr / 4.0 * np.exp(-2.0 * (water.absorption + water.backscattering)))


def test_light_along_rays_is_the_irradiance():
    unit = lamp("lake")
    rays = LENS.rays
    distance = np.random.default_rng(4).uniform(0.3, 30.0, len(rays))
    light = np.ones((3, len(rays)), dtype=np.float32)
    unit.add_along(light, np.ascontiguousarray(rays.T, dtype=np.float32), distance.astype(np.float32))
    wanted = unit.irradiance(rays * distance[:, None])
    assert light.T - 1.0 == pytest.approx(wanted, rel=0.012, abs=2e-7)


def test_brightest_bounds_irradiance():
    unit = lamp("lake")
    rng = np.random.default_rng(3)
    points = rng.uniform((-1.0, -1.0, 0.1), (1.0, 1.0, 3.0), (200, 3))
    bound = unit.brightest(np.linalg.norm(points, axis=1))
    assert np.all(unit.irradiance(points) <= bound * (1.0 + 1e-9))


def test_no_lamp_and_no_power_are_the_same():
    dark = landing_camera(fixed(1e-3), "pool")
    off = landing_camera(fixed(1e-3), "pool", LampCfg(power_w=0.0))
    for unit in (dark, off):
        unit.reset(np.random.default_rng(0))
    assert np.array_equal(dark.capture(above(2.0), 0.0).image, off.capture(above(2.0), 0.0).image)


@pytest.mark.render
def test_surfaces_in_turbid_water_are_veiled_by_the_lamp():
    scene = platform_scene()
    images = {}
    for name in ("clear", "lake"):
        unit = landing_camera(fixed(4e-3, surfaces=True), name, CFG, scene=scene)
        try:
            view = unit.lit.look(above(1.5), 0.0)
            images[name] = unit.electrons(view, 4e-3).astype(np.float64)
            assert unit.surfaces is not None
            assert float(unit.surfaces.radiance(view.T_world_camera)[1].min()) > 1.0
            without = landing_camera(fixed(4e-3, surfaces=True), name, None, scene=scene)
            assert images[name].mean() > without.electrons(view, 4e-3).mean()
            without.close()
        finally:
            unit.close()
    # Contrast of tag white over black falls.
    tag = np.s_[240:330, 360:470, 1]
    contrast = {name: np.ptp(np.percentile(image[tag], (10, 90))) / image[tag].mean() for name, image in images.items()}
    assert contrast["lake"] < 0.75 * contrast["clear"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"power_w": -1.0}, "power_w"),
        ({"efficiency": 0.0}, "efficiency"),
        ({"beam_angle_deg": 180.0}, "beam_angle_deg"),
        ({"band_shares": [0.9, 0.9, 0.0]}, "band_shares"),
        ({"positions_m": []}, "positions_m"),
        ({"power": 3.0}, "power"),
    ],
)
def test_impossible_lamps_are_refused(change, field):
    with pytest.raises(ConfigError) as caught:
        from_mapping(LampCfg, change)
    assert caught.value.field == field
