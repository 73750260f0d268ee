"""A bench for the controllers: the simulator behind quiet sensors, an ideal eye, and a mirror."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import Bearing, Detections, Percept, PoseEstimate, Proprioception
from auvdock.core.marine import flip_vector
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import invert, make_transform, quat_wxyz_from_euler_zyx
from auvdock.core.vehicle import load_vehicle
from auvdock.sim.ocean import CurrentCfg
from auvdock.sim.sensors import SensorCfg
from auvdock.sim.simulator import SimCfg, Simulator

VEHICLE = load_vehicle("remus_hybrid")
STATION = load_conical_station()
CAMERA = make_camera(
    CameraCfg(),
    flip_vector(np.array(VEHICLE.bow_camera.position_m)),
    flip_vector(np.array(VEHICLE.bow_camera.direction)),
    flip_vector(np.array(VEHICLE.bow_camera.up)),
)
DT_S = 1.0 / 30.0
MOUTH_WORLD_M = np.array([0.0, 0.0, -STATION.depth_m])


class Boat:
    """The simulator behind noiseless sensors, far from the station and heading away from it unless told otherwise."""

    def __init__(self, yaw_rad=0.0, current_m_s=0.0, direction_deg=0.0, position_m=(30.0, 0.0, -8.0)):
        none: dict[str, Any] = {field.name: 0.0 for field in dataclasses.fields(SensorCfg) if field.name != "dvl"}
        quiet = SensorCfg(**none)
        self.simulator = Simulator(SimCfg(sensors=quiet), STATION)
        self.simulator.reset(
            np.array(position_m),
            quat_wxyz_from_euler_zyx(0.0, 0.0, yaw_rad),
            np.random.default_rng(0),
            CurrentCfg(speed_m_s=current_m_s, direction_deg=direction_deg),
        )

    @property
    def T_world_body(self):
        return self.simulator.truth.T_world_body

    def step(self, values):
        for _ in range(4):
            self.simulator.step(values)

    def senses(self):
        return self.simulator.proprioception()


def look(T_world_body, time_s, rng=None, pose_range_m=12.0, red_range_m=5.0):
    """Percept of an eye that sees every lamp in view within range, with noise if there is a generator."""
    T_station_camera = make_transform(np.eye(3), -MOUTH_WORLD_M) @ T_world_body @ CAMERA.T_body_camera
    T_camera_station = invert(T_station_camera)
    layout = STATION.layout
    points = layout.positions_m @ T_camera_station[:3, :3].T + T_camera_station[:3, 3]
    lit = ((T_station_camera[:3, 3] - layout.positions_m) * layout.axes).sum(axis=1) > 0.0
    seen = CAMERA.in_view(points) & lit
    noise = rng.standard_normal if rng is not None else np.zeros

    def bearing(point, range_m=None):
        ray = point / np.linalg.norm(point) + 0.003 * noise(3)
        return Bearing(ray / np.linalg.norm(ray), np.zeros(2), 0.9, range_m)

    array = [i for i in layout.indices("array") if seen[i] and np.linalg.norm(points[i]) < pose_range_m]
    pose = None
    if len(array) >= 4:
        distance = float(np.linalg.norm(points[array].mean(axis=0)))
        sigma = np.array([*[0.005 + 0.001 * distance**2] * 3, 0.02, 0.02, 0.01])
        error = sigma * noise(6)
        turn = np.array([[0, -error[5], error[4]], [error[5], 0, -error[3]], [-error[4], error[3], 0]])
        T = T_station_camera.copy()
        T[:3, 3] += error[:3]
        T[:3, :3] = T[:3, :3] @ (np.eye(3) + turn + turn @ turn / 2.0)
        pose = PoseEstimate(T, np.diag(sigma**2), tuple(range(len(array))), "bench", 0.5)
    far = layout.indices("long_range")[0]
    long_range = bearing(points[far]) if seen[far] else None
    if pose is not None:
        centre = T_camera_station[:3, 3]
        long_range = bearing(centre, float(np.linalg.norm(centre)))
    red = [i for i in layout.indices("entrance") if seen[i] and np.linalg.norm(points[i]) < red_range_m]
    entrance = bearing(points[red].mean(axis=0)) if red else None
    return Percept(time_s, pose, long_range, entrance, len(array), Detections.empty())


def mirror_senses(senses):
    """The same vehicle seen in a mirror that swaps port and starboard."""
    keep = np.array([1.0, -1.0, 1.0])
    return Proprioception(
        senses.time_s,
        senses.depth_m,
        senses.euler_zyx_rad * np.array([-1.0, 1.0, -1.0]),
        senses.angular_velocity_rad_s * np.array([-1.0, 1.0, -1.0]),
        senses.velocity_ground_m_s * keep,
        senses.velocity_water_m_s * keep,
        senses.contact,
        senses.latched,
    )


def mirror_percept(percept):
    """What the mirrored vehicle sees of the mirrored station."""

    def flip(bearing):
        if bearing is None:
            return None
        return Bearing(
            bearing.ray_camera * np.array([-1.0, 1.0, 1.0]), bearing.centre_px, bearing.score, bearing.range_m
        )

    pose = percept.pose
    if pose is not None:
        station, camera = np.diag([1.0, -1.0, 1.0, 1.0]), np.diag([-1.0, 1.0, 1.0, 1.0])
        signs = np.array([1.0, -1.0, 1.0, 1.0, -1.0, -1.0])
        pose = PoseEstimate(
            station @ pose.T_station_camera @ camera,
            pose.covariance * np.outer(signs, signs),
            pose.beacon_ids,
            pose.solver,
            pose.reprojection_error_px,
            pose.measured,
        )
    return Percept(
        percept.time_s, pose, flip(percept.long_range), flip(percept.entrance), percept.array_count, percept.detections
    )


def mirror_commands(values):
    """Commands of the mirrored vehicle: lateral thrusters and rudder change sign."""
    sideways = np.array([name in ("fore_lateral", "aft_lateral", "rudder") for name in VEHICLE.actuator_names])
    return np.where(sideways, -values, values)
