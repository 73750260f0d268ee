"""The landing station as solid geometry, its latch, and both vehicles that come down on it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from sim_bench import run, start, trimmed

from auvdock.core.arrays import Array
from auvdock.core.errors import ConfigError
from auvdock.core.landing_station import LandingLatchCfg, load_landing_station
from auvdock.core.marine import flip_vector
from auvdock.core.vehicle import HullPartCfg, load_vehicle
from auvdock.sim.landing_geometry import guide_apex_m
from auvdock.sim.landing_latch import LandingLatch, Posture
from auvdock.sim.mj import mujoco
from auvdock.sim.simulator import SimCfg, Simulator

STATION = load_landing_station()
GUIDE, LATCH = STATION.guide, STATION.latch
OPEN = dataclasses.replace(STATION, latch=dataclasses.replace(LATCH, max_speed_m_s=1e-12))
"""The same station with an arm that never closes."""
VEHICLES = ("remus_hybrid", "bluerov2_heavy")


def above(name: str, up_m: float, along_m: float = 0.0, across_m: float = 0.0, yaw_deg: float = 0.0, station=STATION):
    """A simulator whose vehicle's seat is that far from its place, at rest."""
    sim = Simulator(SimCfg(vehicle=name), station)
    height = GUIDE.seat_height_m - float(sim.vehicle.seat_body_m[2]) - STATION.depth_m + up_m
    start(sim, (along_m, across_m, height), (0.0, 0.0, yaw_deg))
    return sim


def thrust_down(sim: Simulator, force_n: float) -> Array:
    """The command of least norm for a downward force."""
    thrusters = [actuator.kind == "thruster" for actuator in sim.vehicle.actuators]
    wrenches = sim.vehicle.thruster_wrenches_body * np.array(thrusters)
    efforts = np.linalg.pinv(wrenches) @ np.array([0.0, 0.0, -force_n, 0.0, 0.0, 0.0])
    curves = [sim.vehicle.curve(actuator) for actuator in sim.vehicle.actuators]
    return np.array([e if curve is None else curve.command_for(e) for e, curve in zip(efforts, curves, strict=True)])


def descend(sim: Simulator, force_n: float, seconds: float) -> bool:
    values = thrust_down(sim, force_n)
    for _ in range(round(seconds * 120)):
        sim.step(values)
        if sim.truth.docked:
            return True
    return False


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize(("along", "across", "yaw_deg"), [(0.03, 0.05, 0.0), (-0.02, -0.1, 3.0)])
def test_a_vehicle_beside_the_centre_line_slides_down_the_guides_and_is_held(
    name: str, along: float, across: float, yaw_deg: float
) -> None:
    sim = above(name, 0.3, along, across, yaw_deg)
    assert descend(sim, 12.0, 12.0)
    landing = sim.truth.landing
    assert landing is not None
    assert landing.touchdown_speed_m_s is not None
    assert 0.0 < landing.touchdown_speed_m_s < LATCH.max_touchdown_m_s
    run(sim, 3.0, np.zeros(len(sim.vehicle.actuators)))
    landing = sim.truth.landing
    assert landing is not None
    assert np.linalg.norm(landing.seat_error_m) < 0.002  # pulled tight
    assert abs(landing.heading_error_rad) < math.radians(0.1)
    assert sim.truth.docked


@pytest.mark.parametrize("name", VEHICLES)
def test_the_guides_alone_seat_the_round_where_the_data_says(name: str) -> None:
    """Without the arm, pressed down: 1 cm off along, the seat ends in the middle and at its height within 3 mm."""
    sim = above(name, 0.2, 0.01, 0.04, station=OPEN)
    descend(sim, 12.0, 8.0)
    landing = sim.truth.landing
    assert landing is not None
    np.testing.assert_allclose(landing.seat_error_m[1:], [0.0, 0.0], atol=0.003)
    assert not sim.truth.latched
    assert sim.truth.touching_station
    assert sim.proprioception().contact


@pytest.mark.parametrize("name", VEHICLES)
def test_docked_vehicle_and_its_belly_camera_are_clear_of_all_but_the_guides(name: str) -> None:
    sim = above(name, 0.0)
    camera = sim.truth.T_world_body @ np.append(flip_vector(np.array(sim.vehicle.belly_camera.position_m)), 1.0)
    model, data = sim.model, sim.data
    ball = 0.02
    for geom in range(model.ngeom):
        title = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
        if model.geom_contype[geom] == 0 or model.geom_bodyid[geom] != 0 or title == "floor":
            continue
        local = data.geom_xmat[geom].reshape(3, 3).T @ (camera[:3] - data.geom_xpos[geom])
        assert np.linalg.norm(np.maximum(np.abs(local) - model.geom_size[geom], 0.0)) > ball, title
    run(sim, 0.02, np.zeros(len(sim.vehicle.actuators)))
    for contact in sim.data.contact:
        titles = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, int(geom)) for geom in contact.geom}
        assert any(title.startswith("guide_") for title in titles), titles


def test_a_round_of_the_stated_radius_lies_on_both_plates() -> None:
    """Rays from the seat's centre along the plates' normals meet them at the seat's radius (1 µm)."""
    sim = above("remus_hybrid", 2.0)
    angle = math.radians(GUIDE.opening_half_angle_deg)
    hit = np.zeros(1, dtype=np.int32)
    for x in GUIDE.x_m:
        for sign in (1.0, -1.0):
            origin = np.array([x, 0.0, GUIDE.seat_height_m - STATION.depth_m])
            ray = np.array([0.0, sign * math.cos(angle), -math.sin(angle)])
            distance = mujoco.mj_ray(sim.model, sim.data, origin, ray, None, 1, -1, hit)
            assert distance == pytest.approx(GUIDE.seat_radius_m, abs=1e-6)
    assert guide_apex_m(GUIDE) == pytest.approx(GUIDE.seat_height_m - GUIDE.seat_radius_m * math.sqrt(2.0))


def test_tag_plate_has_the_stated_size_and_touches_nothing() -> None:
    sim = above("remus_hybrid", 2.0)
    tag = mujoco.mj_name2id(sim.model, mujoco.mjtObj.mjOBJ_GEOM, "tag")
    np.testing.assert_allclose(2.0 * sim.model.geom_size[tag][:2], STATION.tag.size_m)
    assert sim.model.geom_contype[tag] == sim.model.geom_conaffinity[tag] == 0
    assert sim.model.geom_pos[tag][2] + sim.model.geom_size[tag][2] == pytest.approx(0.001 - STATION.depth_m)


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("force_n", [8.0, 16.0])
def test_touchdown_speed_is_the_seats_downward_speed_before_the_first_contact(name: str, force_n: float) -> None:
    sim = above(name, 0.25, 0.0, 0.02, station=OPEN)
    values = thrust_down(sim, force_n)
    last_height, speed = math.nan, math.nan
    while sim.truth.landing is not None and sim.truth.landing.touchdown_time_s is None and sim.time_s < 10.0:
        height = float(sim.truth.landing.seat_error_m[2])
        last_height, speed = height, (last_height - height) * 120.0
        sim.step(values)
    landing = sim.truth.landing
    assert landing is not None
    assert landing.touchdown_speed_m_s == pytest.approx(speed, abs=0.005)  # a step's acceleration at 16 N: 4 mm/s
    assert landing.touchdown_time_s == pytest.approx(sim.time_s)
    assert landing.touchdown_force_n == pytest.approx(sim.truth.contact_force_n)


GOOD = Posture((0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
REFUSED = [
    GOOD._replace(seat_error_m=(LATCH.along_m + 0.001, 0.0, 0.0)),
    GOOD._replace(seat_error_m=(0.0, -LATCH.across_m - 0.001, 0.0)),
    GOOD._replace(seat_error_m=(0.0, 0.0, LATCH.height_m + 0.001)),
    GOOD._replace(heading_rad=-math.radians(LATCH.max_heading_deg + 0.1)),
    GOOD._replace(tilt_rad=math.radians(LATCH.max_tilt_deg + 0.1)),
    GOOD._replace(speed_m_s=LATCH.max_speed_m_s + 0.001),
]


def test_the_arm_closes_within_its_limits_only() -> None:
    latch = LandingLatch(LATCH)
    assert not latch.update(0.0, GOOD)  # nothing has touched the guides yet
    latch.touch(0.0, 0.05, 20.0)
    for index, posture in enumerate(REFUSED):
        assert not latch.update(0.01 * index, posture)
    edge = Posture((LATCH.along_m, -LATCH.across_m, LATCH.height_m), math.radians(-4.9), math.radians(9.9), 0.099)
    assert latch.update(1.0, edge)
    assert not latch.update(1.0 + LATCH.hold_s - 0.01, GOOD)
    assert not latch.docked
    latch.update(1.0 + LATCH.hold_s, REFUSED[0])  # it holds, whatever the vehicle does
    assert latch.docked


@pytest.mark.parametrize(("speed", "docked"), [(0.29, True), (0.31, False)])
def test_docked_needs_a_gentle_touchdown(speed: float, docked: bool) -> None:
    latch = LandingLatch(LandingLatchCfg())
    latch.touch(0.0, speed, 10.0)
    latch.touch(0.1, 9.0, 30.0)  # only the first contact counts
    assert latch.touchdown_speed_m_s == speed
    assert latch.touchdown_force_n == 30.0
    assert latch.update(0.2, GOOD)
    latch.update(1.0, GOOD)
    assert latch.docked is docked
    latch.reset()
    assert latch.touchdown_speed_m_s is None
    assert latch.closed_at_s is None


@pytest.mark.parametrize("name", VEHICLES)
def test_contact_gives_no_energy(name: str) -> None:
    """Thrown at the guides at 0.2 m/s with a heading error, thrusters off, the arm open: the energy in water never
    exceeds that of the throw (0.1 %), and a tenth of it at most is left of the downward part after 2 s."""
    vehicle = trimmed(load_vehicle(name))
    sim = Simulator(SimCfg(), OPEN, vehicle)
    height = GUIDE.seat_height_m - float(vehicle.seat_body_m[2]) - STATION.depth_m + 0.1
    start(sim, (0.02, 0.06, height), (0.0, 0.0, 4.0), np.array([0.05, 0.0, -0.2, 0.0, 0.0, 0.0]))
    mass = vehicle.rigid_body_mass_body + vehicle.added_mass_body
    weight_n = vehicle.mass_kg * 9.81

    def energy() -> float:
        truth = sim.truth
        gravity_z = float((truth.T_world_body @ np.append(vehicle.centre_of_gravity_body_m, 1.0))[2])
        potential = weight_n * gravity_z - vehicle.buoyancy_n * float(truth.T_world_body[2, 3])
        return 0.5 * float(truth.nu_body @ mass @ truth.nu_body) + potential

    first = energy()
    kinetic = 0.5 * mass[2, 2] * 0.2**2
    touched = False
    for _ in range(240):
        sim.step(np.zeros(len(vehicle.actuators)))
        touched = touched or sim.truth.touching_station
        assert energy() - first < 1e-3 * kinetic
    assert touched
    assert energy() - first < -0.9 * kinetic


def test_hull_parts_are_refused_if_they_are_none() -> None:
    box = HullPartCfg("x", "box", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    with pytest.raises(ConfigError, match="shape"):
        dataclasses.replace(box, shape="sphere")
    with pytest.raises(ConfigError, match="diameter"):
        HullPartCfg("x", "cylinder", (0.0, 0.0, 0.0), (1.0, 0.2, 0.3))
    (torpedo,) = load_vehicle("remus_hybrid").hull_parts
    assert torpedo.size_m[0] == pytest.approx(1.33)
