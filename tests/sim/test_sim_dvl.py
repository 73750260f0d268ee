"""The Doppler log: pings, lost pings and the blind zone, and what is made of them meanwhile."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from sim_bench import REMUS, command, run, start, trimmed

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.landing_station import load_landing_station
from auvdock.core.station import load_conical_station
from auvdock.core.strict import from_mapping
from auvdock.core.transforms import rotation_from_euler_zyx
from auvdock.core.vehicle import load_vehicle
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.landing_world import LandingWorld
from auvdock.episode.config import LEVELS, landing_level_cfg, level_cfg
from auvdock.sim.dvl import Dvl, DvlCfg, DvlReading
from auvdock.sim.hydrodynamics import draw_hull, make_hull
from auvdock.sim.sensors import SensorCfg
from auvdock.sim.simulator import SimCfg, Simulator

A50 = DvlCfg(ping_period_s=0.115, lost_share=0.086, blind_below_m=0.2)
LEVEL = np.zeros(3)
QUIET = dict.fromkeys((name for name in vars(SensorCfg()) if name != "dvl"), 0.0)


def log(cfg: DvlCfg = A50, seed: int = 0) -> Dvl:
    dvl = Dvl(cfg)
    dvl.reset(np.random.default_rng(seed))
    return dvl


def sample(dvl: Dvl, time_s: float, height_m: float = 3.0, ground: float = 0.5, water: float = 0.4) -> DvlReading:
    return dvl.sample(time_s, height_m, LEVEL, np.array([ground, 0.0, 0.0]), np.array([water, 0.0, 0.0]))


def test_as_many_pings_are_lost_as_in_the_pool() -> None:
    """8.6 % at 115 ms (a DVL A50 circling in a pool): 10,000 pings within three standard deviations, 0.84 points."""
    dvl = log()
    ages = np.array([sample(dvl, k * 0.115).ground_age_s for k in range(10_000)])
    assert np.mean(ages > 0.0) == pytest.approx(0.086, abs=3.0 * np.sqrt(0.086 * 0.914 / 10_000))
    # Each by itself: so are two in a row.
    assert np.mean(ages > 0.12) == pytest.approx(0.086**2, abs=0.003)


def test_between_pings_the_last_reading_is_held_and_ages() -> None:
    dvl = log(dataclasses.replace(A50, lost_share=0.0))
    readings = [sample(dvl, k / 60.0, ground=float(k)) for k in range(14)]
    ages = [reading.ground_age_s for reading in readings]
    assert ages == pytest.approx([k / 60.0 for k in range(7)] + [k / 60.0 for k in range(7)])
    assert [reading.ground_m_s[0] for reading in readings] == pytest.approx([0.0] * 7 + [7.0] * 7)


def test_near_the_floor_the_water_and_the_last_current_stand_in() -> None:
    """Below 0.2 m the ground velocity follows the water track, plus the current as last measured."""
    dvl = log(dataclasses.replace(A50, lost_share=0.0, ping_period_s=0.0))
    assert sample(dvl, 0.0, 0.21).ground_age_s == 0.0
    blind = sample(dvl, 1.0, 0.19, ground=9.0, water=0.1)
    assert blind.ground_m_s[0] == pytest.approx(0.1 + (0.5 - 0.4))
    assert (blind.ground_age_s, blind.water_age_s) == (1.0, 0.0)
    assert blind.water_m_s[0] == pytest.approx(0.1)
    assert sample(dvl, 2.0, 0.2, ground=0.3).ground_m_s[0] == 0.3


def test_what_is_held_stays_in_the_world_while_the_hull_turns() -> None:
    dvl = log(dataclasses.replace(A50, ping_period_s=100.0))
    sample(dvl, 0.0)
    turned = np.array([0.1, -0.05, 1.2])
    held = dvl.sample(1.0, 3.0, turned, np.full(3, 9.0), np.full(3, 9.0))
    np.testing.assert_allclose(rotation_from_euler_zyx(*turned) @ held.ground_m_s, [0.5, 0.0, 0.0], atol=1e-12)


def test_an_ideal_log_knows_every_reading() -> None:
    dvl = log(DvlCfg())
    for k in range(5):
        reading = sample(dvl, float(k), 0.0, ground=float(k))
        assert (reading.ground_m_s[0], reading.ground_age_s, reading.water_age_s) == (float(k), 0.0, 0.0)


@pytest.mark.parametrize("bad", [{"lost_share": 0.96}, {"ping_period_s": -0.1}, {"blind_below_m": -1.0}, {"lost": 0.1}])
def test_settings_are_strict(bad: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        from_mapping(DvlCfg, bad)


def readings(sensors: SensorCfg, seed: int = 3) -> Array:
    sim = Simulator(SimCfg(sensors=sensors), load_conical_station(), trimmed())
    start(sim, (20.0, 1.0, -6.0), seed=seed)
    rows: list[Array] = []
    for _ in range(90):
        sim.step(command(sim, stern=0.5), 4)
        said = sim.proprioception()
        rows.append(np.concatenate([[said.depth_m], said.euler_zyx_rad, said.velocity_ground_m_s, [said.ground_age_s]]))
    return np.array(rows)


def test_same_seed_same_bits_and_lost_pings_change_no_other_sensor() -> None:
    patchy = readings(SensorCfg(dvl=A50))
    np.testing.assert_array_equal(patchy, readings(SensorCfg(dvl=A50)))
    assert np.any(patchy != readings(SensorCfg(dvl=A50), seed=4))
    ideal = readings(SensorCfg())
    np.testing.assert_array_equal(patchy[:, :4], ideal[:, :4])
    fresh = patchy[:, 7] == 0.0
    assert 0.1 < fresh.mean() < 0.5
    np.testing.assert_array_equal(patchy[fresh, 4:7], ideal[fresh, 4:7])


@pytest.mark.parametrize(("x_m", "above"), [(0.0, 0.0), (0.89, 0.0), (0.91, 0.25)])
def test_the_log_looks_down_on_platform_or_floor(x_m: float, above: float) -> None:
    """Seat 0.45 m above the platform's face: the log at the keel's underside 0.3545 m; or over the floor."""
    rov = load_vehicle("bluerov2_heavy")
    blind = SensorCfg(**QUIET, dvl=DvlCfg(blind_below_m=0.3545 + above))
    station = load_landing_station()
    for offset, is_blind in ((0.001, False), (-0.001, True)):
        sim = Simulator(SimCfg(vehicle=rov.name, sensors=blind), station)
        start(sim, (x_m, 0.0, -station.depth_m + 0.45 - float(rov.seat_body_m[2]) + offset))
        sim.proprioception()
        sim.step(np.zeros(8))
        assert (sim.proprioception().ground_age_s > 0.0) is is_blind


def test_levels_from_two_on_have_the_log_of_the_pool() -> None:
    for level in LEVELS:
        for cfg in (level_cfg(level), level_cfg(level, "rotating"), landing_level_cfg(level)):
            assert cfg.world.sim.sensors.dvl == (A50 if level >= 2 else DvlCfg())
            assert (cfg.world.sim.coefficient_spread > 0.0) is (level >= 2)


def test_a_world_senses_by_it() -> None:
    sim = SimCfg(vehicle="bluerov2_heavy", sensors=SensorCfg(dvl=A50))
    world = LandingWorld(LandingWorldCfg(fidelity="beacons", sim=sim))
    world.reset(0)
    ages: list[float] = []
    for _ in range(20):
        world.step(np.zeros(8))
        ages.append(world.sense().proprioception.ground_age_s)
    assert 0.0 in ages
    assert max(ages) > 0.0


def test_drawn_hulls_spread_as_told_and_stay_physical() -> None:
    """1,000 draws: σ of ln X_uu and ln Y_uv within 10 % of the setting; M_A symmetric, positive, half as uncertain."""
    hull = make_hull(REMUS, 1.0)
    logs: list[tuple[float, float, float]] = []
    for seed in range(1000):
        draw_hull(hull, REMUS, 0.1, np.random.default_rng(seed))
        drawn: Array = hull["added_mass"][0]
        np.testing.assert_allclose(drawn, drawn.T, atol=1e-12)
        assert np.linalg.eigvalsh(drawn).min() > 0.0
        ratios = hull["quadratic_damping"][0][0, 0] / REMUS.quadratic_damping_body[0, 0]
        lifts = hull["lift_damping"][0][1, 1] / REMUS.lift_damping_body[1, 1]
        logs.append((np.log(ratios), np.log(lifts), np.log(drawn[1, 1] / REMUS.added_mass_body[1, 1])))
    assert np.std(logs, axis=0) == pytest.approx([0.1, 0.1, 0.05], rel=0.1)
    draw_hull(hull, REMUS, 0.0, np.random.default_rng(0))
    np.testing.assert_array_equal(hull["lift_damping"][0], REMUS.lift_damping_body)


def test_another_hull_flies_otherwise_and_the_same_seed_the_same() -> None:
    ends: list[list[float]] = []
    for spread, seed in ((0.0, 1), (0.1, 1), (0.1, 1), (0.1, 2)):
        sim = Simulator(SimCfg(coefficient_spread=spread), load_conical_station(), trimmed())
        start(sim, (20.0, 1.0, -6.0), seed=seed)
        run(sim, 5.0, command(sim, stern=0.5, rudder=0.3))
        ends.append(sim.data.qpos.tolist())
    assert ends[1] == ends[2]
    assert ends[0] != ends[1] != ends[3]
