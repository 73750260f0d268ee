import numpy as np
import pytest
from optics_scene import T_WORLD_STATION, camera, imager, one_lamp, pose, station_layout

from auvdock.optics.exposure import AutoExposure
from auvdock.optics.imaging import ExposureCfg, ImagingCfg
from auvdock.optics.sensing import BeaconSensor
from auvdock.optics.sensor import saturated_share
from auvdock.optics.setup import OpticalSetup
from auvdock.optics.water import load_water

NOISY = ImagingCfg(surfaces=False)


def peaks(image, camera_, view):
    """Codes at the lights' pixels."""
    u, v = np.rint(view.pixels[view.inside]).astype(int).T
    return image.max(axis=2)[v, u]


def test_law_moves_against_the_error_and_within_its_bounds():
    cfg = ExposureCfg()
    law = AutoExposure(cfg)
    before = law.sensitivity_s
    law.update(cfg.saturated_share)
    assert law.sensitivity_s == before
    law.update(0.5)
    assert law.sensitivity_s == pytest.approx(before / cfg.max_step)
    law.reset()
    for _ in range(200):
        law.update(0.0)
    assert (law.exposure_s, law.gain) == (cfg.max_s, cfg.max_gain)
    for _ in range(400):
        law.update(1.0)
    assert (law.exposure_s, law.gain) == (pytest.approx(cfg.min_s), 1.0)


def test_a_fixed_exposure_stays():
    law = AutoExposure(ExposureCfg(automatic=False, initial_s=0.002))
    law.settle(lambda sensitivity_s: 1.0)
    law.update(1.0)
    assert (law.exposure_s, law.gain) == (0.002, 1.0)


def test_law_settles_after_a_jump_of_light():
    unit = imager(station_layout(), load_water("clear"), NOISY)
    unit.reset(np.random.default_rng(0))
    unit.capture(pose(25.0), 0.0)
    shares = [saturated_share(unit.capture(pose(3.0), 0.1 * k).image) for k in range(60)]
    assert shares[0] > 4.0 * np.median(shares[-10:])
    assert np.median(shares[-10:]) == pytest.approx(NOISY.exposure.saturated_share, rel=0.6)


@pytest.mark.parametrize("x", [2.0, 4.0, 8.0, 15.0, 25.0])
def test_array_lights_stay_separate_in_clear_water(x):
    layout = station_layout()
    unit = imager(layout, load_water("clear"), NOISY)
    unit.reset(np.random.default_rng(1))
    for k in range(10):
        unit.capture(pose(x), k / 30)
    shot = unit.take(pose(x), 10 / 30)
    # Squared codes are intensities; Rayleigh's criterion for two lights leaves a dip to 0.74.
    image = shot.frame.image.max(axis=2).astype(float) ** 2
    array = list(layout.indices("array"))
    # From 2 m the topmost and lowest lie outside the 50° view.
    shown = [k for k in array if shot.view.inside[k]]
    assert len(shown) >= (2 if x < 2.5 else 6)
    for a in shown:
        for b in shown:
            if a < b:
                ends = shot.view.pixels[[a, b]]
                line = np.rint(ends[0] + np.linspace(0.0, 1.0, 60)[:, None] * (ends[1] - ends[0])).astype(int)
                profile = image[line[:, 1], line[:, 0]]
                assert profile.min() < 0.74 * min(profile[:3].max(), profile[-3:].max())


@pytest.mark.parametrize("x", [3.0, 10.0, 20.0])
@pytest.mark.parametrize("name", ["clear", "pool"])
def test_both_fidelities_choose_the_same_exposure(x, name):
    layout = station_layout()
    water = load_water(name)
    unit = imager(layout, water, NOISY)
    sensor = BeaconSensor(OpticalSetup(camera(), water, layout, T_WORLD_STATION, NOISY))
    unit.reset(np.random.default_rng(1))
    sensor.reset(np.random.default_rng(1))
    for k in range(25):
        unit.capture(pose(x), k / 30)
        sensor.detect(pose(x), k / 30)
    assert unit.exposure.sensitivity_s == pytest.approx(sensor.exposure.sensitivity_s, rel=0.5)


def test_reset_makes_frames_repeat():
    unit = imager(one_lamp(), load_water("clear"), NOISY)
    runs = []
    for _ in range(2):
        unit.reset(np.random.default_rng(9))
        runs.append([unit.capture(pose(20.0 - k), k / 30).image for k in range(4)])
    assert all(np.array_equal(a, b) for a, b in zip(*runs, strict=True))
