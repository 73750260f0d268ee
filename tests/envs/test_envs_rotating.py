"""The rotating beacon's world and environment: starts, unknown heading, lost frames, clock."""

import dataclasses
import math

import numpy as np
import pytest

from auvdock.core.beacons import BeaconCfg
from auvdock.core.errors import ConfigError
from auvdock.core.rotating_beacon import BeaconClockCfg
from auvdock.core.transforms import euler_zyx_from_rotation
from auvdock.envs.config import StartCfg, WorldCfg, rotating_world_cfg
from auvdock.envs.world import DockingWorld, draw_start

BEACONS = dataclasses.replace(rotating_world_cfg(), fidelity="beacons")


def test_starts_fill_the_ring_with_any_heading():
    rng = np.random.default_rng(0)
    cfg = rotating_world_cfg().start
    places = np.array([draw_start(cfg, 8.0, rng)[0] for _ in range(400)])
    radius, azimuth = np.hypot(places[:, 0], places[:, 1]), np.arctan2(places[:, 1], places[:, 0])
    assert radius.min() >= 20.0
    assert radius.max() <= 45.0
    assert np.histogram(azimuth, bins=8, range=(-math.pi, math.pi))[0].min() > 25  # 50 each, 3.7 σ below
    assert np.abs(places[:, 2] + 8.0).max() <= cfg.vertical_m


def test_a_narrow_ring_looks_at_the_station():
    rng = np.random.default_rng(0)
    cfg = StartCfg(ring=True, azimuth_deg=180.0, heading_deg=0.0)
    for _ in range(10):
        place, (w, _, _, z) = draw_start(cfg, 8.0, rng)
        yaw = 2.0 * math.atan2(z, w)
        assert math.remainder(yaw - math.atan2(-place[1], -place[0]), math.tau) == pytest.approx(0.0, abs=1e-9)


def compass_error(cfg, seed):
    world = DockingWorld(cfg)
    world.reset(seed)
    own = world.sense().proprioception
    yaw = euler_zyx_from_rotation(world.truth.T_world_body[:3, :3])[2]
    return math.remainder(float(own.euler_zyx_rad[2]) - yaw, math.tau)


def test_unknown_heading_turns_the_compass_and_nothing_else():
    surveyed = dataclasses.replace(BEACONS, station_heading="surveyed")
    errors = [compass_error(BEACONS, seed) for seed in range(4)]
    assert max(abs(compass_error(surveyed, seed)) for seed in range(4)) < 0.06
    assert np.ptp(errors) > 1.0
    one, other = DockingWorld(BEACONS), DockingWorld(surveyed)
    one.reset(5)
    other.reset(5)
    assert np.array_equal(one.truth.T_world_body, other.truth.T_world_body)
    a, b = one.sense(), other.sense()
    assert a.proprioception.depth_m == b.proprioception.depth_m
    assert a.detections is not None
    assert b.detections is not None
    assert np.array_equal(a.detections.centre_px, b.detections.centre_px)


def frames(cfg, seed, periods=200):
    world = DockingWorld(cfg)
    world.reset(seed)
    seen = []
    for _ in range(periods):
        seen.append(world.sense().detections is not None)
        world.step(np.zeros(7))
    return seen


def test_lost_frames_come_at_the_stated_share_and_by_the_seed():
    lossy = dataclasses.replace(BEACONS, frame_drop_share=0.2)
    assert all(frames(BEACONS, 1, 30))
    lost = 1.0 - np.mean(frames(lossy, 1))
    assert lost == pytest.approx(0.2, abs=0.1)  # 3.5 σ of 200 draws
    assert frames(lossy, 1, 60) == frames(lossy, 1, 60) != frames(lossy, 2, 60)


def brightest_s(cfg, seed=0):
    """When the beacon was brightest within its first turn, for a vehicle right in front that looks at it."""
    start = StartCfg(ring=True, min_range_m=20.0, max_range_m=20.0, azimuth_deg=0.0, heading_deg=0.0, vertical_m=0.0)
    world = DockingWorld(dataclasses.replace(cfg, start=start))
    world.reset(seed)
    best = (0.0, 0.0)
    for _ in range(75):
        found = world.sense().detections
        now = world.truth.time_s
        if found is not None and found.flux is not None and len(found) and now > 1.0:
            best = max(best, (float(found.flux.max()), now))
        world.step(np.zeros(7))
    return best[1]


def test_clock_offset_shifts_the_sweep_by_its_own_length():
    """Vehicle time = station time + offset: a vehicle whose clock is ahead sees the beam later by its clock."""
    quiet = BeaconClockCfg(offset_std_s=0.0, drift_ppm=0.0, jitter_s=0.0)
    base = brightest_s(dataclasses.replace(BEACONS, clock=quiet))
    ahead = brightest_s(dataclasses.replace(BEACONS, clock=dataclasses.replace(quiet, offset_s=0.2)))
    assert base == pytest.approx(2.0, abs=1.0 / 30.0 + 1e-6)
    assert ahead - base == pytest.approx(0.2, abs=1.0 / 30.0 + 1e-6)


def test_extra_lights_are_seen_but_not_told():
    lamp = BeaconCfg("false", "long_range", (-1.0, 4.0, 1.2), (1.0, 0.0, 0.0), 450.0, 30.0, 0.35, 360.0)
    start = StartCfg(ring=True, min_range_m=20.0, max_range_m=20.0, azimuth_deg=0.0, heading_deg=0.0)
    cfg = dataclasses.replace(BEACONS, start=start, water="clear")
    counts = []
    for lights in ((), (lamp,)):
        world = DockingWorld(dataclasses.replace(cfg, extra_lights=lights))
        world.reset(0)
        for _ in range(20):
            world.step(np.zeros(7))
        found = world.sense().detections
        assert found is not None
        counts.append(len(found))
        assert len(world.cfg.station.layout.beacons) == 11
    assert counts[1] > counts[0]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"station_heading": "guessed"}, "station_heading"),
        ({"frame_drop_share": 1.5}, "frame_drop_share"),
    ],
)
def test_worlds_that_cannot_be_are_refused(changes, field):
    with pytest.raises(ConfigError, match=field):
        dataclasses.replace(WorldCfg(), **changes)
    with pytest.raises(ConfigError, match="azimuth_deg"):
        StartCfg(azimuth_deg=200.0)
