"""The shipped networks on rendered frames: lights lie where the lamps are projected to."""

import numpy as np
import pytest
from optics_scene import ImagingCfg, camera, imager, pose, station_layout

from auvdock.core.contracts import BLUE, RED, Frame, RegionOfInterest
from auvdock.optics.water import load_water
from auvdock.perception.detectors import make_detector
from auvdock.perception.network_file import network_names

NOISY = ImagingCfg(surfaces=False)


def take(x, y=0.0, yaw=0.0, water="clear"):
    unit = imager(water=load_water(water), cfg=NOISY)
    unit.reset(np.random.default_rng(3))
    return unit.take(pose(x, y, yaw=yaw), 0.0)


def matches(shot, found):
    """Lamps in the picture: distance to the nearest detection, its row, and the class that it should have."""
    view = shot.view
    lamps = np.array([beacon.wavelength_nm for beacon in station_layout().beacons])
    shining = np.flatnonzero(view.inside & view.in_sight)
    gap = np.linalg.norm(view.pixels[shining][:, None] - found.centre_px[None], axis=2)
    return gap.min(axis=1), gap.argmin(axis=1), np.where(lamps[shining] > 550.0, RED, BLUE)


@pytest.fixture(scope="module", params=network_names())
def detector(request):
    return make_detector(request.param)


@pytest.mark.parametrize(("x", "y", "yaw"), [(4.5, 0.0, 0.0), (5.5, 0.8, -0.1), (7.0, -0.7, 0.1)])
def test_near_lamps_in_clear_water_are_found_within_a_pixel(detector, x, y, yaw):
    shot = take(x, y, yaw)
    found = detector.detect(shot.frame)
    gap, row, colour = matches(shot, found)
    assert len(gap) >= 6
    assert gap.max() < 1.0
    np.testing.assert_array_equal(found.class_id[row], colour)
    assert len(found) <= len(gap) + 1


def test_the_same_frame_gives_the_same_bits_in_another_detector(detector):
    shot = take(7.0)
    other = make_detector(network_names()[0])
    first, second = detector.detect(shot.frame), other.detect(shot.frame)
    assert first.centre_px.tobytes() == second.centre_px.tobytes()
    assert first.score.tobytes() == second.score.tobytes()


def test_regions_find_the_same_lights(detector):
    shot = take(7.0)
    whole = detector.detect(shot.frame)
    centre = whole.centre_px[0]
    region = RegionOfInterest(*(np.r_[centre - 20, centre + 20].astype(int).tolist()))
    part = detector.detect(shot.frame, [region])
    inside = np.all(np.abs(whole.centre_px - centre) < 19, axis=1)
    assert 1 <= inside.sum() <= len(part)
    gap = np.linalg.norm(whole.centre_px[inside][:, None] - part.centre_px[None], axis=2).min(axis=1)
    assert gap.max() < 0.5


@pytest.mark.parametrize("level", [0, 40])
def test_a_dark_frame_holds_no_lights(detector, level):
    """Black and without noise, and an even background with noise, both of a height that is no multiple of 32."""
    seen = camera()
    noise = np.random.default_rng(0).normal(0.0, 2.0 if level else 0.0, (seen.height_px, seen.width_px, 3))
    image = np.clip(np.rint(level + noise), 0, 255).astype(np.uint8)
    assert len(detector.detect(Frame(image, 0.0, seen))) == 0
