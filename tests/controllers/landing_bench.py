"""A bench for the landing pilot: either vehicle, a noisy eye behind the landing filter, and the latch's limits.

Without the station no guide helps and no platform stops the vehicle: it must come to the seat by itself.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from hover_bench import DT_S, VEHICLES, Hoverer

from auvdock.controllers.landing.config import LandingControlCfg
from auvdock.controllers.landing.pilot import LandingPilot
from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import Bearing, Detections, PoseEstimate
from auvdock.core.landing_station import load_landing_station
from auvdock.core.marine import flip_vector
from auvdock.core.transforms import invert, make_transform
from auvdock.estimation.landing.filter import LandingFilter
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.perception.landing.config import AttitudeCfg, FilterCfg
from auvdock.perception.landing.level import LevelPose

STATION = load_landing_station()
OPEN_WATER_M = np.array([30.0, 0.0, -STATION.depth_m])
CAMERA_CFG = CameraCfg(800, 600, 20.0, 50.0, 38.6)
CAMERAS = {
    name: make_camera(CAMERA_CFG, *(flip_vector(np.array(part)) for part in (m.position_m, m.direction, m.up)))
    for name, m in ((name, vehicle.belly_camera) for name, vehicle in VEHICLES.items())
}
PILOTS = {
    name: LandingPilot(LandingControlCfg(), vehicle, STATION, CAMERAS[name], DT_S) for name, vehicle in VEHICLES.items()
}


def glance_of(pose, long_range, status):
    """A percept with what the pilot reads of it."""
    return LandingPercept(0.0, pose, long_range, None, 0, Detections.empty(), status=status)


BLIND = glance_of(None, None, "searching")


def look(name, T_station_body, rng=None):
    """A pose if four lights or the whole tag are in the image, a bearing if any light is; 1 cm and 0.5° of noise."""
    camera = CAMERAS[name]
    T_station_camera = T_station_body @ camera.T_body_camera
    T_camera_station = invert(T_station_camera)

    def seen(points):
        local = points @ T_camera_station[:3, :3].T + T_camera_station[:3, 3]
        return local, camera.in_view(local)

    lights, lit = seen(STATION.layout.positions_m)
    half = 0.5 * STATION.tag.size_m
    _, tag = seen(np.array(STATION.tag.position_m) + half * np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]]))
    noise = rng.standard_normal if rng is not None else np.zeros
    pose = None
    if lit.sum() >= 4 or tag.all():
        height = float(T_station_camera[2, 3])
        sigma = np.array([0.003 * height, 0.003 * height, 0.004 * height, 0.01, 0.01, 0.009])
        error = sigma * noise(6)
        turn = np.array([[0, -error[5], error[4]], [error[5], 0, -error[3]], [-error[4], error[3], 0]])
        T = T_station_camera.copy()
        T[:3, 3] += error[:3]
        T[:3, :3] = T[:3, :3] @ (np.eye(3) + turn + turn @ turn / 2.0)
        pose = PoseEstimate(T, np.diag(sigma**2), (), "bench", 0.5)
    bearing = None
    if lit.any():
        ray = lights[lit].mean(axis=0)
        bearing = Bearing(ray / np.linalg.norm(ray), np.zeros(2), 0.9)
    return glance_of(pose, bearing, "tracking" if pose is not None else "searching")


class Eye:
    """`look` with noise, filtered as it is filtered at sea; what is not seen for 3 s is forgotten."""

    def __init__(self, name):
        self.name = name
        self.filter = LandingFilter(FilterCfg(), AttitudeCfg(), CAMERAS[name])
        self.missed = 0

    def look(self, T_station_body, senses, rng):
        glance = look(self.name, T_station_body, rng)
        self.filter.predict(senses)
        if glance.pose is not None:
            known = np.linalg.inv(glance.pose.covariance).astype(np.float64)
            level = LevelPose(glance.pose, known, np.zeros(6), np.zeros((6, 6)), np.zeros(0), 0.0)
            if self.filter.running:
                self.filter.update([self.filter.compare(level, senses)])
            else:
                self.filter.start([level], senses)
        self.missed = 0 if glance.pose is not None else self.missed + 1
        if self.missed >= 60:
            self.filter.reset()
        if not self.filter.running:
            return glance_of(None, glance.long_range, "lost" if self.missed >= 60 else "searching")
        T, covariance = self.filter.pose(senses)
        status = "tracking" if glance.pose is not None else "holding"
        return glance_of(
            PoseEstimate(T, covariance, (), "bench", 0.5, glance.pose is not None), glance.long_range, status
        )


class Lander(Hoverer):
    """A vehicle above the place of a station, latched when its seat is where the latch could reach it.

    With `solid` the station itself is there, with its own guides and latch.
    """

    def __init__(self, name, height_m=4.0, ahead_m=0.0, port_m=0.0, yaw_deg=0.0, solid=False, **more):
        self.name = name
        self.solid = solid
        self.station_m = np.array([0.0, 0.0, -STATION.depth_m]) if solid else OPEN_WATER_M
        self.vehicle = VEHICLES[name]
        self.seat_m = flip_vector(np.array(self.vehicle.seat_m))
        place = np.array([ahead_m, port_m, STATION.guide.seat_height_m + height_m])
        more["station"] = STATION if solid else None
        super().__init__(name, math.radians(yaw_deg), position_m=self.station_m + place - self.seat_m, **more)
        self.latched = False
        self.latch_works = True
        self.fastest_m_s = 0.0

    @property
    def T_station_body(self):
        return make_transform(np.eye(3), -self.station_m) @ self.T_world_body

    def offset(self):
        """The seat from its place: ξ, η, ζ in m, and ψ in rad."""
        T = self.T_station_body
        seat = T[:3, :3] @ self.seat_m + T[:3, 3]
        return np.array([seat[0], seat[1], seat[2] - STATION.guide.seat_height_m, math.atan2(T[1, 0], T[0, 0])])

    def senses(self):
        senses = super().senses()
        if self.solid:
            self.latched = senses.latched
            return senses
        latch = STATION.latch
        x, y, z, psi = self.offset()
        speed = float(np.linalg.norm(self.simulator.truth.nu_body[:3]))
        if z < 0.2:
            self.fastest_m_s = max(self.fastest_m_s, -float(self.simulator.truth.nu_body[2]))
        self.latched = self.latched or bool(
            self.latch_works
            and abs(x) < latch.along_m
            and abs(y) < latch.across_m
            and abs(z) < latch.height_m
            and abs(math.degrees(psi)) < latch.max_heading_deg
            and speed < latch.max_speed_m_s
        )
        return dataclasses.replace(senses, latched=self.latched)


def fly(lander, time_s, spoil=lambda glance, lander: glance, seed=1, pilot=None):
    """Closed loop; yields (offset, glance, command)."""
    pilot, rng = pilot or PILOTS[lander.name], np.random.default_rng(seed)
    state, eye = pilot.initial_state(), Eye(lander.name)
    for _ in range(round(time_s / DT_S)):
        senses = lander.senses()
        glance = spoil(eye.look(lander.T_station_body, senses, rng), lander)
        command, state = pilot.step(state, glance, senses)
        yield lander.offset(), glance, command
        if command.mode == "docked" or command.giving_up:
            return
        lander.step(command.values)
