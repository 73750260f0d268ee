from dataclasses import replace

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.optics.sensor import Sensor, SensorScale, saturated_share
from auvdock.optics.settings import ExposureCfg, ImagingCfg


def flat(level_e, size=(360, 640)):
    return np.full((*size, 3), level_e, dtype=np.float32)


@pytest.mark.parametrize("encoding", ["sqrt", "linear"])
@pytest.mark.parametrize("gain", [1.0, 8.0])
def test_variance_is_linear_in_the_mean(encoding, gain):
    cfg = ImagingCfg(encoding=encoding)
    sensor, scale = Sensor(640, 360, cfg), SensorScale(cfg, gain)
    sensor.reset(np.random.default_rng(5))
    levels = np.array([0.2, 0.4, 0.6, 0.8]) * cfg.full_well_e / gain
    variances = []
    for level in levels:
        decoded = scale.electrons(sensor.expose(flat(level), gain).astype(np.float64))
        # A sum of 1/4 variance in the root is squared back; its mean is the read noise's and 1/4 above the signal.
        assert decoded.mean() == pytest.approx(level, rel=0.01)
        codes = np.array([level, level * 1.001])
        step = 0.001 * level / np.diff(scale.codes(codes))[0]
        variances.append(decoded.var() - step**2 / 12.0)
    slope, offset = np.polyfit(levels, np.array(variances), 1)
    assert slope == pytest.approx(1.0, rel=0.04)
    assert abs(offset) < 0.04 * levels[-1]


def test_read_noise_in_the_dark():
    cfg = ImagingCfg(read_noise_e=60.0, encoding="linear", full_well_e=2000.0)
    sensor, scale = Sensor(640, 360, cfg), SensorScale(cfg, 1.0)
    sensor.reset(np.random.default_rng(5))
    decoded = scale.electrons(sensor.expose(flat(500.0), 1.0).astype(np.float64))
    assert decoded.std() == pytest.approx(np.sqrt(500.0 + 60.0**2), rel=0.03)


@pytest.mark.parametrize("encoding", ["sqrt", "linear"])
def test_codes_and_electrons_are_inverse(encoding):
    scale = SensorScale(ImagingCfg(encoding=encoding), 2.0)
    codes = np.linspace(0.0, 255.0, 50)
    assert scale.codes(scale.electrons(codes)) == pytest.approx(codes, abs=1e-9)
    assert scale.electrons(np.array([255.0]))[0] == pytest.approx(20000.0)


@pytest.mark.parametrize("encoding", ["sqrt", "linear"])
def test_codes_are_the_rounded_codes_of_the_scale(encoding):
    cfg = ImagingCfg(encoding=encoding, noise=False)
    electrons = np.linspace(0.0, 1.2 * cfg.full_well_e / 2.0, 640 * 360 * 3, dtype=np.float32).reshape(360, 640, 3)
    image = Sensor(640, 360, cfg).expose(electrons, 2.0)
    wanted = np.clip(SensorScale(cfg, 2.0).codes(electrons.astype(np.float64)), 0.0, 255.0)
    assert np.abs(image - wanted).max() < 0.501
    # Light beyond all measure saturates, it does not wrap around.
    assert Sensor(2, 2, cfg).expose(np.full((2, 2, 3), 1e30, dtype=np.float32), 2.0).min() == 255


def test_saturation_clips_and_counts():
    cfg = ImagingCfg(noise=False)
    sensor = Sensor(640, 360, cfg)
    buffer = flat(100.0)
    buffer[:18, :, 0] = 1e7
    image = sensor.expose(buffer, 1.0)
    assert image[:18, :, 0].min() == 255
    assert image[18:].max() < 30
    assert saturated_share(image) == pytest.approx(18 / 360 / 3)


def test_same_stream_same_bits():
    cfg = ImagingCfg()
    images = []
    for seed in (3, 3, 4):
        sensor = Sensor(64, 48, cfg)
        sensor.reset(np.random.default_rng(seed))
        images.append([sensor.expose(flat(500.0, (48, 64)), 1.0) for _ in range(3)])
    assert all(np.array_equal(a, b) for a, b in zip(images[0], images[1], strict=True))
    assert not np.array_equal(images[0][0], images[2][0])
    assert not np.array_equal(images[0][0], images[0][1])


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: replace(ImagingCfg(), encoding="log"), "encoding"),
        (lambda: ImagingCfg(full_well_e=0.0), "full_well_e"),
        (lambda: ImagingCfg(lamp_spill=1.5), "lamp_spill"),
        (lambda: ImagingCfg(read_noise_e=float("nan")), "read_noise_e"),
        (lambda: ExposureCfg(saturated_share=0.0), "saturated_share"),
        (lambda: ExposureCfg(max_step=1.0), "max_step"),
        (lambda: ExposureCfg(min_s=1.0), "min_s"),
        (lambda: ExposureCfg(max_gain=0.5), "max_gain"),
    ],
)
def test_impossible_settings_are_refused(make, field):
    with pytest.raises(ConfigError) as caught:
        make()
    assert caught.value.field == field
