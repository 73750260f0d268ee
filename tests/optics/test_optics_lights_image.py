import math

import cv2
import numpy as np
import pytest
from optics_scene import T_WORLD_STATION, fixed_exposure, imager, one_lamp, pose, ring

from auvdock.core.beacons import BeaconLayout
from auvdock.core.transforms import invert
from auvdock.optics.halo import halo_of
from auvdock.optics.photons.table import photon_halo_of
from auvdock.optics.water import WaterCfg, load_water, with_attenuation

NO_SCATTER = WaterCfg("absorbing", "test", (0.1, 0.2, 0.4), (0.0, 0.0, 0.0))


def electrons(unit, T_world_body, exposure_s=1e-3):
    view = unit.lit.look(T_world_body, 0.0)
    return unit.electrons(view, exposure_s).astype(np.float64), view


def centroid(channel, around, reach=12):
    x0, y0 = (round(float(part)) for part in around)
    patch = channel[y0 - reach : y0 + reach + 1, x0 - reach : x0 + reach + 1]
    # What is above the window's rim: a window cannot be centred on a fraction of a pixel.
    patch = np.maximum(patch - max(patch[[0, -1]].max(), patch[:, [0, -1]].max()), 0.0)
    dx = np.arange(-reach, reach + 1)
    total = patch.sum()
    return np.array([x0 + (patch.sum(axis=0) @ dx) / total, y0 + (patch.sum(axis=1) @ dx) / total])


@pytest.mark.parametrize("r", [2.0, 6.0, 15.0, 30.0])
def test_rendered_core_falls_as_the_closed_form(r):
    unit = imager(one_lamp(), NO_SCATTER)
    reference = electrons(unit, pose(4.0))[0].sum()
    ratio = electrons(unit, pose(r))[0].sum() / reference
    assert ratio == pytest.approx(math.exp(-0.1 * (r - 4.0)) * (4.0 / r) ** 2, rel=1e-3)


@pytest.mark.parametrize("size", [(640, 360), (1920, 1080), (650, 366)])
@pytest.mark.parametrize("r", [6.0, 15.0])
def test_image_holds_the_light_that_falls_within_it(size, r):
    width, height = size
    unit = imager(one_lamp(), load_water("pool"), width_px=width, height_px=height)
    image, view = electrons(unit, pose(r))
    lens = unit.lit.lens
    channel = unit.lit.lights.lamps["electrons_per_j"][-1] * lens.aperture_m2 * 1e-3
    arrivals = view.arrivals
    whole = (arrivals["core_w_m2"][-1] + arrivals["halo_w_m2"][-1]) * channel[2]
    # What a halo sends past the image is integrated over the coarse grid's complement.
    corner = lens.rays.reshape(*lens.shape, 3)
    angle = np.arccos(np.clip(corner @ arrivals["ray_camera"][-1], -1.0, 1.0))
    table, depth = unit.lit.lights.halo, float(arrivals["scattering_depth"][-1])
    density = table.density(depth, np.maximum(angle, 0.05).ravel()).reshape(angle.shape)
    tail = density * lens.solid_angle_sr * lens.factor**2
    outside_core = float(tail[angle > 0.05].sum())
    inside_core = float(table.encircled(depth, np.array([0.05]))[0])
    share = float(table.scattered(np.array([depth]), 0)[0])
    expected = arrivals["core_w_m2"][-1] + arrivals["halo_w_m2"][-1] * (inside_core + outside_core) / share
    assert view.inside[-1]
    assert image[:, :, 2].sum() == pytest.approx(expected * channel[2], rel=0.02)
    assert image[:, :, 2].sum() < 1.0001 * whole


@pytest.mark.parametrize(
    ("name", "attenuation", "r"),
    [
        ("clear", None, 10.0),
        ("pool", None, 10.0),
        ("pool", None, 30.0),
        ("pool", None, 60.0),
        ("pool", 1.2, 10.0),
        ("lake", None, 8.0),
    ],
)
def test_picture_and_spots_hold_the_photons_light_within_an_angle(name, attenuation, r):
    """Of the picture, and of the profile that the `beacons` fidelity and planners take, within 0.5°, 2° and 10°."""
    water = load_water(name) if attenuation is None else with_attenuation(load_water(name), attenuation)
    a, b = water.absorption_per_m[0], water.scattering_per_m[0]
    unit = imager(one_lamp(), water)
    image, view = electrons(unit, pose(r))
    lit = unit.lit
    x, y = np.meshgrid(np.arange(640.0), np.arange(360.0))
    rays = lit.camera.rays(np.column_stack([x.ravel(), y.ravel()]))
    angle = np.arccos(np.clip(rays @ view.arrivals["ray_camera"][-1], -1.0, 1.0))
    per_w = float(lit.lights.lamps["electrons_per_j"][-1, 2]) * lit.lens.aperture_m2 * 1e-3
    alone = float(lit.lights.lamps["peak_w_sr"][-1]) / r**2
    spots = lit.spots.spread(view.arrivals, view.inside)
    rings = np.cumsum(spots.profile[-1] * lit.spots.ring_px2)
    radii = lit.spots.radii_px
    edges = np.append(np.sqrt(radii[1:] * radii[:-1]), radii[-1]) * lit.lens.rad_per_px
    for half in np.radians([0.5, 2.0, 10.0]).tolist():
        photons = photon_halo_of(water).within(b * r, a / b, np.array([half]))[0]
        expected = alone * math.exp(-a * r) * (math.exp(-b * r) + photons)
        # Pixels on the rim count by the share that lies within.
        rim = np.clip((half - angle) / lit.lens.rad_per_px + 0.5, 0.0, 1.0)
        assert float(image[:, :, 2].ravel() @ rim) == pytest.approx(expected * per_w, rel=0.05)
        assert float(np.interp(half, edges, rings)) == pytest.approx(expected, rel=0.05)


def test_halo_profile_is_the_tables():
    water = load_water("pool")
    unit = imager(one_lamp(), water)
    image, view = electrons(unit, pose(15.0))
    arrivals, lens = view.arrivals, unit.lit.lens
    x, y = 320, 180
    channel = unit.lit.lights.lamps["electrons_per_j"][-1, 2] * lens.aperture_m2 * 1e-3
    table, depth = halo_of(water), float(arrivals["scattering_depth"][-1])
    whole = float(table.scattered(np.array([depth]), 0)[0])
    for offset in (6, 15, 22, 26, 40, 90, 160, 300):
        angle = np.arccos(lens.camera.rays(np.array([[x + offset, y]]).astype(float)) @ arrivals["ray_camera"][-1])
        solid = np.interp(x + offset, (np.arange(160) + 0.5) * 4 - 0.5, lens.solid_angle_sr[45])
        expected = arrivals["halo_w_m2"][-1] / whole * float(table.density(depth, angle)[0]) * solid
        assert image[y, x + offset, 2] == pytest.approx(expected * channel, rel=0.08)


@pytest.mark.parametrize("water", [NO_SCATTER, load_water("pool")], ids=["absorbing", "pool"])
@pytest.mark.parametrize(("y", "z", "yaw"), [(0.0, 0.0, 0.0), (0.37, 0.21, 0.0), (1.0, -0.7, 0.31), (-2.0, 1.1, -0.4)])
def test_centroid_is_where_the_camera_projects(water, y, z, yaw):
    unit = imager(one_lamp(), water)
    body = pose(8.0, y, z, yaw)
    image, _ = electrons(unit, body)
    camera = unit.lit.camera
    T_camera_station = invert(body @ camera.T_body_camera) @ T_WORLD_STATION
    pixel = camera.project(T_camera_station[:3, 3][None, :])[0]
    assert centroid(image[:, :, 2], pixel, 8) == pytest.approx(pixel, abs=0.05)


@pytest.mark.parametrize(("r", "tolerance_m"), [(10.0, 0.10), (5.0, 0.02)])
def test_pnp_on_rendered_lights(r, tolerance_m):
    unit = imager(ring(), load_water("clear"), fixed_exposure(1e-4))
    body = pose(r, 0.6, 0.3, 0.04)
    image = unit.capture(body, 0.0).image.astype(np.float64) ** 2
    camera, layout = unit.lit.camera, ring()
    T_camera_station = invert(body @ camera.T_body_camera) @ T_WORLD_STATION
    points = layout.positions_m @ T_camera_station[:3, :3].T + T_camera_station[:3, 3]
    level = image.max(axis=2)
    seen = np.array([centroid(np.maximum(level - 2000.0, 0.0), pixel, 4) for pixel in camera.project(points)])
    found, rvec, tvec = cv2.solvePnP(
        layout.positions_m, seen, camera.matrix, camera.distortion, flags=cv2.SOLVEPNP_IPPE
    )
    assert found
    rotation, _ = cv2.Rodrigues(rvec)
    place = (-rotation.T @ tvec).ravel()
    truth = invert(T_camera_station)[:3, 3]
    assert abs(np.linalg.norm(place) - np.linalg.norm(truth)) <= tolerance_m


def test_fields_of_view():
    camera = imager(one_lamp()).lit.camera
    edge = camera.rays(np.array([[-0.5, 179.5], [639.5, 179.5], [319.5, -0.5], [319.5, 359.5]]))
    across = np.degrees(np.arccos(edge[0] @ edge[1]))
    down = np.degrees(np.arccos(edge[2] @ edge[3]))
    assert across == pytest.approx(85.0, abs=0.05)
    assert down == pytest.approx(50.0, abs=0.05)


def test_lights_behind_and_beside_leave_a_dark_image():
    unit = imager(one_lamp(), NO_SCATTER)
    image, view = electrons(unit, pose(8.0, 0.0, 0.0, math.pi))
    assert image.max() < 1e-9
    assert not view.inside[-1]


def test_a_light_off_the_edge_still_sends_its_halo():
    unit = imager(one_lamp(), load_water("pool"))
    image, view = electrons(unit, pose(8.0, 0.0, 0.0, math.radians(45.0)))
    assert not view.inside[-1]
    assert image[180, [0, 639], 2].max() > 3.0 * image[180, 320, 2] > 0.0


def test_near_lamp_is_as_wide_as_its_face():
    unit = imager(one_lamp(), NO_SCATTER)
    image, _ = electrons(unit, pose(0.5))
    channel = image[:, :, 2]
    x = np.arange(640) - 319.5
    variance = float((channel.sum(axis=0) @ x**2) / channel.sum())
    focal = float(unit.lit.camera.matrix[0, 0])
    # A disc of radius 0.02 m has variance R²/4 per axis; pixels add 1/12.
    assert variance == pytest.approx(0.8**2 + (0.01 / 0.5 * focal) ** 2 + 1.0 / 12.0, rel=0.03)


def test_lamps_add_up():
    both = BeaconLayout(ring().beacons)
    image, view = electrons(imager(both, load_water("pool")), pose(10.0))
    solo = np.zeros_like(image)
    unit = imager(both, load_water("pool"))
    for k in range(len(both.beacons)):
        view = unit.lit.look(pose(10.0), 0.0)
        for light in (view.arrivals["core_w_m2"], view.arrivals["halo_w_m2"]):
            light[np.arange(len(light)) != k] = 0.0
        solo += unit.electrons(view, 1e-3)
    assert np.allclose(solo, image, rtol=1e-3, atol=1e-2)
