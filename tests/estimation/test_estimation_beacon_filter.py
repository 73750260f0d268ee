"""The beacon filter: honest about range before motion, right about it after, deaf to outliers, whatever the datum."""

import math

import numpy as np
import pytest

from auvdock.core.errors import ConfigError
from auvdock.estimation.beacon_filter import BeaconFilter, BeaconFilterCfg, Sighting

CFG = BeaconFilterCfg()
DT_S = 1.0 / 30.0
FILTER = BeaconFilter(CFG, DT_S)


def sighting(offset_m, psi, rng=None, azimuth_sigma=0.01, bearing_sigma=0.005, late_m=(0.0, 0.0)):
    """A fix of a beacon at an offset in compass axes whose station's axis points along psi; noise if there is rng."""
    noise = rng.standard_normal(2) if rng is not None else np.zeros(2)
    bearing = math.atan2(offset_m[1] + late_m[1], offset_m[0] + late_m[0])
    azimuth = math.remainder(bearing + math.pi - psi, math.tau)
    return Sighting(
        bearing + bearing_sigma * float(noise[0]),
        0.0,
        azimuth + azimuth_sigma * float(noise[1]),
        azimuth_sigma,
        6.4,
        late_m,
    )


def sail(offset_m, psi, velocity_m_s, turns, rng, period_s=2.0):
    """Fixes every turn while the vehicle moves; yields the state and the true offset after each."""
    offset = np.array(offset_m, dtype=float)
    state = FILTER.start(sighting(offset, psi, rng))
    assert state is not None
    yield state, offset
    for _ in range(turns):
        for _ in range(round(period_s / DT_S)):
            walked = velocity_m_s + 0.003 * rng.standard_normal(2)
            state = FILTER.predict(state, (float(walked[0]), float(walked[1])))
            offset = offset - np.array(velocity_m_s) * DT_S
        state = FILTER.update(state, sighting(offset, psi, rng))
        yield state, offset


def test_one_sight_gives_direction_and_axis_but_no_range():
    state = FILTER.start(sighting((-12.0, 20.0), 0.7))
    assert state is not None
    assert state.bearing_rad == pytest.approx(math.atan2(20.0, -12.0))
    assert state.axis_yaw_rad == pytest.approx(0.7)
    ranges = sorted(math.hypot(h.mean[0], h.mean[1]) for h in state.bank)
    assert ranges[0] < 8.0
    assert ranges[-1] > 55.0
    assert state.range_sigma_m > 0.6 * state.range_m


@pytest.mark.parametrize("range_m", [20.0, 32.0, 45.0])
@pytest.mark.parametrize("psi", [-3.1, 0.4, 3.1])
def test_motion_across_the_line_of_sight_shows_the_range(range_m, psi):
    rng = np.random.default_rng(3)
    velocity = (0.6 * math.cos(0.9), 0.6 * math.sin(0.9))
    states = list(sail((range_m * math.cos(-0.6), range_m * math.sin(-0.6)), psi, np.array(velocity), 20, rng))
    state, offset = states[-1]
    assert math.dist(state.offset_m, offset) < 0.08 * range_m
    assert state.range_sigma_m < 0.08 * range_m
    assert abs(math.remainder(state.axis_yaw_rad - psi, math.tau)) < 0.02
    sigmas = [s.range_sigma_m for s, _ in states]
    assert sigmas[0] > sigmas[5] > sigmas[-1]


def test_motion_along_the_line_of_sight_does_not():
    rng = np.random.default_rng(3)
    state, _ = list(sail((40.0, 0.0), 0.0, np.array([0.6, 0.0]), 10, rng))[-1]
    assert state.range_sigma_m > 0.3 * state.range_m


def test_error_is_as_great_as_the_filter_says():
    """Normalised squared error over 60 voyages: mean 3 by χ² with 3 degrees of freedom; 95 % of its mean within ±0.63.

    The stated floors make the filter more cautious than this noise, so the bound is on one side.
    """
    squares = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        heading = rng.uniform(-math.pi, math.pi)
        start = rng.uniform(20.0, 45.0) * np.array([math.cos(heading), math.sin(heading)])
        across = 0.7 * np.array([-math.sin(heading - 0.5), math.cos(heading - 0.5)])
        psi = rng.uniform(-math.pi, math.pi)
        state, offset = list(sail(start, psi, across, 12, rng))[-1]
        gap = np.array([*(np.array(state.offset_m) - offset), math.remainder(state.axis_yaw_rad - psi, math.tau)])
        squares.append(float(gap @ np.linalg.solve(state.covariance, gap)))
    assert np.mean(squares) < 3.63
    assert np.mean(squares) > 0.3


def test_a_fix_that_tells_of_the_past_is_brought_to_the_present():
    psi, offset = 0.3, np.array([0.0, 25.0])
    state = FILTER.place((0.0, 25.0), psi, 6.4, 0.5)
    for _ in range(60):
        state = FILTER.predict(state, (0.9, 0.0))
    now = offset - [1.8, 0.0]
    late = FILTER.update(state, sighting(now, psi, late_m=(0.45, 0.0)))
    assert math.dist(late.offset_m, now) < 1e-6
    assert late.fixes == state.fixes + 1


def test_outliers_are_refused_until_they_are_the_rule():
    psi = 0.3
    state = FILTER.place((0.0, 25.0), psi, 6.4, 0.5)
    wrong = sighting((0.0, 25.0), psi + 1.0, azimuth_sigma=0.015)
    for count in range(1, CFG.restart_after):
        state = FILTER.update(state, wrong)
        assert state.refused == count
        assert state.axis_yaw_rad == pytest.approx(psi)
    state = FILTER.update(state, wrong)
    assert state.restarts == 1
    assert state.axis_yaw_rad == pytest.approx(psi + 1.0)


def test_fine_fixes_overrule_coarse_ones_sooner():
    psi = 0.3
    state = FILTER.start(sighting((0.0, 30.0), psi + 0.3, azimuth_sigma=0.03))
    assert state is not None
    for _ in range(3):
        state = FILTER.update(state, sighting((0.0, 30.0), psi + 0.3, azimuth_sigma=0.03))
    state = FILTER.update(state, sighting((0.0, 30.0), psi, azimuth_sigma=0.003))
    assert state.axis_yaw_rad == pytest.approx(psi + 0.3, abs=0.01)
    state = FILTER.update(state, sighting((0.0, 30.0), psi, azimuth_sigma=0.003))
    assert state.axis_yaw_rad == pytest.approx(psi, abs=0.01)


def test_rubbish_changes_nothing():
    state = FILTER.place((0.0, 25.0), 0.3, 6.4, 0.5)
    bad = sighting((0.0, 25.0), 0.3)._replace(azimuth_rad=math.nan)
    assert FILTER.update(state, bad) is state
    assert FILTER.start(bad) is None


def test_depth_of_the_beacon_comes_from_its_elevation():
    state = FILTER.place((30.0, 0.0), 0.0, 8.0, 2.0)
    for _ in range(8):
        look = sighting((30.0, 0.0), 0.0)._replace(elevation_rad=math.atan2(1.6, 30.0), depth_m=8.0)
        state = FILTER.update(state, look)
    assert state.beacon_depth_m == pytest.approx(6.4, abs=0.1)


def test_configuration_refuses_nonsense():
    with pytest.raises(ConfigError, match="min_range_m"):
        BeaconFilterCfg(min_range_m=80.0)
    with pytest.raises(ConfigError, match="bearing_floor_rad"):
        BeaconFilterCfg(bearing_floor_rad=0.0)


def test_a_way_by_old_velocities_is_doubted_until_the_next_fix():
    state = FILTER.start(sighting((20.0, 0.0), 0.0))
    assert state is not None
    fresh = stale = state
    for _ in range(60):
        fresh, stale = FILTER.predict(fresh, (0.5, 0.0)), FILTER.predict(stale, (0.5, 0.0), 0.5)
    assert fresh.stale_m2 == 0.0
    assert stale.stale_m2 == pytest.approx(60 * DT_S * 2.0 * 0.075**2 * 0.5)
    fix = sighting((20.0 - 30.0 * DT_S, 0.0), 0.0)
    assert FILTER.update(stale, fix).stale_m2 == 0.0
    assert FILTER.update(stale, fix).cross_sigma_m >= FILTER.update(fresh, fix).cross_sigma_m
