"""The latch's rules, divergence and pickling."""

from __future__ import annotations

import dataclasses
import math
import pickle

import numpy as np
import pytest
from sim_bench import STATION, command, run, simulator, start, state

from auvdock.core.errors import ConfigError
from auvdock.core.station import FunnelCfg, LatchCfg
from auvdock.sim.latch import Latch
from auvdock.sim.simulator import SimCfg, Simulator

THROAT = -FunnelCfg().length_m
DEEP = THROAT - LatchCfg().depth_m - 0.01


def pass_throat(latch: Latch, speed: float = 0.5, angle_deg: float = 2.0, lateral: float = 0.03) -> None:
    latch.update(0.0, (THROAT + 0.01, lateral, 0.01), speed, math.radians(angle_deg))
    latch.update(0.1, (THROAT - 0.01, lateral, 0.01), speed, math.radians(angle_deg))


def test_latch_closes_holds_and_docks() -> None:
    latch = Latch(LatchCfg(), FunnelCfg())
    pass_throat(latch)
    assert latch.entry is not None
    assert (latch.entry.speed_m_s, latch.entry.lateral_m, latch.entry.vertical_m) == (0.5, 0.03, 0.01)
    assert not latch.update(0.5, (DEEP + 0.05, 0.0, 0.0), 0.5, 0.0)
    assert latch.update(1.0, (DEEP, 0.0, 0.0), 0.5, 0.0)
    assert not latch.docked
    latch.update(1.0 + LatchCfg().hold_s - 0.01, (DEEP, 0.0, 0.0), 0.0, 0.0)
    assert not latch.docked
    latch.update(1.0 + LatchCfg().hold_s, (DEEP, 0.0, 0.0), 0.0, 0.0)
    assert latch.docked


@pytest.mark.parametrize(("speed", "angle_deg"), [(0.5, 10.5), (1.5, 0.0)])
def test_latch_stays_open_beyond_its_limits(speed: float, angle_deg: float) -> None:
    latch = Latch(LatchCfg(), FunnelCfg())
    pass_throat(latch)
    assert not latch.update(1.0, (DEEP, 0.0, 0.0), speed, math.radians(angle_deg))


@pytest.mark.parametrize(("speed", "angle_deg"), [(1.2, 0.0), (0.5, 12.0)])
def test_an_entry_beyond_the_limits_may_latch_but_is_no_success(speed: float, angle_deg: float) -> None:
    latch = Latch(LatchCfg(), FunnelCfg())
    pass_throat(latch, speed, angle_deg)
    assert latch.update(1.0, (DEEP, 0.0, 0.0), 0.5, 0.0)
    latch.update(9.0, (DEEP, 0.0, 0.0), 0.0, 0.0)
    assert not latch.docked


def test_passing_beside_the_tube_is_no_entry_and_the_last_entry_counts() -> None:
    latch = Latch(LatchCfg(), FunnelCfg())
    pass_throat(latch, lateral=0.3)
    assert latch.entry is None
    pass_throat(latch, speed=1.5)
    pass_throat(latch, speed=0.4)
    assert latch.entry is not None
    assert latch.entry.speed_m_s == 0.4


@pytest.mark.parametrize(
    ("field", "value"), [("qvel", math.nan), ("qvel", 30.0), ("qpos", 1e6), ("qpos", math.inf), ("qvel", 1e200)]
)
def test_absurd_states_freeze_the_simulator_and_leave_a_trail(field: str, value: float) -> None:
    sim = simulator()
    start(sim, nu_relative=np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run(sim, 5.0, command(sim, stern=0.3))
    sane = state(sim).copy()
    getattr(sim.data, field)[0] = value
    run(sim, 1.0, command(sim, stern=0.3))
    truth = sim.truth
    assert truth.diverged
    assert truth.time_s == pytest.approx(5.0)
    np.testing.assert_array_equal(state(sim), sane)
    assert np.all(np.isfinite(truth.nose_station_m))
    assert np.all(np.isfinite(sim.proprioception().velocity_ground_m_s))
    assert len(sim.history) == 240
    last = sim.history[-1]
    assert not (getattr(last, field)[0] == sane[0 if field == "qpos" else 7])
    assert sim.history[-2].time_s == pytest.approx(5.0 - 1.0 / 120.0)


def test_a_blow_up_within_a_step_is_caught_in_that_step() -> None:
    """A thruster of 10⁷ N: diverged, no exception, and the absurd state is the last in the history."""
    sim = simulator()
    strong = dataclasses.replace(sim.vehicle.actuators[0], max_force_n=1e7)
    sim = simulator(dataclasses.replace(sim.vehicle, actuators=(strong, *sim.vehicle.actuators[1:])))
    start(sim)
    run(sim, 1.0, command(sim, stern=1.0))
    assert sim.truth.diverged
    assert abs(sim.truth.nu_body[0]) < 10.0
    assert abs(sim.history[-1].qvel[0]) > 10.0


@pytest.mark.parametrize("place", [(186.0, 0.0, -60.0), (40.0, 0.0, -6000.0), (-9000.0, 9000.0, -3.0)])
def test_only_the_way_from_the_start_is_absurd_never_a_place(place: tuple[float, float, float]) -> None:
    sim = simulator(station=dataclasses.replace(STATION, depth_m=6000.0, floor_below_m=60.0))
    start(sim, place, nu_relative=np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run(sim, 6.0, command(sim, stern=1.0))
    assert not sim.truth.diverged
    sim.data.qpos[1] += 990.0
    run(sim, 1.0, command(sim))
    assert not sim.truth.diverged
    sim.data.qpos[1] += 20.0
    run(sim, 1.0, command(sim))
    assert sim.truth.diverged
    assert np.linalg.norm(sim.truth.T_world_body[:3, 3] - place) < 1000.0


@pytest.mark.parametrize(
    ("position", "quat"),
    [([0.0, 0.0], [1.0, 0, 0, 0]), ([math.nan, 0, 0], [1.0, 0, 0, 0]), ([0.0, 0, 0], [0.0, 0, 0, 0])],
)
def test_impossible_starts_are_refused(position: list[float], quat: list[float]) -> None:
    sim = simulator()
    with pytest.raises(ValueError):  # noqa: PT011 (three messages)
        sim.reset(np.array(position), np.array(quat), np.random.default_rng(0))


def test_unknown_vehicle_and_rate_are_refused() -> None:
    with pytest.raises(ConfigError, match="remus_hybrid"):
        Simulator(SimCfg(vehicle="nautilus"), STATION)
    with pytest.raises(ConfigError, match="physics_hz"):
        SimCfg(physics_hz=10.0)


def test_truth_cannot_be_written_to() -> None:
    sim = simulator()
    with pytest.raises(ValueError, match="read-only"):
        sim.truth.T_world_body[0, 3] = 1.0


def test_a_pickled_simulator_goes_on_where_it_was() -> None:
    sim = simulator()
    start(sim, nu_relative=np.array([0.5, 0.1, 0.0, 0.0, 0.0, 0.1]), seed=3)
    run(sim, 1.0, command(sim, stern=0.5))
    twin = pickle.loads(pickle.dumps(sim))
    for one in (sim, twin):
        run(one, 1.0, command(one, stern=0.2, rudder=0.5))
    np.testing.assert_array_equal(state(sim), state(twin))
    np.testing.assert_array_equal(sim.proprioception().euler_zyx_rad, twin.proprioception().euler_zyx_rad)
