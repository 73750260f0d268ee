"""How an episode ends beside docking: at the surface, and carried off."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from auvdock.envs.config import LimitsCfg, StartCfg, WorldCfg, rotating_world_cfg
from auvdock.envs.docking import DockingEnv
from auvdock.envs.landing_config import LandingStartCfg, LandingWorldCfg
from auvdock.envs.landing_world import LandingWorld
from auvdock.envs.world import DockingWorld
from auvdock.episode.config import EpisodeCfg
from auvdock.episode.runner import EpisodeRunner
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.simulator import SimCfg

CONICAL = WorldCfg(fidelity="beacons")
ROTATING = dataclasses.replace(rotating_world_cfg(), fidelity="beacons")
LANDING = LandingWorldCfg(fidelity="beacons")


def made(cfg):
    return LandingWorld(cfg) if isinstance(cfg, LandingWorldCfg) else DockingWorld(cfg)


def upwards(world):
    """Full thrust of whatever lifts."""
    vehicle = world.simulator.vehicle
    thrusters = np.array([actuator.kind == "thruster" for actuator in vehicle.actuators])
    return np.where(thrusters, np.sign(np.round(vehicle.thruster_wrenches_body[2], 6)), 0.0)


def flown(world, values, seed=0):
    world.reset(seed)
    while world.end is None:
        world.step(values)
    return world.end


@pytest.mark.parametrize("cfg", [CONICAL, ROTATING, LANDING], ids=["conical", "rotating", "landing"])
def test_whoever_stays_at_the_surface_has_surfaced(cfg):
    """Full upward thrust: the episode ends 5 s after the hull first broke the surface, near it."""
    world = made(cfg)
    assert flown(world, upwards(world)) == "surfaced"
    truth = world.truth
    assert 5.0 <= truth.broached_s < 5.1
    assert truth.time_s < 60.0
    assert abs(truth.T_world_body[2, 3]) < 0.5
    world.reset(1)
    assert world.end is None


def test_a_patient_limit_lets_it_float():
    world = made(dataclasses.replace(CONICAL, limits=LimitsCfg(max_time_s=25.0, surfaced_s=1e9)))
    assert flown(world, upwards(world)) == "timeout"
    assert world.truth.T_world_body[2, 3] < 0.5


def test_the_environment_terminates_at_the_surface():
    env = DockingEnv(CONICAL)
    env.reset(seed=0)
    action = upwards(env.world)
    while True:
        _, reward, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    assert (terminated, truncated) == (True, False)
    assert (info["failure_reason"], info["is_success"]) == ("surfaced", False)
    assert reward < -40.0


def test_an_episode_tells_the_reason():
    runner = EpisodeRunner(EpisodeCfg(world=CONICAL))
    step, lift = runner.world.step, upwards(runner.world)
    runner.world.step = lambda values: step(lift)
    assert runner.run(0).failure_reason == "surfaced"


@pytest.mark.parametrize("towards_station", [False, True])
def test_the_current_carries_off_whom_it_takes_away_from_the_station_not_past_it(towards_station):
    """200 m further from the station than at the start, not 200 m from anywhere: `carried_off`, a sane state."""
    current = CurrentCfg(speed_m_s=5.0, direction_deg=180.0 if towards_station else 0.0)
    start = StartCfg(min_range_m=100.0, max_range_m=100.0, lateral_m=40.0)
    world = made(dataclasses.replace(CONICAL, sim=SimCfg(current=current), start=start))
    assert flown(world, np.zeros(7), seed=3) == "carried_off"
    truth = world.truth
    assert not truth.diverged
    way = float(np.linalg.norm(truth.T_world_body[:3, 3] - world.simulator.T_world_station[:3, 3]))
    assert way == pytest.approx(300.0, abs=15.0)
    assert truth.path_length_m == pytest.approx(400.0 if towards_station else 200.0, abs=20.0)


@pytest.mark.parametrize("depth_m", [199.5, 5000.0])
@pytest.mark.parametrize("kind", ["conical", "landing"])
def test_depth_is_no_distance(kind, depth_m):
    cfg = CONICAL if kind == "conical" else dataclasses.replace(LANDING, start=LandingStartCfg(max_height_m=3.0))
    world = made(dataclasses.replace(cfg, station=dataclasses.replace(cfg.station, depth_m=depth_m)))
    world.reset(0)
    still = np.zeros(len(world.simulator.vehicle.actuators))
    for _ in range(40):
        world.step(still)
        assert world.end is None
    assert world.sense().proprioception.depth_m == pytest.approx(depth_m, abs=8.0)
