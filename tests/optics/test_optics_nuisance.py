import dataclasses
import itertools

import numpy as np
import pytest
from optics_scene import T_WORLD_STATION, camera, imager, pose, station_layout

from auvdock.core.errors import ConfigError
from auvdock.optics.imaging import ImagingCfg
from auvdock.optics.nuisance import LEVELS, PARTS, NuisanceCfg, nuisance_preset, nuisance_streams
from auvdock.optics.scene import LitScene
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import load_water

SHOW = ImagingCfg(surfaces=False)


def scene(nuisance, seed=3, water="clear"):
    lit = LitScene(OpticalSetup(camera(), load_water(water), station_layout(), T_WORLD_STATION, SHOW, nuisance))
    lit.reset(np.random.default_rng(seed))
    return lit


def factors(nuisance, frames=5, seed=3):
    """(frames, 11) what fluctuations make of the station's lamps."""
    lit, still = scene(nuisance, seed), scene(NuisanceCfg())
    count = still.lights.count
    reference = still.look(pose(10.0), 0.0).arrivals["core_w_m2"]
    return np.array([lit.look(pose(10.0), k / 30).arrivals["core_w_m2"][:count] / reference for k in range(frames)])


def test_streams_do_not_depend_on_levels():
    sensor, parts = nuisance_streams(np.random.default_rng(1))
    again, others = nuisance_streams(np.random.default_rng(1))
    assert tuple(parts) == PARTS
    draws = [stream.random() for stream in (sensor, *parts.values())]
    assert draws == [stream.random() for stream in (again, *others.values())]
    assert len(set(draws)) == len(draws)


@pytest.mark.parametrize("part", [part for part in PARTS if part != "flicker"])
def test_other_parts_leave_flicker_alone(part):
    alone = factors(NuisanceCfg(flicker="mild"))
    together = factors(dataclasses.replace(NuisanceCfg(flicker="mild"), **{part: "mild"}))
    # A passing occlusion takes light, it does not redraw the scintillation.
    same = np.isclose(alone, together)
    assert same.mean() > 0.9
    assert np.all(together[~same] < alone[~same])


@pytest.mark.parametrize("part", ["marine_snow", "interfering_lights", "surface_reflection"])
def test_flicker_leaves_other_parts_alone(part):
    base = dataclasses.replace(NuisanceCfg(), **{part: "severe"})
    one, two = scene(base), scene(dataclasses.replace(base, flicker="severe"))
    assert np.array_equal(one.lights.lamps["place_m"][:11], two.lights.lamps["place_m"][:11])
    extra = slice(11, one.lights.count)
    assert np.array_equal(one.lights.lamps["place_m"][extra], two.lights.lamps["place_m"][extra])
    assert np.array_equal(one.snow.places_m, two.snow.places_m)


def test_scintillation_grows_with_the_level():
    spread = [np.log(factors(NuisanceCfg(flicker=level), 150)).std() for level in ("mild",)]
    spread.append(float(np.std(np.log(np.maximum(factors(NuisanceCfg(flicker="severe"), 150), 1e-3)))))
    assert spread[0] == pytest.approx(0.08, rel=0.35)
    assert spread[1] > 3.0 * spread[0]


def test_none_changes_nothing():
    assert factors(NuisanceCfg()) == pytest.approx(np.ones((5, 11)))


def test_interfering_lights_are_seen():
    lit = scene(NuisanceCfg(interfering_lights="severe"))
    view = lit.look(pose(15.0), 0.0)
    assert lit.lights.count == 11 + 4
    assert np.all(view.arrivals["core_w_m2"][11:] > 0.0)
    # None of them sits in the mouth, where it would pass for the station's.
    assert np.all(np.hypot(*lit.lights.lamps["place_m"][11:, 1:].T) > 1.2)


def test_reflections_are_mirror_images():
    lit = scene(NuisanceCfg(surface_reflection="severe"))
    station = lit.lights.lamps["place_m"][:7]
    images = lit.lights.lamps["place_m"][11:]
    assert images[:, :2] == pytest.approx(station[:, :2])
    # Both are equally far from the surface, which is 8 m above the mouth's centre.
    assert images[:, 2] - 8.0 == pytest.approx(8.0 - station[:, 2])
    arrivals = lit.look(pose(15.0), 0.0).arrivals
    assert np.all(arrivals["ray_camera"][11:, 1] < 0.0)
    assert 0.0 < arrivals["core_w_m2"][11:].max() < arrivals["core_w_m2"][:7].max()


def test_daylight_fades_with_depth_and_lifts_the_image():
    lit = scene(NuisanceCfg(daylight="severe"))
    shallow, deep = lit.daylight_w_m2(1.0), lit.daylight_w_m2(11.0)
    assert deep == pytest.approx(shallow * np.exp(-10.0 * load_water("clear").diffuse_attenuation))
    levels = []
    for level in LEVELS:
        unit = imager(nuisance=NuisanceCfg(daylight=level), cfg=dataclasses.replace(SHOW, noise=False))
        levels.append(float(unit.electrons(unit.lit.look(pose(25.0), 0.0), 1e-3)[5, 5].sum()))
    assert all(low < high for low, high in itertools.pairwise(levels))


def test_snow_is_more_with_the_level_and_fixed_in_the_water():
    counts = []
    for level in ("mild", "moderate", "severe"):
        flakes = scene(NuisanceCfg(marine_snow=level)).look(pose(8.0), 0.0).flakes
        counts.append(0 if flakes is None else len(flakes.pixels))
    assert counts[0] < counts[1] <= counts[2]
    lit = scene(NuisanceCfg(marine_snow="moderate"))
    first, second = (lit.look(pose(8.0), t).flakes for t in (0.0, 0.033))
    assert first is not None
    assert second is not None
    assert np.array_equal(first.pixels, second.pixels)


def test_same_seed_same_frames():
    images = []
    for seed in (4, 4, 5):
        unit = imager(nuisance=nuisance_preset("severe"), cfg=SHOW)
        unit.reset(np.random.default_rng(seed))
        images.append([unit.capture(pose(9.0), k / 30).image for k in range(3)])
    assert all(np.array_equal(a, b) for a, b in zip(images[0], images[1], strict=True))
    assert not np.array_equal(images[0][1], images[2][1])


def test_unknown_levels_are_refused():
    with pytest.raises(ConfigError, match=r"^flicker: "):
        dataclasses.replace(NuisanceCfg(), flicker="wild")
    with pytest.raises(ConfigError, match="moderate"):
        nuisance_preset("wild")
    assert nuisance_preset("none") == NuisanceCfg()
