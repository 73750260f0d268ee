import dataclasses
import itertools
import math

import numpy as np
import pytest
from optics_scene import T_WORLD_STATION, camera, fixed_exposure, imager, one_lamp, pose, ring, station_layout

from auvdock.core.contracts import BLUE, RED, Detections
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import invert
from auvdock.optics.detection_fit import fit_detection_model, observe
from auvdock.optics.detection_model import (
    Candidates,
    DetectionModelCfg,
    draw_detections,
    load_detection_model,
    merge_close,
)
from auvdock.optics.imaging import ImagingCfg
from auvdock.optics.meeting import Candidate, squared_distances
from auvdock.optics.nuisance import NuisanceCfg, nuisance_preset
from auvdock.optics.sensing import BeaconSensor
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import WaterCfg, load_water, with_attenuation

MODEL = DetectionModelCfg(
    name="test",
    source="made up",
    contrast_50_dn=40.0,
    surround_factor=0.5,
    slope=5.0,
    ceiling=1.0,
    merge_px=3.0,
    merge_radii=1.0,
    centre_floor_px=0.1,
    centre_at_100=0.2,
    score_gain=1.0,
    false_alarms=0.0,
    wrong_colour=0.0,
)


CLEAR = load_water("clear")


def sensor(layout=None, water=CLEAR, nuisance=None, model=None, imaging=None):
    seen = layout or station_layout()
    setup = OpticalSetup(camera(), water, seen, T_WORLD_STATION, imaging or ImagingCfg(), nuisance or NuisanceCfg())
    unit = BeaconSensor(setup, model=model)
    unit.reset(np.random.default_rng(1))
    return unit


def candidates(pixels, contrast, radius=0.0, around=0.0):
    lights = Candidate.zeros(len(pixels))
    lights["pixel"] = np.array(pixels, dtype=float).reshape(-1, 2)
    lights["contrast_dn"], lights["surround_dn"], lights["noise_dn"] = contrast, around, 0.7
    lights["radius_px"], lights["width_px"], lights["flux"] = radius, 1.0, 1.0
    return Candidates(lights, squared_distances(lights))


@pytest.mark.parametrize("name", ["threshold", "blob"])
def test_fitted_models_load(name):
    model = load_detection_model(name)
    assert model.name == name
    assert model.ceiling > 0.9


def test_no_model_for_an_unknown_detector():
    with pytest.raises(ConfigError, match="threshold"):
        load_detection_model("mine:Detector")


def test_lights_are_where_the_camera_projects_them():
    unit = sensor()
    body = pose(10.0, 0.5, -0.3, 0.1)
    layout = station_layout()
    T_camera_station = invert(body @ camera().T_body_camera) @ T_WORLD_STATION
    truth = camera().project(layout.positions_m @ T_camera_station[:3, :3].T + T_camera_station[:3, 3])
    for k in range(20):
        found = unit.detect(body, k / 30)
        distance = np.linalg.norm(found.centre_px[:, None, :] - truth, axis=2)
        assert distance.min(axis=1).max() < 1.0
        assert len(np.unique(distance.argmin(axis=1))) == len(found)


def test_colours_and_order():
    found = sensor().detect(pose(4.0), 0.0)
    assert np.count_nonzero(found.class_id == RED) == 4
    assert np.count_nonzero(found.class_id == BLUE) == 7
    assert np.all(np.diff(found.score) <= 1e-12)
    assert np.all((found.score >= 0.0) & (found.score <= 1.0))
    assert np.all(found.xyxy[:, :2] <= found.centre_px)
    assert np.all(found.centre_px <= found.xyxy[:, 2:])


@pytest.mark.parametrize("yaw", [math.pi, math.pi / 2.0])
def test_nothing_in_view_nothing_found(yaw):
    found = sensor(model=MODEL).detect(pose(10.0, yaw=yaw), 0.0)
    assert len(found) == 0


def test_fewer_lights_in_more_turbid_water():
    counts = []
    for c in (0.1, 0.4, 0.8, 2.0):
        unit = sensor(water=with_attenuation(load_water("pool"), c), model=MODEL)
        counts.append(np.mean([len(unit.detect(pose(15.0), k / 30)) for k in range(30)]))
    assert counts[0] > 5.0
    assert all(low >= high - 0.3 for low, high in itertools.pairwise(counts))
    # What remains is the common glow.
    assert counts[-1] < 1.0


def test_same_seed_same_detections():
    runs = []
    for seed in (1, 1, 2):
        unit = sensor(nuisance=nuisance_preset("moderate"))
        unit.reset(np.random.default_rng(seed))
        runs.append(np.concatenate([unit.detect(pose(12.0), k / 30).centre_px.ravel() for k in range(5)]))
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


def test_detection_curve_and_spread():
    rng = np.random.default_rng(0)
    for contrast, expected in ((20.0, 1.0 / 33.0), (40.0, 0.5), (80.0, 32.0 / 33.0)):
        spread = [(100.0 * k, 50.0) for k in range(1, 6)]
        hits = [len(draw_detections(candidates(spread, contrast), MODEL, (640, 360), rng)) for _ in range(400)]
        assert np.mean(hits) / 5.0 == pytest.approx(expected, abs=0.035)
    veiled = [len(draw_detections(candidates(spread, 80.0, 0.0, 80.0), MODEL, (640, 360), rng)) for _ in range(400)]
    assert np.mean(veiled) / 5.0 == pytest.approx(0.5, abs=0.035)
    errors = [
        draw_detections(candidates([(50, 50)], 100.0), MODEL, (640, 360), rng).centre_px - 50.0 for _ in range(999)
    ]
    assert np.concatenate(errors).std() == pytest.approx(math.hypot(0.1, 0.2), rel=0.06)


def test_close_lights_merge_at_their_common_centre():
    merged = merge_close(candidates([(100, 100), (102, 100), (200, 100)], 90.0), MODEL).lights
    kept = merged["pixel"][merged["contrast_dn"] > 0.0]
    assert kept.tolist() == [[101.0, 100.0], [200.0, 100.0]]
    # Saturated discs reach further.
    apart = candidates([(100, 100), (108, 100)], 90.0, 1.0)
    wide = candidates([(100, 100), (108, 100)], 90.0, 3.0)
    assert np.count_nonzero(merge_close(apart, MODEL).lights["contrast_dn"]) == 2
    assert np.count_nonzero(merge_close(wide, MODEL).lights["contrast_dn"]) == 1


@pytest.mark.parametrize("m", [0, 1])
def test_few_candidates(m):
    seen = candidates([(50, 50)] * m, 200.0)
    found = draw_detections(seen, dataclasses.replace(MODEL, false_alarms=3.0), (640, 360), np.random.default_rng(0))
    assert len(found) == m


class PlainThreshold:
    """Connected components above code 60; a stand-in for a detector of the perception room."""

    def detect(self, frame, regions=()):
        import cv2

        level = frame.image.max(axis=2)
        count, _, _, centres = cv2.connectedComponentsWithStats((level > 60).astype(np.uint8))
        score = np.full(count - 1, 0.9)
        return Detections.from_points(centres[1:].astype(float), score, np.zeros(count - 1, dtype=np.int64))


def test_fit_finds_the_threshold_of_a_plain_detector():
    # A red-free ring, so that all lights are alike, in absorbing water; they sink below code 60 at some 20 m.
    water = WaterCfg("absorbing", "test", (0.2, 0.2, 0.2), (0.0, 0.0, 0.0))
    unit = imager(ring(), water, fixed_exposure(1e-4, noise=True))
    rng = np.random.default_rng(3)
    poses = [pose(x, *rng.uniform(-0.05, 0.05, 2) * x) for x in rng.uniform(4.0, 45.0, 70)]
    model = fit_detection_model("plain", "test", observe(unit, PlainThreshold(), poses, rng))
    assert 30.0 < model.contrast_50_dn < 90.0
    assert model.ceiling > 0.9
    assert model.centre_floor_px < 0.5
    assert model.wrong_colour == pytest.approx(0.0, abs=0.02)
    assert model.false_alarms < 2.0


def test_lamp_alone_in_distilled_water_is_seen_far_away():
    unit = sensor(one_lamp(), water=with_attenuation(load_water("I"), 0.02))
    assert len(unit.detect(pose(60.0), 0.0)) == 1


@pytest.mark.parametrize("encoding", ["sqrt", "linear"])
@pytest.mark.parametrize("range_m", [1.5, 4.0, 12.0, 25.0])
def test_lights_meet_as_their_profiles_say(range_m, encoding):
    """The compiled sums over lights and rings against the same in NumPy, 1e-9."""
    lit = sensor(imaging=ImagingCfg(encoding=encoding)).lit
    view, model, scale = lit.look(pose(range_m), 0.0), lit.spots, lit.scale(2.0)
    spots, behind_e_s = model.spread(view.arrivals, view.inside), np.array([1e4, 2e4, 3e4])
    lights, distance2_px2, saturated_px2 = model.meet(spots, scale, 0.01, behind_e_s)
    pixels, radii_px = view.pixels[view.inside], model.radii_px
    assert len(pixels) > 0
    channel = spots.rows["channel"] * 0.01
    above = np.clip(spots.profile[:, :, None] * channel[:, None] * (2.5 / scale.saturated_e) - 2.0, 0.0, 1.0)
    area = np.einsum("mkc,k->mc", above, model.ring_px2)
    gap2 = np.sum((pixels[:, None] - pixels[None]) ** 2, axis=2)
    nearest = np.abs(0.5 * np.log(np.maximum(gap2, radii_px[0] ** 2))[..., None] - np.log(radii_px))
    best, light = channel.argmax(axis=1), np.arange(len(pixels))
    level = spots.profile[light, nearest.argmin(axis=2)] * channel.T[best]
    own = np.diag(level)
    around = level.sum(axis=1) - own + behind_e_s[best] * 0.01
    bright, dark = (np.minimum(scale.codes(e), 255.0) for e in (own + around, around))
    np.testing.assert_array_equal(lights["pixel"], pixels)
    np.testing.assert_array_equal(lights["red"], best == 0)
    np.testing.assert_allclose(distance2_px2, gap2, atol=1e-9)
    np.testing.assert_allclose(lights["flux"], own, rtol=1e-12)
    np.testing.assert_allclose(lights["surround_dn"], dark, rtol=1e-9)
    np.testing.assert_allclose(lights["contrast_dn"], bright - dark, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(lights["noise_dn"], scale.noise_dn(own + around), rtol=1e-12)
    np.testing.assert_allclose(lights["radius_px"], np.sqrt(area.max(axis=1) / np.pi), rtol=1e-12)
    assert saturated_px2 == pytest.approx(float(area.sum()), rel=1e-12)
    np.testing.assert_allclose(model.saturated_area_px2(spots, scale.saturated_e / 0.01), area, rtol=1e-12)


def same(arrivals, others):
    """Whether two frames show the same light from the same directions."""
    return all(
        np.array_equal(arrivals[name], others[name]) for name in ("ray_camera", "pixel", "core_w_m2", "halo_w_m2")
    )


def test_nuisances_are_steps_and_where_there_are_none_light_goes_straight():
    """Light that arrives is that of the lamps alone, whatever was looked at before."""
    lit = sensor().lit
    seen = [lit.look(pose(x), 0.1 * x).arrivals for x in (5.0, 9.0, 5.0)]
    assert same(seen[0], seen[2])
    T_station_camera = invert(T_WORLD_STATION) @ pose(9.0) @ camera().T_body_camera
    assert same(seen[1], lit.lights.arrive(T_station_camera, lit.lens.projection))
    for part in ("flicker", "surface_reflection"):
        disturbed = sensor(nuisance=dataclasses.replace(NuisanceCfg(), **{part: "severe"})).lit
        one, other = (disturbed.look(pose(9.0), t).arrivals for t in (0.0, 1.0))
        assert not same(one, other)
