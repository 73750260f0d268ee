import math
import pickle

import numpy as np
import pytest
from optics_scene import DEPTH_M, Scene, fixed_exposure, imager, one_lamp, pose, station_layout, wall_scene

from auvdock.core.errors import GraphicsError
from auvdock.optics import gl_driver
from auvdock.optics.nuisance import NuisanceCfg, nuisance_preset
from auvdock.optics.water import load_water
from auvdock.sim.mj import mujoco

SHOW = fixed_exposure(1e-3, surfaces=True, lamp_spill=0.0)
DAY = NuisanceCfg(daylight="severe")


def surfaces(unit):
    assert unit.surfaces is not None
    return unit.surfaces


def middle(unit, x):
    """Radiance per band in the middle of the view of a wall from a distance x."""
    image, _ = surfaces(unit).radiance(pose(x) @ unit.lit.camera.T_body_camera)
    rows, columns = image.shape[:2]
    return image[rows // 2, columns // 2].astype(np.float64)


@pytest.mark.render
@pytest.mark.parametrize("name", ["clear", "pool", "III"])
def test_a_surface_fades_as_the_model_says(name):
    water = load_water(name)
    unit = imager(one_lamp(), water, SHOW, DAY, wall_scene(30.0))
    try:
        veil = unit.lit.veil_w_m2_sr(DEPTH_M)
        beta_d, beta_b = water.attenuation, water.absorption + water.backscattering
        # The wall is vertical: light from above gives it the ambient half of its albedo.
        near = middle(unit, 1.0) - veil * (1.0 - np.exp(-beta_b))
        own = near * np.exp(beta_d)
        assert own == pytest.approx(0.5 / math.pi * unit.lit.daylight_w_m2(DEPTH_M), rel=0.02)
        for z in (2.0, 5.0, 10.0, 20.0):
            expected = own * np.exp(-beta_d * z) + veil * (1.0 - np.exp(-beta_b * z))
            assert middle(unit, z) == pytest.approx(expected, rel=0.01, abs=1e-4 * own.max())
    finally:
        unit.close()


@pytest.mark.render
def test_depth_is_metric_over_the_whole_view():
    unit = imager(one_lamp(), load_water("I"), SHOW, DAY, wall_scene(30.0))
    try:
        for z in (0.5, 3.0, 12.0, 40.0):
            _, depth = surfaces(unit).renderer.render(pose(z) @ unit.lit.camera.T_body_camera)
            assert float(np.abs(depth - z).max()) < 0.002 * z
    finally:
        unit.close()


@pytest.mark.render
def test_lens_distortion_bends_surfaces_as_it_bends_lights():
    # A small white box on the axis of a lamp's place: its image lies where the camera projects it.
    xml = f"""<mujoco><worldbody>
      <geom type="box" size="0.01 0.15 0.15" pos="0 2.6 {1.2 - DEPTH_M}" rgba="1 1 1 1"/>
    </worldbody></mujoco>"""
    scene = Scene(mujoco.MjModel.from_xml_string(xml))
    unit = imager(one_lamp(), load_water("I"), SHOW, NuisanceCfg(daylight="severe"), scene)
    try:
        body = pose(4.0)
        view = unit.lit.look(body, 0.0)
        with_box = unit.electrons(view, 1e-2).copy()[:, :, 1]
        unit.surfaces = None
        box = np.maximum(with_box - unit.electrons(view, 1e-2)[:, :, 1], 0.0)
        box[box < 0.3 * box.max()] = 0.0
        seen = np.array([box.sum(axis=0) @ np.arange(640), box.sum(axis=1) @ np.arange(360)]) / box.sum()
        camera = unit.lit.camera
        T_world_camera = body @ camera.T_body_camera
        place = (np.array([0.0, 2.6, 1.2 - DEPTH_M]) - T_world_camera[:3, 3]) @ T_world_camera[:3, :3]
        assert seen == pytest.approx(camera.project(place[None, :])[0], abs=1.0)
    finally:
        unit.close()


@pytest.mark.render
def test_the_vehicle_does_not_see_itself():
    scene = wall_scene(5.0)
    unit = imager(one_lamp(), load_water("clear"), SHOW, DAY, scene)
    try:
        colour, _ = surfaces(unit).renderer.render(pose(5.0) @ unit.lit.camera.T_body_camera)
        # The body at the camera's place is a red sphere around it; the wall is white.
        assert int(np.ptp(colour.astype(int), axis=2).max()) <= 2
    finally:
        unit.close()


@pytest.mark.render
def test_close_and_pickle_leave_no_context_behind():
    unit = imager(station_layout(), load_water("clear"), SHOW, DAY, wall_scene(5.0))
    unit.reset(np.random.default_rng(2))
    first = unit.capture(pose(5.0), 0.0).image
    copy = pickle.loads(pickle.dumps(unit))
    unit.close()
    unit.close()
    copy.reset(np.random.default_rng(2))
    assert np.array_equal(copy.capture(pose(5.0), 0.0).image, first)
    copy.close()
    unit.reset(np.random.default_rng(2))
    assert np.array_equal(unit.capture(pose(5.0), 0.0).image, first)
    unit.close()


def test_nothing_is_rendered_before_a_surface_can_be_seen(monkeypatch):
    def refuse(maker, width, height):
        raise RuntimeError("no display")

    monkeypatch.setattr(gl_driver, "_make", refuse)
    # Lake water at night: 60 m away nothing of the wall arrives.
    unit = imager(one_lamp(), load_water("lake"), SHOW, NuisanceCfg(), wall_scene(60.0))
    assert unit.capture(pose(60.0), 0.0).image.shape == (360, 640, 3)
    # By day at 2 m it does.
    bright = imager(one_lamp(), load_water("lake"), SHOW, nuisance_preset("severe"), wall_scene(2.0))
    with pytest.raises(GraphicsError) as caught:
        bright.capture(pose(2.0), 0.0)
    for part in ("libegl1", "libgl1-mesa-dri", "libosmesa6", "--fidelity beacons"):
        assert part in str(caught.value)


def test_distance_to_surfaces():
    unit = imager(one_lamp(), load_water("clear"), SHOW, DAY, wall_scene(5.0))
    distance = surfaces(unit).geoms.distance_m
    assert distance(np.array([7.0, 0.0, -DEPTH_M])) == pytest.approx([7.0])
    assert distance(np.array([3.0, 74.0, -DEPTH_M])) == pytest.approx([5.0])
    assert distance(np.array([-0.05, 1.0, -DEPTH_M])) == pytest.approx([0.0])
