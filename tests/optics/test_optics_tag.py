import dataclasses
import math
import pickle

import cv2
import numpy as np
import pytest
from landing_scene import QUIET, STATION, T_WORLD_STATION, above, fixed, landing_camera, platform_scene
from scipy.special import ndtr

from auvdock.core.landing_station import TagCfg
from auvdock.core.transforms import invert
from auvdock.numeric.constants import TAG_CELLS
from auvdock.optics.faults import FaultCfg
from auvdock.optics.lamp import LampCfg
from auvdock.optics.landing_camera import landing_imaging
from auvdock.optics.nuisance import NuisanceCfg
from auvdock.optics.settings import ExposureCfg
from auvdock.optics.tag_pattern import corners_station_m, reflectances, tag_cells, tag_png, tag_to_station
from auvdock.optics.tag_pixels import TagLight, add_tag
from auvdock.optics.water import WaterCfg
from auvdock.sim.mj import mujoco

LINEAR = dataclasses.replace(fixed(8e-3), encoding="linear")
ALL_DARK = FaultCfg(dead_lights=("B0", "B1", "B2", "B3", "B4"))


def detector():
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), settings)


def read(image):
    corners, ids, _ = detector().detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    return {} if ids is None else {int(i): np.reshape(c, (4, 2)) for i, c in zip(np.ravel(ids), corners, strict=True)}


def true_corners(unit, body):
    to_camera = invert(body @ unit.lit.camera.T_body_camera) @ T_WORLD_STATION
    points = corners_station_m(STATION.tag) @ to_camera[:3, :3].T + to_camera[:3, 3]
    return unit.lit.camera.project(points)


def tag_only(unit, body, exposure_s=8e-3):
    """Electrons of the tag alone, on black."""
    image = np.zeros((600, 800, 3), dtype=np.float32)
    unit.tag.add(image, body @ unit.lit.camera.T_body_camera, exposure_s, None)
    return image.astype(np.float64)


def test_cells_and_picture_are_opencvs_tag():
    for tag_id in (0, 7, 586):
        picture = cv2.imdecode(np.frombuffer(tag_png(TagCfg(tag_id=tag_id)), dtype=np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        assert picture.shape == (80, 80, 3)
        assert set(read(cv2.copyMakeBorder(picture, 20, 20, 20, 20, cv2.BORDER_REPLICATE))) == {tag_id}
    assert tag_cells(0)[0].all()
    assert tag_cells(0)[:, -1].all()
    assert not tag_cells(0)[1, 1:-1].any()


def test_upper_edge_lies_to_the_head_and_left_is_port():
    upper_left, upper_right, lower_right, lower_left = corners_station_m(STATION.tag)
    half = STATION.tag.size_m / 2
    assert upper_left == pytest.approx([half, half, 0.0])
    assert upper_right == pytest.approx([half, -half, 0.0])
    assert lower_right == pytest.approx([-half, -half, 0.0])
    assert lower_left == pytest.approx([-half, half, 0.0])
    corner = tag_to_station(STATION.tag) @ np.array([1.0, 1.0, 1.0])
    assert corner == pytest.approx(upper_left)


def test_picture_is_a_texture_that_mujoco_takes():
    xml = """<mujoco><asset><texture name="t" type="2d" file="t.png"/><material name="m" texture="t"/></asset>
      <worldbody><geom type="plane" size="1 1 1" material="m"/></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml, {"t.png": tag_png(STATION.tag)})
    assert model.ntex == 1
    assert int(model.tex_width[0]) == 80


@pytest.mark.parametrize(
    ("height_m", "yaw_deg", "tilt_deg"), [(0.45, 0.0, 0.0), (1.0, 30.0, 4.0), (2.0, -45.0, -3.0), (3.5, 12.0, 0.0)]
)
def test_opencv_reads_the_tag_with_its_corners_where_they_are(height_m, yaw_deg, tilt_deg):
    day = NuisanceCfg(daylight="severe")
    short = dataclasses.replace(LINEAR, lamp_spill=0.0, exposure=fixed(3e-4).exposure)
    unit = landing_camera(short, "clear", None, ALL_DARK, day)
    body = above(height_m, 0.05, -0.04, yaw_deg, tilt_deg, -tilt_deg)
    unit.reset(np.random.default_rng(0))
    found = read(unit.capture(body, 0.0).image)
    assert set(found) == {0}
    # OpenCV refines on a window about the corner; black cells beside it pull by some tenths of a pixel.
    assert np.abs(found[0] - true_corners(unit, body)).max() < 0.4


def test_drawing_equals_brute_supersampling():
    # Even light and no water: what is left is the pattern, the lens and the blur.
    nothing = WaterCfg("nothing", "test", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    even = dataclasses.replace(LINEAR, lamp_spill=0.0)
    unit = landing_camera(even, nothing, None, nuisance=NuisanceCfg(daylight="severe"))
    assert unit.tag is not None
    scene = unit.tag.scene
    for body in (above(1.8, 0.03, 0.02, 33.0, 5.0, -4.0), above(3.0, 0.2, 0.3, -20.0, -8.0, 6.0)):
        T_world_camera = body @ unit.lit.camera.T_body_camera
        drawn = tag_only(unit, body)[:, :, 1]
        rows, columns = np.nonzero(drawn)
        x0, x1, y0, y1 = columns.min(), columns.max() + 1, rows.min(), rows.max() + 1
        grid = np.stack(np.meshgrid(np.arange(x0, x1), np.arange(y0, y1)), axis=2).reshape(-1, 2).astype(float)
        drawn = drawn[y0:y1, x0:x1] / unit.lit.lens.solid_angle_at(grid).reshape(y1 - y0, x1 - x0)
        fine = 7
        x = (np.arange((x1 - x0) * fine) + 0.5) / fine - 0.5 + x0
        y = (np.arange((y1 - y0) * fine) + 0.5) / fine - 0.5 + y0
        rays = unit.lit.camera.normalise(np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2))
        to_camera = invert(T_world_camera)
        plane = to_camera[:3, :3] @ scene.cells_to_world
        plane[:, 2] += to_camera[:3, 3]
        cells = np.column_stack([rays, np.ones(len(rays))]) @ np.linalg.inv(plane).T
        cells = cells[:, :2] / cells[:, 2:]
        on = np.all((cells >= 0.0) & (cells < TAG_CELLS), axis=1)
        white = tag_cells(0)[cells[:, 1].clip(0, 9).astype(int), cells[:, 0].clip(0, 9).astype(int)]
        sharp = np.where(on, np.where(white, 0.9, 0.09), 0.0).reshape(len(y), len(x)).astype(np.float32)
        blurred = cv2.GaussianBlur(sharp, (0, 0), 0.8 * fine, borderType=cv2.BORDER_CONSTANT)
        wanted = blurred.reshape(y1 - y0, fine, x1 - x0, fine).mean(axis=(1, 3))
        level = drawn[wanted > 0.88].mean() / wanted[wanted > 0.88].mean()
        miss = drawn / level - wanted
        # A pixel's square counts as a Gaussian of the same width; the reference itself has steps of a seventh pixel.
        assert np.abs(miss).max() < 0.04
        assert float(np.sqrt(np.mean(miss**2))) < 0.008
        # Nothing is displaced: least squares of the miss on the picture's gradient, in pixels.
        down, across = np.gradient(wanted)
        slopes = np.column_stack([across.ravel(), down.ravel()])
        shift = np.linalg.lstsq(slopes, miss.ravel(), rcond=None)[0]
        assert np.abs(shift).max() < 0.01


@pytest.mark.parametrize("place", [(0.75, 0.03, 0.02, 33.0, 5.0, -4.0), (0.5, 0.05, -0.02, -8.0, -3.0, 4.0)])
def test_a_nearby_tag_equals_the_closed_form_at_every_pixel(place):
    # As above, but the cells are so large that the blurred pattern is known: a difference of normal distributions at
    # the place where each pixel's own ray meets the plane, in double precision.
    nothing = WaterCfg("nothing", "test", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    even = dataclasses.replace(LINEAR, lamp_spill=0.0)
    unit = landing_camera(even, nothing, None, nuisance=NuisanceCfg(daylight="severe"))
    assert unit.tag is not None
    body = above(*place)
    drawn = tag_only(unit, body)[:, :, 1]
    grid = np.stack(np.meshgrid(np.arange(800.0), np.arange(600.0)), axis=2).reshape(-1, 2)
    drawn /= unit.lit.lens.solid_angle_at(grid).reshape(600, 800)
    to_camera = invert(body @ unit.lit.camera.T_body_camera)
    plane = to_camera[:3, :3] @ unit.tag.scene.cells_to_world
    plane[:, 2] += to_camera[:3, 3]
    cells = np.column_stack([unit.lit.camera.normalise(grid), np.ones(len(grid))]) @ np.linalg.inv(plane).T
    cells = (cells[:, :2] / cells[:, 2:]).reshape(600, 800, 2)
    per_px = np.hypot(np.gradient(cells, axis=0), np.gradient(cells, axis=1))
    edges = np.arange(TAG_CELLS + 1.0)
    sigma = math.sqrt(0.8**2 + 1.0 / 12.0) * per_px
    u, v = (np.diff(ndtr((edges - cells[:, :, k : k + 1]) / sigma[:, :, k : k + 1]), axis=2) for k in range(2))
    wanted = np.einsum("yxr,rc,yxc->yx", v, np.where(tag_cells(0), 0.9, 0.09), u)
    assert (wanted > 0.05).sum() > 60000
    level = drawn[wanted > 0.88].mean() / wanted[wanted > 0.88].mean()
    miss = drawn / level - wanted
    assert np.abs(miss).max() < 0.065
    assert float(np.sqrt(np.mean(miss**2))) < 0.0045
    down, across = np.gradient(wanted)
    slopes = np.column_stack([across.ravel(), down.ravel()])
    # One blur for the whole tag, from the lens in its middle: that is the miss.
    assert np.abs(np.linalg.lstsq(slopes, miss.ravel(), rcond=None)[0]).max() < 0.003


def test_cells_have_the_light_that_the_scene_says():
    unit = landing_camera(LINEAR, "pool", LampCfg())
    body = above(0.8)
    view = unit.lit.look(body, 0.0)
    assert unit.tag is not None
    seen = unit.tag.scene.look(view)
    assert seen is not None
    assert seen.inside
    image = tag_only(unit, body)
    to_camera = invert(body @ unit.lit.camera.T_body_camera) @ T_WORLD_STATION
    white = tag_cells(0)
    for row in (4, 5):
        for column in (4, 5):
            place = tag_to_station(STATION.tag) @ np.array([column + 0.5, row + 0.5, 1.0])
            pixel = unit.lit.camera.project((to_camera[:3, :3] @ place + to_camera[:3, 3])[None, :])[0]
            got = image[round(pixel[1]), round(pixel[0])] / 8e-3
            assert got == pytest.approx(seen.white_e_s if white[row, column] else seen.black_e_s, rel=0.02)
    assert white[4:6, 4:6].any()
    assert not white[4:6, 4:6].all()


def pattern(place, sigma, veil):
    """Reflectance × coverage and coverage, at columns and rows of places (n,) in cells."""
    tangents = np.array(np.meshgrid(place, place), dtype=np.float32)
    size = len(place)
    image = np.zeros((size, size, 3), dtype=np.float32)
    unit = np.zeros((7, size, 3), dtype=np.float32)
    unit[:, :, 0] = 1.0
    beside = np.zeros((7 if veil else 0, size, 3), dtype=np.float32)
    beside[:, :, 1] = 1.0
    below = np.zeros((0 if veil else 4, size, 3), dtype=np.float32)
    below[:, :, 1] = -1.0
    cells = reflectances(STATION.tag)
    one = np.eye(3, dtype=np.float32)
    light = TagLight(unit, beside, below, 4 / size, 0.0, 0)
    add_tag(image, (0, 0, size, size), tangents, one, cells, (sigma, sigma), light)
    assert not image[:, :, 2].any()
    return image[:, :, 0].astype(float), image[:, :, 1].astype(float)


@pytest.mark.parametrize("sigma", [0.008, 0.08, 0.6])
@pytest.mark.parametrize("veil", [True, False])
def test_the_pattern_covers_the_tag_and_nothing_else(sigma, veil):
    step = 0.05
    place = np.arange(-4.0, 14.0, step) + 0.013
    reflected, covered = pattern(place, sigma, veil)
    # A Gaussian keeps what there is; sums of its samples equal integrals where it is wider than the step.
    rel = 2e-4 if sigma > step else 2e-2
    assert float(covered.sum()) * step**2 == pytest.approx(TAG_CELLS**2, rel=rel)
    white = float(tag_cells(0).sum()) * 0.9 + float((~tag_cells(0)).sum()) * 0.09
    assert float(reflected.sum()) * step**2 == pytest.approx(white, rel=rel)
    assert float(covered.max()) <= 1.0 + 1e-5
    beyond = (place < -4.5 * sigma) | (place > TAG_CELLS + 4.5 * sigma)
    assert not covered[beyond].any()
    assert not covered[:, beyond].any()
    # Bounds for what is left out beyond 4.5 σ of an edge, and for the table of the normal distribution.
    edges = np.arange(TAG_CELLS + 1.0)
    share = np.diff(ndtr((edges - place[:, None]) / sigma), axis=1)
    wanted = share @ np.where(tag_cells(0), 0.9, 0.09) @ share.T
    assert np.abs(reflected - wanted).max() < 3e-5
    assert np.abs(covered - np.outer(share.sum(axis=1), share.sum(axis=1))).max() < 3e-5


@pytest.mark.parametrize(
    "body",
    [above(2.0, x=5.0), above(-1.0), above(2.0, roll_deg=180.0), above(0.01), above(2.0, pitch_deg=85.0)],
    ids=["aside", "below", "looking up", "touching", "at the horizon"],
)
def test_a_tag_out_of_sight_changes_nothing(body):
    unit = landing_camera(LINEAR, "clear", LampCfg())
    assert not tag_only(unit, body).any()


def test_a_tag_over_the_edge_is_cut_not_moved():
    unit = landing_camera(LINEAR, "clear", LampCfg())
    whole, cut = tag_only(unit, above(1.0)), tag_only(unit, above(1.0, y=0.45))
    assert 0.1 * (whole > 0).sum() < (cut > 0).sum() < 0.9 * (whole > 0).sum()
    assert cut[:, 0].any() or cut[:, -1].any()


def test_a_covered_tag_cannot_be_read_and_comes_back():
    faults = FaultCfg(tag_hidden_from_s=1.0, tag_hidden_for_s=2.0)
    unit = landing_camera(QUIET, "clear", LampCfg(), faults)
    unit.reset(np.random.default_rng(0))
    seen = {t: set(read(unit.capture(above(1.0), t).image)) for t in (0.0, 0.95, 1.0, 2.0, 2.95, 3.05)}
    assert [bool(seen[t]) for t in sorted(seen)] == [True, True, False, False, False, True]


def test_the_height_starts_the_cover_once():
    unit = landing_camera(QUIET, "clear", LampCfg(), FaultCfg(tag_hidden_below_m=1.0, tag_hidden_for_s=2.0))
    unit.reset(np.random.default_rng(0))
    steps = [(2.0, 0.0, True), (0.95, 1.0, False), (1.5, 2.0, False), (0.9, 2.9, False), (0.9, 3.1, True)]
    for height_m, time_s, readable in steps:
        assert bool(read(unit.capture(above(height_m), time_s).image)) is readable
    unit.reset(np.random.default_rng(0))
    assert read(unit.capture(above(2.0), 0.0).image)


@pytest.mark.render
def test_the_models_own_tag_is_left_out():
    unit = landing_camera(dataclasses.replace(QUIET, surfaces=True), "clear", LampCfg(), scene=platform_scene())
    try:
        unit.reset(np.random.default_rng(0))
        assert unit.surfaces is not None
        colour, _ = unit.surfaces.renderer.render(above(1.0) @ unit.lit.camera.T_body_camera)
        # The model's tag is a red box; platform and guides are grey.
        assert int(np.ptp(colour.astype(int), axis=2).max()) < 60
        image = unit.capture(above(1.0), 0.0).image
        assert set(read(image)) == {0}
        copy = pickle.loads(pickle.dumps(unit))
        for each in (unit, copy):
            each.reset(np.random.default_rng(4))
        assert np.array_equal(unit.capture(above(0.7), 0.0).image, copy.capture(above(0.7), 0.0).image)
        copy.close()
    finally:
        unit.close()


@pytest.mark.render
@pytest.mark.parametrize(("water", "greatest_m"), [("clear", 3.5), ("pool", 1.7), ("lake", 1.2)])
def test_the_tag_can_be_read_in_a_noisy_frame_with_the_lamp_on(water, greatest_m):
    unit = landing_camera(landing_imaging(), water, LampCfg(), scene=platform_scene())
    try:
        for height_m in (0.5, greatest_m):
            unit.reset(np.random.default_rng(2))
            assert set(read(unit.capture(above(height_m, yaw_deg=25.0), 0.0).image)) == {0}
    finally:
        unit.close()


def test_the_exposure_settles_on_what_is_in_the_picture():
    cfg = dataclasses.replace(QUIET, exposure=ExposureCfg(saturated_share=0.01, max_s=0.02))
    unit = landing_camera(cfg, "clear", LampCfg())
    unit.reset(np.random.default_rng(0))
    image = unit.capture(above(0.6), 0.0).image
    assert 0.003 < float(np.mean(image >= 250)) < 0.03
    assert math.isfinite(unit.exposure.exposure_s)
