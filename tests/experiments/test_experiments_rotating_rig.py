"""Paper B's pool: geometry of the rig, and that the flash is there when it should be."""

import math

import numpy as np
import pytest

from auvdock.core.camera import CameraCfg
from auvdock.experiments.rotating_rig import (
    PoolRig,
    ShrunkDetector,
    flash_visibility,
    network_stand_in,
    share_of_turns,
)
from auvdock.optics.water import load_water, with_attenuation
from auvdock.perception.threshold import ThresholdDetector

SMALL = CameraCfg(width_px=960, height_px=540)


@pytest.fixture(scope="module")
def rig():
    return PoolRig(day=False, camera=SMALL)


def test_beacon_is_where_the_optics_put_it(rig):
    for x_m, y_m in ((4.5, 20.0), (-1.5, 35.0)):
        view = rig.imager.lit.look(rig.pose(x_m, y_m), 0.0)
        assert view.pixels[rig.imager.lit.rotating.lamp] == pytest.approx(rig.beacon_px(x_m, y_m), abs=1e-6)
        # Seen from x > 0 the beacon lies to the left, as far as the camera's azimuth says.
        right = rig.camera.normalise(rig.beacon_px(x_m, y_m)[None, :])[0, 0]
        assert math.atan(-right) == pytest.approx(rig.azimuth_rad(x_m, y_m), abs=1e-6)


def test_brightest_when_the_beam_points_at_the_camera(rig):
    facing_s = rig.facing_s(4.5, 25.0)
    times = facing_s + np.array([-0.06, -0.03, 0.0, 0.03, 0.06, 1.0])
    lamp = rig.imager.lit.rotating.lamp
    halo = [shot.view.arrivals["halo_w_m2"][lamp] for shot in rig.shots(4.5, 25.0, times, np.random.default_rng(0))]
    assert np.argmax(halo) == 2
    assert halo[1] == pytest.approx(halo[3], rel=1e-3)
    # Away from the camera 2 % of all scattering sends some light back.
    assert halo[5] < 5e-3 * halo[2]


def test_arc_shrinks_with_range(rig):
    detector = network_stand_in(SMALL)
    near, far, beyond = (
        flash_visibility(rig, detector, 1.5, y_m, day=False, step_deg=6.0, reach_deg=42.0) for y_m in (20.0, 30.0, 60.0)
    )
    assert near.arc_deg > far.arc_deg > 0.0
    assert near.facing_share == far.facing_share == 1.0
    assert beyond.arc_deg == 0.0
    assert near.frames_a_turn == pytest.approx(near.arc_deg / 6.0)


def test_shrunk_detector_keeps_places():
    rig = PoolRig(day=False, camera=SMALL, water=with_attenuation(load_water("clear"), 0.1))
    shot = next(rig.shots(-4.5, 20.0, [rig.facing_s(-4.5, 20.0)], np.random.default_rng(0)))
    found = ShrunkDetector(ThresholdDetector(), SMALL, 480).detect(shot.frame)
    assert np.linalg.norm(found.centre_px - rig.beacon_px(-4.5, 20.0), axis=1).min() < 0.7


def test_share_of_turns_falls_from_one_to_none(rig):
    detector = network_stand_in(SMALL)
    shares = [share_of_turns(rig, detector, 1.5, y_m, turns=6) for y_m in (30.0, 60.0)]
    assert shares == [1.0, 0.0]


@pytest.mark.render
@pytest.mark.xfail(strict=True, reason="MAX_GAIN was calibrated on Wells' light, which is four times as bright at 45 m")
def test_daylight_ends_what_the_night_lets_see():
    """Paper B, section 5.2: 45 m by day as by night; at 50 m by night near the axis only, by day not at all."""
    seen = {}
    for day in (True, False):
        pool = PoolRig(day)
        detector = network_stand_in(pool.camera_cfg)
        for x_m, y_m in ((-4.5, 45.0), (1.5, 50.0), (4.5, 50.0)):
            seen[day, x_m, y_m] = share_of_turns(pool, detector, x_m, y_m, turns=12)
    assert seen[True, -4.5, 45.0] == seen[False, -4.5, 45.0] == 1.0
    assert seen[True, 1.5, 50.0] == seen[True, 4.5, 50.0] == 0.0
    assert seen[False, 1.5, 50.0] > 0.5 > seen[False, 4.5, 50.0]
