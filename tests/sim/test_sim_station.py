"""The station as solid geometry: its surfaces, and vehicles that slide along them into the latch."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from sim_bench import REMUS, STATION, command, run, simulator, start, state

from auvdock.core.arrays import Array
from auvdock.sim.docks import make_dock
from auvdock.sim.mj import mujoco
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.scene import scene_xml
from auvdock.sim.simulator import Simulator
from auvdock.sim.station_geometry import STAVES, TUBE_STAVES, inner_radius_m

DEPTH = STATION.depth_m
FUNNEL = STATION.funnel


def radius_hit(sim: Simulator, x: float, azimuth: float) -> float:
    """Distance from the tube's axis to the first surface, along a radius."""
    geom = np.zeros(1, dtype=np.int32)
    group = np.array([0, 1, 0, 0, 0, 0], dtype=np.uint8)
    direction = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
    origin = np.array([x, 0.0, -DEPTH])
    return float(mujoco.mj_ray(sim.model, sim.data, origin, direction, group, 1, -1, geom, None))


def test_inner_surface_is_the_stated_cone_and_tube() -> None:
    """Rays from the axis meet the wall at the stated radius or up to 0.9 % (cone) and 2 % (tube) further out."""
    station = dataclasses.replace(STATION, beacons=())
    sim = simulator(REMUS, station)
    start(sim, (30.0, 0.0, -DEPTH))
    rng = np.random.default_rng(0)
    for _ in range(400):
        x = -float(rng.uniform(0.01, 0.99)) * FUNNEL.length_m
        ratio = radius_hit(sim, x, float(rng.uniform(0.0, 2.0 * math.pi))) / inner_radius_m(station, x)
        assert 1.0 - 1e-9 <= ratio <= 1.0 / math.cos(math.pi / STAVES) + 1e-9
        x = -FUNNEL.length_m - float(rng.uniform(0.01, 0.99)) * FUNNEL.tube_length_m
        ratio = radius_hit(sim, x, float(rng.uniform(0.0, 2.0 * math.pi))) / FUNNEL.tube_radius_m
        assert 1.0 - 1e-9 <= ratio <= 1.0 / math.cos(math.pi / TUBE_STAVES) + 1e-9


def test_every_element_of_the_scene_is_named_and_the_lamps_are_where_the_layout_says() -> None:
    sim = simulator(REMUS, STATION)
    model = sim.model
    for kind, count in (
        (mujoco.mjtObj.mjOBJ_GEOM, model.ngeom),
        (mujoco.mjtObj.mjOBJ_BODY, model.nbody),
        (mujoco.mjtObj.mjOBJ_JOINT, model.njnt),
        (mujoco.mjtObj.mjOBJ_CAMERA, model.ncam),
        (mujoco.mjtObj.mjOBJ_LIGHT, model.nlight),
        (mujoco.mjtObj.mjOBJ_EQUALITY, model.neq),
        (mujoco.mjtObj.mjOBJ_MATERIAL, model.nmat),
    ):
        assert all(mujoco.mj_id2name(model, kind, index) for index in range(count))
    for beacon in STATION.layout.beacons:
        lamp = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"lamp_{beacon.name}")
        np.testing.assert_allclose(model.geom_pos[lamp], np.array(beacon.position_m) - [0.0, 0.0, DEPTH], atol=1e-9)
        assert model.geom_contype[lamp] == 0


def test_compiled_vehicle_has_the_published_mass_matrix() -> None:
    """MuJoCo's own M at the identity pose equals M_RB (1e-9), with cameras where the data puts them."""
    sim = simulator(REMUS, STATION)
    start(sim, (20.0, 0.0, -DEPTH))
    dense = np.zeros((sim.model.nv, sim.model.nv))
    mujoco.mj_fullM(sim.model, sim.data, dense)
    np.testing.assert_allclose(dense, REMUS.rigid_body_mass_body, atol=1e-9)
    bow = mujoco.mj_name2id(sim.model, mujoco.mjtObj.mjOBJ_CAMERA, "bow")
    look = -sim.data.cam_xmat[bow].reshape(3, 3)[:, 2]
    np.testing.assert_allclose(look, [1.0, 0.0, 0.0], atol=1e-9)
    belly = mujoco.mj_name2id(sim.model, mujoco.mjtObj.mjOBJ_CAMERA, "belly")
    np.testing.assert_allclose(-sim.data.cam_xmat[belly].reshape(3, 3)[:, 2], [0.0, 0.0, -1.0], atol=1e-9)


def test_scene_is_text_that_depends_on_its_inputs_only() -> None:
    first, second = (scene_xml(REMUS, make_dock(STATION, REMUS), 1.0 / 120.0) for _ in range(2))
    assert first == second


def hull_clearance_m(sim: Simulator) -> float:
    """Least gap between the hull's capsule and the stated surfaces, from geometry alone (negative: penetration)."""
    pose = sim.truth.T_world_body
    worst = math.inf
    for along in np.linspace(REMUS.tail_x_m + REMUS.radius_m, REMUS.nose_x_m - REMUS.radius_m, 60):
        x, y, z = pose[:3, 3] + along * pose[:3, 0] + [0.0, 0.0, DEPTH]
        if -FUNNEL.length_m - FUNNEL.tube_length_m < x < 0.0:
            worst = min(worst, inner_radius_m(STATION, x) - math.hypot(y, z) - REMUS.radius_m)
    return worst


ENTRIES = [
    (0.5, 0.0, 0.0, 0.0),
    (0.5, 0.4, 0.0, 10.0),
    (0.5, 0.4, 0.0, -10.0),
    (0.5, -0.4, 0.2, 10.0),
    (0.5, 0.0, 0.4, -5.0),
    (0.5, 0.7, 0.3, 0.0),
    (1.0, 0.4, 0.0, -10.0),
    (1.0, -0.4, -0.2, 10.0),
    (1.0, 0.6, 0.0, 10.0),
]


@pytest.mark.parametrize(("speed", "lateral", "vertical", "yaw_deg"), ENTRIES)
def test_funnel_catches_an_unsteered_vehicle(speed: float, lateral: float, vertical: float, yaw_deg: float) -> None:
    """Under 4 N of push the nose passes the throat within 30 s, with no penetration beyond 1 cm (8 mm a step at 1 m/s)
    and no contact force beyond 2.5 kN (31 kg stopped from 1 m/s in two steps would be 1.9 kN)."""
    sim = simulator(REMUS, STATION)
    euler = (0.0, 0.0, 180.0 + yaw_deg)
    start(sim, (1.2, lateral, vertical - DEPTH), euler, np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(30 * 30):
        run(sim, 1.0 / 30.0, command(sim, stern=0.4))
        assert hull_clearance_m(sim) > -0.01
        if sim.truth.latched:
            break
    truth = sim.truth
    assert truth.latched
    assert truth.nose_station_m[0] < -FUNNEL.length_m - STATION.latch.depth_m + 0.01
    assert truth.entry_speed_m_s is not None
    assert truth.entry_lateral_m is not None
    assert truth.entry_vertical_m is not None
    assert math.hypot(truth.entry_lateral_m, truth.entry_vertical_m) <= FUNNEL.tube_radius_m
    assert truth.peak_contact_force_n < 2500.0
    assert not truth.diverged


def test_a_vehicle_beside_the_mouth_is_not_caught() -> None:
    sim = simulator(REMUS, STATION)
    start(sim, (1.2, 1.5, -DEPTH), (0.0, 0.0, 180.0), np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run(sim, 12.0, command(sim, stern=0.2))
    truth = sim.truth
    assert truth.nose_station_m[0] < -FUNNEL.length_m
    assert truth.entry_speed_m_s is None
    assert not truth.latched


def docked_run() -> Simulator:
    sim = simulator(REMUS, STATION)
    start(sim, (0.8, 0.02, -DEPTH), (0.0, 0.0, 180.0), np.array([0.4, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(120 * 10):
        sim.step(command(sim, stern=0.1))
        if sim.truth.latched:
            break
    return sim


def test_latch_holds_against_full_thrust_astern() -> None:
    """Docked after `hold_s`; then 10 N astern for 10 s moves the nose by less than 1 cm."""
    sim = docked_run()
    assert sim.truth.latched
    assert not sim.truth.docked
    run(sim, STATION.latch.hold_s + 0.02, command(sim))
    assert sim.truth.docked
    run(sim, 2.0, command(sim))
    before = sim.truth.nose_station_m.copy()
    run(sim, 10.0, command(sim, stern=-1.0, fore_lateral=1.0))
    assert np.linalg.norm(sim.truth.nose_station_m - before) < 0.01
    assert sim.truth.docked


def test_latch_stops_the_vehicle_gently() -> None:
    """0.4 m/s is taken off over more than 3 cm: less than 31 kg × 0.4 m/s over 20 ms."""
    sim = docked_run()
    run(sim, 1.0, command(sim))
    assert 0.0 < sim.truth.peak_contact_force_n < 31.4 * 0.5 / 0.02


def test_truth_agrees_with_its_own_geometry() -> None:
    sim = simulator(REMUS, STATION)
    start(sim, (12.0, -2.0, -7.0), (3.0, -6.0, 170.0), np.array([0.5, 0.1, 0.0, 0.0, 0.02, 0.05]))
    path = 0.0
    last: Array = sim.truth.T_world_body[:3, 3]
    for _ in range(120):
        sim.step(command(sim, stern=0.5, aft_lateral=0.4))
        now = sim.truth.T_world_body[:3, 3]
        path += float(np.linalg.norm(now - last))
        last = now
    truth = sim.truth
    nose = truth.T_world_body @ np.array([REMUS.nose_x_m, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(truth.nose_station_m, (np.linalg.inv(sim.T_world_station) @ nose)[:3], atol=1e-12)
    assert math.cos(truth.axis_angle_rad) == pytest.approx(-truth.T_world_body[0, 0], abs=1e-12)
    assert truth.path_length_m == pytest.approx(path, rel=0.01)
    assert truth.time_s == pytest.approx(1.0)
    assert truth.energy_j > 0.0
    assert not truth.touching_station


def test_data_shows_the_present_pose() -> None:
    """Poses for the renderer are those of the state, not of the step before (1e-12)."""
    sim = simulator(REMUS, STATION)
    start(sim, (5.0, 0.0, -DEPTH), (0.0, 0.0, 180.0), np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.3]))
    run(sim, 0.5, command(sim, stern=1.0))
    body = mujoco.mj_name2id(sim.model, mujoco.mjtObj.mjOBJ_BODY, "vehicle")
    np.testing.assert_allclose(sim.data.xpos[body], sim.truth.T_world_body[:3, 3], atol=1e-12)
    np.testing.assert_allclose(sim.data.xmat[body].reshape(3, 3), sim.truth.T_world_body[:3, :3], atol=1e-12)


def test_looking_at_the_state_does_not_change_the_run() -> None:
    looked, alone = simulator(REMUS, STATION), simulator(REMUS, STATION)
    for sim in (looked, alone):
        start(sim, (2.0, 0.3, -DEPTH), (0.0, 0.0, 175.0), np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(600):
        for sim in (looked, alone):
            sim.step(command(sim, stern=0.5))
        assert looked.data.time >= 0.0
        assert looked.truth.time_s > 0.0
    assert np.array_equal(state(looked), state(alone))


@pytest.mark.parametrize("seed", range(3))
def test_steps_made_at_once_are_the_steps_made_one_by_one(seed: int) -> None:
    """Through the mouth, along the wall and into the latch in gusts: every bit, the entry and the history alike."""
    gusts = CurrentCfg(0.02, 90.0, gust_std_m_s=0.01)
    at_once, one_by_one = simulator(REMUS, STATION, gusts), simulator(REMUS, STATION, gusts)
    for sim in (at_once, one_by_one):
        start(sim, (1.5, 0.12, -DEPTH), (0.0, 0.0, 180.0), np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]), seed)
    for _ in range(450):
        at_once.step(command(at_once, stern=0.4), 4)
        for _ in range(4):
            one_by_one.step(command(one_by_one, stern=0.4))
        assert np.array_equal(state(at_once), state(one_by_one))
    one, other = at_once.truth, one_by_one.truth
    assert one.peak_contact_force_n == other.peak_contact_force_n > 0.0
    assert (one.entry_speed_m_s, one.energy_j, one.docked) == (other.entry_speed_m_s, other.energy_j, other.docked)
    assert one.docked
    assert at_once.history == one_by_one.history
