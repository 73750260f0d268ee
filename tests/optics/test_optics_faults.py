import dataclasses

import numpy as np
import pytest
from landing_scene import STATION, above, belly_camera, fixed, landing_camera

from auvdock.core.beacons import BeaconLayout
from auvdock.core.errors import ConfigError
from auvdock.core.strict import from_mapping
from auvdock.optics.faults import FaultCfg, TagCover, dead_indices
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.lens import Lens
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.radiometry import LightSet
from auvdock.optics.water import load_water


def test_nothing_is_broken_by_default():
    cover = TagCover(FaultCfg())
    assert not any(cover.hidden(h, t) for h in (0.0, 1.0, 5.0) for t in (0.0, 10.0))
    assert len(dead_indices(STATION.layout, ())) == 0


def test_dead_lights_are_dark_and_the_others_as_before():
    alive, broken = landing_camera(fixed(1e-3)), landing_camera(fixed(1e-3), faults=FaultCfg(dead_lights=("B1", "B3")))
    body = above(4.0, 0.2, -0.1, 10.0)
    full, part = alive.lit.look(body, 0.0).arrivals, broken.lit.look(body, 0.0).arrivals
    shine = np.array([True, False, True, False, True])
    assert np.all(part["core_w_m2"][~shine] == 0.0)
    assert np.all(part["halo_w_m2"][~shine] == 0.0)
    assert np.array_equal(part["core_w_m2"][shine], full["core_w_m2"][shine])
    assert broken.tag is not None
    assert np.all(broken.tag.scene.light.spill_w_sr[~shine] == 0.0)


def test_unknown_lights_and_times_are_refused():
    with pytest.raises(ConfigError, match="B9"):
        landing_camera(faults=FaultCfg(dead_lights=("B9",)))
    for change in ({"tag_hidden_from_s": -1.0}, {"tag_hidden_for_s": -1.0}, {"tag_hidden_below_m": -0.5}):
        with pytest.raises(ConfigError):
            from_mapping(FaultCfg, change)


def test_no_landing_light_hides_behind_the_others():
    water = load_water("clear")
    tail = dataclasses.replace(STATION.beacons[0], name="B5", position_m=(-0.75, 0.0, 0.0))
    layout = BeaconLayout((*STATION.beacons, tail))
    lights = LightSet(layout, water, funnel=False)
    lens = Lens(belly_camera(), landing_imaging()).projection
    pose = np.eye(4)
    rng = np.random.default_rng(0)
    for place in rng.uniform((-2.0, -2.0, 0.5), (2.0, 2.0, 6.0), (50, 3)):
        pose[:3, 3] = place
        assert np.all(lights.arrive(pose, lens)["core_w_m2"] > 0.0)
    # Taken for a funnel along x, the lamp at the tail would hide.
    pose[:3, 3] = (1.5, 0.0, 3.0)
    assert np.any(LightSet(layout, water).arrive(pose, lens)["core_w_m2"] == 0.0)


def test_strangers_lie_beside_the_platform_and_shine_up():
    unit = landing_camera(fixed(1e-3), nuisance=NuisanceCfg(interfering_lights="severe"))
    for seed in range(10):
        unit.reset(np.random.default_rng(seed))
        lights = unit.lit.lights
        assert lights.count == lights.station_count + 4
        places = lights.lamps["place_m"][lights.station_count :]
        assert np.all(np.hypot(places[:, 0], places[:, 1]) >= 1.5)
        assert np.allclose(lights.lamps["axis"][lights.station_count :], (0.0, 0.0, 1.0))


def test_mirror_images_of_a_dead_light_are_dark():
    faults = FaultCfg(dead_lights=("B0",))
    unit = landing_camera(fixed(1e-3), faults=faults, nuisance=NuisanceCfg(surface_reflection="severe"))
    arrivals = unit.lit.look(above(3.0, roll_deg=180.0), 0.0).arrivals
    assert len(arrivals["core_w_m2"]) == 10
    assert arrivals["core_w_m2"][0] == 0.0
    assert arrivals["core_w_m2"][5] == 0.0
    assert np.all(arrivals["core_w_m2"][6:] > 0.0)
