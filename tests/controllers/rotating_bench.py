"""The control bench with a rotating beacon: an ideal eye for its sweeps, and a compass whose datum is unknown."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from control_bench import CAMERA, DT_S, STATION, VEHICLE, Boat, look

from auvdock.controllers.pilot import ControlCfg
from auvdock.controllers.rotating.pilot import RotatingPilot
from auvdock.core.contracts import AzimuthFix, Bearing
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import invert

BEACON = RotatingBeaconCfg()
ROTATING_STATION = dataclasses.replace(STATION, rotating=BEACON)
PILOT = RotatingPilot(ControlCfg(), VEHICLE, ROTATING_STATION, CAMERA, DT_S)
BEACON_WORLD_M = np.array(BEACON.position_m) - np.array([0.0, 0.0, STATION.depth_m])
BODY_CENTRE_M = np.array([-1.35, 0.0])


def sweep(T_world_body, time_s, rng, azimuth_sigma_rad=0.01, visible_m=47.0, clock_s=0.0):
    """The azimuth fix of this period, if the beam has swept past the camera within it and the beacon is in view."""
    T_world_camera = T_world_body @ CAMERA.T_body_camera
    way = T_world_camera[:3, 3] - BEACON_WORLD_M
    azimuth = math.atan2(way[1], way[0])
    before, after = (BEACON.azimuth_rad(t) - azimuth for t in (time_s - DT_S, time_s))
    if not (math.remainder(before, math.tau) < 0.0 <= math.remainder(after, math.tau) < 1.0):
        return None
    point = (invert(T_world_camera) @ np.append(BEACON_WORLD_M, 1.0))[:3]
    if not CAMERA.in_view(point[None])[0] or np.linalg.norm(way) > visible_m:
        return None
    ray = point / np.linalg.norm(point) + 0.004 * rng.standard_normal(3)
    measured = math.remainder(
        azimuth + azimuth_sigma_rad * rng.standard_normal() + math.tau * BEACON.rate_rev_s * clock_s, math.tau
    )
    return AzimuthFix(time_s, measured, azimuth_sigma_rad, Bearing(ray / np.linalg.norm(ray), np.zeros(2), 0.9))


def boat_at(azimuth_deg, range_m, yaw_deg, current_m_s=0.0, direction_deg=0.0, z_m=-8.0):
    """A boat in the ring about the beacon."""
    angle = math.radians(azimuth_deg)
    place = (
        BEACON.position_m[0] + range_m * math.cos(angle),
        BEACON.position_m[1] + range_m * math.sin(angle),
        z_m,
    )
    return Boat(math.radians(yaw_deg), current_m_s, direction_deg, place)


def fly_round(boat, time_s, datum_rad=0.0, seed=1, spoil=lambda percept, time_s: percept, pilot=PILOT, clock_s=0.0):
    """Closed loop; yields (command, state after, camera in the station frame (3,))."""
    rng, state = np.random.default_rng(seed), pilot.initial_state()
    for _ in range(round(time_s / DT_S)):
        senses = boat.senses()
        yaw = math.remainder(float(senses.euler_zyx_rad[2]) + datum_rad, math.tau)
        senses = dataclasses.replace(senses, euler_zyx_rad=np.array([*senses.euler_zyx_rad[:2], yaw]))
        percept = look(boat.T_world_body, senses.time_s, rng)
        percept = dataclasses.replace(percept, azimuth=sweep(boat.T_world_body, senses.time_s, rng, clock_s=clock_s))
        command, state = pilot.step(state, spoil(percept, senses.time_s), senses)
        yield command, state, (boat.T_world_body @ CAMERA.T_body_camera)[:3, 3] + [0.0, 0.0, STATION.depth_m]
        boat.step(command.values)
        if boat.simulator.truth.docked or command.giving_up:
            return
