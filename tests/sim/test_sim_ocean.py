from __future__ import annotations

import math

import numpy as np
import pytest

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.numeric.water import advance_gust
from auvdock.sim.ocean import CurrentCfg, Ocean


def ocean(cfg: CurrentCfg, seed: int = 0, dt_s: float = 0.1) -> Ocean:
    water = Ocean(cfg, 8.0, dt_s)
    water.reset(cfg, np.random.default_rng(seed))
    return water


def step(water: Ocean, dt_s: float = 0.1) -> Array:
    """One step of the gusts; their acceleration."""
    advance_gust(water.water[0], water.noise(1)[0], dt_s)
    water.used(1)
    return water.water["gust_m_s2"][0]


@pytest.mark.parametrize(("direction_deg", "expected"), [(0.0, (0.4, 0.0)), (90.0, (0.0, 0.4)), (180.0, (-0.4, 0.0))])
def test_current_flows_to_its_direction_counter_clockwise(direction_deg: float, expected: tuple[float, float]) -> None:
    x, y, z = ocean(CurrentCfg(0.4, direction_deg)).velocity(-3.0)
    assert (x, y, z) == pytest.approx((*expected, 0.0), abs=1e-15)


def test_shear_is_linear_in_height_above_the_mouth_and_never_turns_the_current_round() -> None:
    water = ocean(CurrentCfg(0.4, shear_per_m=0.25))
    assert [water.velocity(z)[0] for z in (-8.0, -6.0, -9.0, -12.0, -30.0)] == pytest.approx([0.4, 0.6, 0.3, 0.0, 0.0])


def test_gusts_have_the_stated_deviation_and_correlation_time() -> None:
    """Gauss-Markov: deviation within 5 %, correlation e^{-1} after one time constant within 0.05, zero mean within
    four of its standard errors (16,000 s, time constant 2 s)."""
    cfg = CurrentCfg(gust_std_m_s=0.1, gust_time_constant_s=2.0)
    water = ocean(cfg, seed=1)
    samples = np.empty((160_000, 2))
    for row in samples:
        row[:] = water.velocity(-8.0)[:2]
        step(water)
    for axis in samples.T:
        assert np.std(axis) == pytest.approx(0.1, rel=0.05)
        assert np.corrcoef(axis[:-20], axis[20:])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.05)
        assert abs(axis.mean()) < 4.0 * 0.1 * math.sqrt(2.0 * 2.0 / 16_000.0)
    assert abs(np.corrcoef(samples[:, 0], samples[:, 1])[0, 1]) < 0.06


def test_gusts_start_in_their_stationary_distribution() -> None:
    """Over 2,000 seeds the first sample already has the stated deviation, within 5 %."""
    cfg = CurrentCfg(gust_std_m_s=0.1)
    first = [ocean(cfg, seed).velocity(0.0)[0] for seed in range(2000)]
    assert np.std(first) == pytest.approx(0.1, rel=0.05)


def test_reported_acceleration_is_the_change_of_velocity() -> None:
    water = ocean(CurrentCfg(0.2, gust_std_m_s=0.1), dt_s=0.01)
    for _ in range(1200):
        before = water.velocity(-8.0)
        acceleration = step(water, 0.01)
        after = water.velocity(-8.0)
        assert [(b - a) / 0.01 for a, b in zip(before, after, strict=True)][:2] == pytest.approx(acceleration, abs=1e-9)


@pytest.mark.parametrize(
    "kwargs",
    [
        {"speed_m_s": -0.1},
        {"speed_m_s": math.nan},
        {"gust_std_m_s": 50.0},
        {"gust_time_constant_s": 0.0},
        {"shear_per_m": math.inf},
    ],
)
def test_impossible_currents_are_refused(kwargs: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=next(iter(kwargs))):
        CurrentCfg(**kwargs)
