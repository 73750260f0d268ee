"""How much dead reckoning by an old velocity is doubted."""

from __future__ import annotations

import numpy as np

from auvdock.numeric.motion import stale_walk_m2_s
from auvdock.sim.dvl import Dvl, DvlCfg


def test_a_fresh_velocity_adds_nothing_and_an_older_one_more() -> None:
    variances = [stale_walk_m2_s(age) for age in (0.0, 0.1, 0.5, 1.0, 5.0)]
    assert variances[0] == 0.0
    assert variances == sorted(variances)
    assert stale_walk_m2_s(5.0) == stale_walk_m2_s(50.0)


def test_a_swaying_vehicle_with_a_patchy_log_is_where_it_is_believed() -> None:
    """0.1 m/s of sway at 1.5 rad/s by a log that loses a third of its pings: the mean squared error after 20 s of 400
    ways is no more than the variance that is believed, and no less than a twentieth of it."""
    rng, squared, believed = np.random.default_rng(0), [], []
    dt_s, still = 1.0 / 30.0, np.zeros(3)
    for seed in range(400):
        log = Dvl(DvlCfg(ping_period_s=0.115, lost_share=0.33))
        log.reset(np.random.default_rng(seed))
        phase, error_m, variance_m2 = rng.uniform(0.0, 2.0 * np.pi), 0.0, 0.0
        for k in range(600):
            speed_m_s = 0.1 * np.sin(1.5 * k * dt_s + phase)
            reading = log.sample(k * dt_s, 3.0, still, np.array([speed_m_s, 0.0, 0.0]), still)
            error_m += (reading.ground_m_s[0] - speed_m_s) * dt_s
            variance_m2 += stale_walk_m2_s(reading.ground_age_s) * dt_s
        squared.append(error_m**2)
        believed.append(variance_m2)
    assert 0.05 < np.mean(squared) / np.mean(believed) < 1.0
