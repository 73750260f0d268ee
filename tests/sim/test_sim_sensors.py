from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from sim_bench import command, simulator, start

from auvdock.core.arrays import Array
from auvdock.core.contracts import Proprioception
from auvdock.core.errors import ConfigError
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import euler_zyx_from_rotation
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.sensors import SensorCfg, Sensors
from auvdock.sim.simulator import SimCfg, Simulator

_NONE: dict[str, Any] = {name: 0.0 for name in vars(SensorCfg()) if name != "dvl"}
QUIET = SensorCfg(**_NONE)
EULER = np.array([0.02, -0.03, 3.1])
NU = np.array([0.5, 0.1, -0.05, 0.01, 0.02, 0.1])
NU_RELATIVE = np.array([0.4, 0.2, -0.05, 0.01, 0.02, 0.1])


def sample(sensors: Sensors) -> Proprioception:
    return sensors.sample(1.0, 8.0, EULER, NU, NU_RELATIVE, 0.0, False)


def stacked(sensed: Proprioception) -> Array:
    return np.concatenate(
        [
            [sensed.depth_m],
            sensed.euler_zyx_rad,
            sensed.angular_velocity_rad_s,
            sensed.velocity_ground_m_s,
            sensed.velocity_water_m_s,
        ]
    )


def test_without_noise_the_sensors_tell_the_truth() -> None:
    """All channels against the true state in a current, 1e-12."""
    sim = Simulator(SimCfg(sensors=QUIET, current=CurrentCfg(0.3, 60.0)), load_conical_station())
    start(sim, (20.0, 1.0, -6.0), (5.0, -4.0, 160.0), np.array([0.6, 0.1, 0.0, 0.02, 0.01, 0.1]))
    for _ in range(30):
        sim.step(command(sim, stern=0.5))
    truth, sensed = sim.truth, sim.proprioception()
    assert sensed.depth_m == pytest.approx(-truth.T_world_body[2, 3], abs=1e-12)
    np.testing.assert_allclose(sensed.euler_zyx_rad, euler_zyx_from_rotation(truth.T_world_body[:3, :3]), atol=1e-12)
    np.testing.assert_allclose(sensed.angular_velocity_rad_s, truth.nu_body[3:], atol=1e-12)
    np.testing.assert_allclose(sensed.velocity_ground_m_s, truth.nu_body[:3], atol=1e-12)
    np.testing.assert_allclose(sensed.velocity_water_m_s, truth.nu_relative_body[:3], atol=1e-12)
    drift = truth.T_world_body[:3, :3] @ (sensed.velocity_ground_m_s - sensed.velocity_water_m_s)
    np.testing.assert_allclose(drift, truth.current_world_m_s, atol=1e-12)


def test_noise_and_bias_have_the_stated_deviations() -> None:
    """Noise within an episode (2,000 samples) and bias between 2,000 episodes, each within 10 %."""
    cfg = dataclasses.replace(SensorCfg(), velocity_scale_error=0.0)
    sensors = Sensors(cfg)
    within = np.array([stacked(sample(sensors)) for _ in range(2000)])
    noise = [cfg.depth_noise_m, cfg.attitude_noise_rad, cfg.attitude_noise_rad, cfg.heading_noise_rad]
    noise += [cfg.gyro_noise_rad_s] * 3 + [cfg.ground_velocity_noise_m_s] * 3 + [cfg.water_velocity_noise_m_s] * 3
    np.testing.assert_allclose(within.std(axis=0), noise, rtol=0.1)
    quiet = Sensors(dataclasses.replace(QUIET, depth_bias_m=0.02, heading_bias_rad=0.01, velocity_scale_error=0.002))
    between: list[Array] = []
    for seed in range(2000):
        quiet.reset(np.random.default_rng(seed))
        first, second = stacked(sample(quiet)), stacked(sample(quiet))
        np.testing.assert_array_equal(first, second)
        between.append(first)
    spread = np.array(between).std(axis=0)
    assert spread[0] == pytest.approx(0.02, rel=0.1)
    assert spread[3] == pytest.approx(0.01, rel=0.1)
    assert spread[7] == pytest.approx(0.002 * 0.5, rel=0.1)


def test_heading_stays_wrapped() -> None:
    sensors = Sensors(dataclasses.replace(QUIET, heading_bias_rad=3.0))
    for seed in range(100):
        sensors.reset(np.random.default_rng(seed))
        assert -math.pi <= sample(sensors).euler_zyx_rad[2] <= math.pi


def test_sampling_does_not_disturb_the_water() -> None:
    """Sensors and gusts draw from generators of their own."""
    current = CurrentCfg(0.1, gust_std_m_s=0.05)
    one, two = simulator(current=current), simulator(current=current)
    for sim in (one, two):
        start(sim, seed=5)
    for _ in range(60):
        one.step(command(one))
        two.step(command(two))
        two.proprioception()
    assert np.array_equal(one.data.qpos, two.data.qpos)


def test_negative_noise_is_refused() -> None:
    with pytest.raises(ConfigError, match="heading_bias_rad"):
        SensorCfg(heading_bias_rad=-0.1)
