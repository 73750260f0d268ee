"""Rendered frames against projections of the lamps and the picture without noise."""

import dataclasses
import math

import cv2
import numpy as np
import pytest
from dataset_scenes import small_cfg
from optics.optics_scene import QUIET, imager, one_lamp, pose, station_layout

from auvdock.core.camera import Camera
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import invert
from auvdock.dataset.conditions import KINDS, draw_condition, set_stage
from auvdock.dataset.labels import TAG
from auvdock.dataset.lights import Onlooker
from auvdock.dataset.plan import plan_scenes
from auvdock.dataset.render import render_scene
from auvdock.dataset.rules import LabelRules, label_lights
from auvdock.optics.imaging import UnderwaterCamera
from auvdock.optics.nuisance import nuisance_preset
from auvdock.optics.water import load_water, with_attenuation

RULES = LabelRules()


def labelled(camera, T_world_body, station_time_s=None, exposure_s=None):
    view = camera.lit.look(T_world_body, 0.0, station_time_s, 0.001)
    if exposure_s is None:
        camera.exposure.reset()
        exposure_s = camera.take(T_world_body, 0.0, station_time_s).exposure_s
    electrons = camera.electrons(view, exposure_s).copy()
    onlooker = Onlooker(camera, 0.5 * RULES.cap_px)
    lights = onlooker.lights(view, exposure_s)
    return label_lights(electrons, camera.lit.scale(1.0), lights, onlooker.radii_px, RULES), electrons, view


def projected(camera: Camera, T_world_body, points_world):
    to_camera = invert(T_world_body @ camera.T_body_camera)
    inside = points_world @ to_camera[:3, :3].T + to_camera[:3, 3]
    distortion = np.asarray(camera.distortion)
    pixels, _ = cv2.projectPoints(inside, np.zeros(3), np.zeros(3), camera.matrix, distortion)
    return pixels.reshape(-1, 2)


@pytest.mark.parametrize(
    ("x", "y", "yaw", "c_per_m"), [(6.0, 0.5, 0.1, 0.2), (14.0, -2.0, -0.2, 0.4), (9.0, 1.0, 0.0, 0.9)]
)
def test_centres_are_the_projected_lamps(x, y, yaw, c_per_m):
    layout = station_layout()
    camera = imager(layout, with_attenuation(load_water("clear"), c_per_m))
    body = pose(x, y, 0.3, yaw)
    labels, _, _ = labelled(camera, body)
    places = camera.lit.setup.T_world_station[:3, 3] + layout.positions_m
    pixels = dict(
        zip([beacon.name for beacon in layout.beacons], projected(camera.lit.camera, body, places), strict=True)
    )
    assert len(labels) >= 6
    for label in labels:
        assert label.centre_px == pytest.approx(pixels[label.lamps[0]], abs=0.05)
        assert label.range_m == pytest.approx(
            np.linalg.norm(body[:3, 3] - places[[b.name for b in layout.beacons].index(label.lamps[0])])
        )


def test_the_picture_is_brightest_at_the_centre_of_a_lone_light():
    camera = imager(one_lamp(), load_water("pool"))
    (label,), electrons, _ = labelled(camera, pose(12.0, 1.5, -0.4, 0.05), exposure_s=1e-3)
    v, u = np.unravel_index(np.argmax(electrons[:, :, 2]), electrons.shape[:2])
    assert np.hypot(u - label.centre_px[0], v - label.centre_px[1]) <= 1.0
    assert label.c_range == pytest.approx(float(camera.lit.water.attenuation[0]) * label.range_m)


@pytest.mark.parametrize("exposure_s", [1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize(("x", "c_per_m"), [(3.0, 0.2), (3.0, 1.5), (10.0, 0.4)])
def test_a_lone_light_that_shows_has_a_label_however_bright_it_is(x, c_per_m, exposure_s):
    camera = imager(one_lamp(), with_attenuation(load_water("clear"), c_per_m))
    labels, electrons, _ = labelled(camera, pose(x, 0.2, -0.1, 0.05), exposure_s=exposure_s)
    codes = np.minimum(camera.lit.scale(1.0).codes(electrons[:, :, 2].astype(float)), 255.0)
    # A disc burnt out over all of the picture has no centre to be found.
    if codes.max() > 30.0 and np.percentile(codes, 20) < 250.0:
        assert [label.ignored for label in labels] == [""]
    if codes.max() < 0.5:
        assert labels == []


@pytest.mark.parametrize("turned_deg", [0.0, 25.0, 70.0])
def test_a_turning_beams_label_lies_where_it_is_brightest(turned_deg):
    beacon = RotatingBeaconCfg()
    bare = imager(one_lamp(power_w=1e-9), load_water("pool"))
    setup = dataclasses.replace(bare.lit.setup, rotating=beacon)
    camera = UnderwaterCamera(setup)
    station_s = math.radians(turned_deg) / math.tau / beacon.rate_rev_s
    labels, electrons, _ = labelled(camera, pose(15.0, 0.0, 1.0), station_s, exposure_s=16e-3 if turned_deg else 1e-5)
    (label,) = [label for label in labels if label.lamps[0] == "rotating"]
    u, v = (round(part) for part in label.centre_px)
    # From the side the glow is flat about its brightest point: half of it is over 20 px wide.
    assert electrons[v, u, 2] > 0.95 * electrons[:, :, 2].max()
    lamp = projected(
        camera.lit.camera, pose(15.0, 0.0, 1.0), np.array([beacon.position_m]) + setup.T_world_station[:3, 3]
    )
    # Facing the camera that is the lamp; turned aside, as long as its own halo outshines the beam's side.
    at_lamp = electrons[round(lamp[0, 1]), round(lamp[0, 0]), 2]
    brightest = at_lamp > 0.95 * electrons[:, :, 2].max()
    assert brightest or turned_deg > 0.0
    assert (np.hypot(*(lamp[0] - label.centre_px)) < 1.0) == brightest


def test_a_camera_that_looks_away_sees_no_light():
    labels, _, _ = labelled(imager(), pose(10.0, yaw=math.pi), exposure_s=1e-3)
    assert labels == []


def test_mirror_images_are_ignored():
    camera = imager(nuisance=dataclasses.replace(nuisance_preset("none"), surface_reflection="severe"), cfg=QUIET)
    labels, _, _ = labelled(camera, pose(25.0, z=4.0), exposure_s=0.01)
    reasons = {label.ignored for label in labels if label.lamps[0].startswith("mirror")}
    assert reasons == {"mirror"}


def test_a_camera_with_a_memory_gives_the_rays_of_one_without():
    cfg = small_cfg()
    stage, _ = next(drawn(cfg, 1, 0, (1.0, 0.0, 0.0)))
    plain = Camera(**{field.name: getattr(stage.camera, field.name) for field in dataclasses.fields(Camera)})
    rng = np.random.default_rng(0)
    grids = [rng.uniform(0.0, 100.0, (count, 2)) for count in (5, 4000, 4000)]
    for grid in [*grids, *grids]:
        rays = stage.camera.normalise(grid)
        assert np.array_equal(rays, plain.normalise(grid))
        rays[:] = 0.0  # whoever asked may do so with the answer


def test_unlit_stations_have_no_light_to_find():
    cfg = small_cfg(
        scenes={"array": 0.0, "rotating_front": 0.0, "rotating_side": 0.0, "landing": 0.0, "unlit": 1.0},
        nuisance={"mild": 0.0, "moderate": 0.0, "severe": 0.0},
    )
    frames = [frame for scene in plan_scenes(cfg, 16, 1, (1.0, 0.0, 0.0)) for frame in render_scene(cfg, scene)]
    assert {frame.facts["kind"] for frame in frames} == {"unlit_funnel", "unlit_platform"}
    assert all(label.class_id == TAG for frame in frames for label in frame.labels)
    assert any(frame.image.max() > 40 for frame in frames)


def test_a_scene_gives_the_same_frames_each_time_and_others_give_others():
    cfg = small_cfg()
    first, second = plan_scenes(cfg, 8, 4, (1.0, 0.0, 0.0))
    once, again = list(render_scene(cfg, first)), list(render_scene(cfg, first))
    assert all(np.array_equal(a.image, b.image) and a.labels == b.labels for a, b in zip(once, again, strict=True))
    other = list(render_scene(cfg, second))
    assert not any(np.array_equal(a.image, b.image) for a in once for b in other if a.image.shape == b.image.shape)


def drawn(cfg, frames, seed, shares):
    """Stages and conditions of scenes, without rendering them."""
    for scene in plan_scenes(cfg, frames, seed, shares):
        rng = np.random.default_rng(scene.seed)
        stage = set_stage(cfg, scene, rng)
        for _ in range(cfg.scenes.conditions):
            yield stage, draw_condition(cfg, scene, stage, rng)


def test_the_test_split_lies_where_detectors_differ():
    cfg = small_cfg()
    low = [condition.band[0] for stage, condition in drawn(cfg, 480, 2, (0.0, 0.0, 1.0)) if not stage.is_platform]
    assert len(low) > 180
    # 190 waters: three standard deviations of a share of 0.8 are 0.085.
    assert np.isin(low, [5.0, 9.0]).mean() == pytest.approx(0.8, abs=0.085)


def test_waters_hold_the_band_that_is_drawn_within_reach():
    cfg = small_cfg()
    for stage, condition in drawn(cfg, 120, 3, (1.0, 0.0, 1.0)):
        most_m = cfg.range.most_height_m if stage.is_platform else cfg.range.most_m
        least, most = cfg.water.attenuation_per_m
        assert least <= condition.c_per_m <= most
        assert condition.setup.water.attenuation[0] == pytest.approx(condition.c_per_m)
        # A platform cannot be 18 attenuation lengths away in any of these waters but the most turbid.
        assert condition.band[1] / condition.c_per_m <= most_m + 1e-9 or condition.c_per_m == pytest.approx(most)


def test_every_kind_and_count_of_lights_comes_in_few_scenes():
    cfg = small_cfg(scenes={"conditions": 1, "frames": 1})
    stages = [(stage, condition) for stage, condition in drawn(cfg, 60, 3, (1.0, 0.0, 0.0))]
    assert {stage.kind for stage, _ in stages} == set(KINDS)
    assert {stage.lights for stage, _ in stages if stage.kind == "array"} == set(cfg.lights.counts)
    for stage, condition in stages:
        array = condition.setup.layout.indices("array")
        dead = [name for name in condition.setup.faults.dead_lights if name.startswith("B")]
        assert len(array) - len(dead) <= stage.lights
        if stage.kind.startswith("unlit"):
            assert len(condition.setup.faults.dead_lights) == len(condition.setup.layout.beacons)


def test_frames_lie_in_their_band_and_range():
    cfg = small_cfg()
    for scene in plan_scenes(cfg, 12, 2, (1.0, 1.0, 1.0)):
        for frame in render_scene(cfg, scene):
            assert cfg.range.least_m <= frame.facts["range_m"] <= cfg.range.most_m
            assert frame.facts["c_range"] <= cfg.range.edges[-1]
            assert frame.image.dtype == np.uint8
