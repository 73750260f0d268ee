import numpy as np
import pytest

from auvdock.core.rotating_beacon import BeaconClockCfg
from auvdock.optics.station_clock import StationClock


def test_perfect_clock_agrees():
    clock = StationClock(BeaconClockCfg(0.0, 0.0, 0.0, 0.0), np.random.default_rng(0))
    assert [clock.station_time_s(t) for t in (0.0, 1.0, 240.0)] == [0.0, 1.0, 240.0]


def test_offset_and_drift_solve_the_stated_equation():
    clock = StationClock(BeaconClockCfg(0.05, 0.001, 100.0, 0.0), np.random.default_rng(1))
    for vehicle_s in (0.0, 10.0, 300.0):
        station_s = clock.station_time_s(vehicle_s)
        assert station_s + clock.offset_s + clock.drift * station_s == pytest.approx(vehicle_s, abs=1e-12)


def test_deviations_are_the_stated_ones():
    cfg = BeaconClockCfg(0.05, 0.002, 5.0, 0.0003)
    clocks = [StationClock(cfg, np.random.default_rng(seed)) for seed in range(2000)]
    offsets, drifts = (np.array([getattr(clock, name) for clock in clocks]) for name in ("offset_s", "drift"))
    assert offsets.mean() == pytest.approx(0.05, abs=5 * 0.002 / 2000**0.5)
    assert offsets.std() == pytest.approx(0.002, rel=0.08)
    assert drifts.std() == pytest.approx(5e-6, rel=0.08)
    readings = np.array([clocks[0].station_time_s(7.0) for _ in range(2000)])
    assert readings.std() == pytest.approx(0.0003, rel=0.08)


def test_same_seed_same_times():
    first, second = (StationClock(BeaconClockCfg(), np.random.default_rng(4)) for _ in range(2))
    assert [first.station_time_s(k / 30) for k in range(9)] == [second.station_time_s(k / 30) for k in range(9)]
