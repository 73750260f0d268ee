"""Synthetic sights of a rotating beacon: its detections with flux in a moving camera, beside other lights."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from auvdock.core.arrays import Array
from auvdock.core.camera import Camera, CameraCfg, make_camera
from auvdock.core.contracts import BLUE, AzimuthFix, Detections, Proprioception
from auvdock.core.rotating_beacon import RotatingBeaconCfg
from auvdock.core.transforms import rotation_from_euler_zyx
from auvdock.perception.rotating.config import ForwardBeaconCfg
from auvdock.perception.rotating.forward_beacon import ForwardBeacon
from auvdock.perception.rotating.profile import beam_sigma_rad, pass_profile

CAMERA: Camera = make_camera(
    CameraCfg(), np.array([0.6, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
)
BEACON = RotatingBeaconCfg()
Light = Callable[[float], float]
"""Flux of a light over time."""


@dataclass
class Scene:
    """A vehicle that moves with constant velocity and turn, a beacon at the origin of the world, other lights.

    The world's x axis is the station's approach axis; the compass reads `datum_rad` more than the yaw in the world.
    """

    position_m: tuple[float, float, float] = (25.0, 0.0, 0.0)
    yaw_rad: float | None = None
    velocity_m_s: tuple[float, float] = (0.0, 0.0)
    turn_rad_s: float = 0.0
    datum_rad: float = 0.0
    beacon_on: bool = True
    peak_flux: float = 1e5
    widening: float = 1.4
    flux_noise: float = 0.03
    faint: float = 0.02
    centre_sigma_px: float = 0.3
    clock_offset_s: float = 0.0
    drop_every: int = 0
    wander: float = 0.0
    """Shift of the spot along the beam over the beam's angle off the line of sight."""
    beacon_until_s: float = math.inf
    beacon: RotatingBeaconCfg = BEACON
    others: dict[tuple[float, float, float], Light] = field(default_factory=dict[tuple[float, float, float], Light])

    def start_yaw(self) -> float:
        """Looking at the beacon unless told otherwise."""
        return self.yaw_rad if self.yaw_rad is not None else math.atan2(-self.position_m[1], -self.position_m[0])

    def azimuth_rad(self, time_s: float) -> float:
        """True azimuth of the camera about the beacon."""
        x, y, _ = self.camera_at(time_s)[1].tolist()
        return math.atan2(y, x)

    def camera_at(self, time_s: float) -> tuple[Array, Array, float]:
        """R_world_camera, the camera's place and the true yaw."""
        yaw = self.start_yaw() + self.turn_rad_s * time_s
        body = np.array(self.position_m) + time_s * np.array([*self.velocity_m_s, 0.0])
        rotation = rotation_from_euler_zyx(0.0, 0.0, yaw)
        return rotation @ CAMERA.T_body_camera[:3, :3], body + rotation @ CAMERA.T_body_camera[:3, 3], yaw

    def frames(self, duration_s: float, rng: np.random.Generator) -> Iterator[tuple[Detections, Proprioception]]:
        """Detections and sensors, frame by frame; compass 0.2° and gyroscope 0.0005 rad/s of noise."""
        start = float(rng.uniform(0.0, 10.0))
        for k in range(round(duration_s * CAMERA.rate_hz)):
            if self.drop_every and k % self.drop_every == 2:
                continue
            time_s = k / CAMERA.rate_hz
            rotation, place, yaw = self.camera_at(time_s)
            points, flux = [np.zeros(3)], [self._beacon_flux(start + time_s, time_s)]
            for at, light in self.others.items():
                points.append(np.array(at))
                flux.append(light(time_s))
            ray = (np.array(points) - place) @ rotation
            # A measured disc takes in what lies close to its centre.
            unit = ray / np.linalg.norm(ray, axis=1, keepdims=True)
            total = (unit @ unit.T > math.cos(0.012)).astype(np.float64) @ np.array(flux)
            light_flux: Array = total * (1.0 + self.flux_noise * rng.standard_normal(len(flux)))
            found = CAMERA.in_view(ray) & (light_flux > self.faint * self.peak_flux)
            ray[0] = self._wandered(ray[0], start + time_s, time_s)
            pixels = CAMERA.project(ray[found]) + self.centre_sigma_px * rng.standard_normal((int(found.sum()), 2))
            n = len(pixels)
            detections = Detections.from_points(
                pixels, np.full(n, 0.9), np.full(n, BLUE, dtype=np.int64), flux=light_flux[found]
            )
            velocity = rotation_from_euler_zyx(0.0, 0.0, yaw).T @ np.array([*self.velocity_m_s, 0.0])
            zero = np.zeros(3)
            yield (
                detections,
                Proprioception(
                    start + time_s,
                    8.0,
                    np.array([0.0, 0.0, yaw + self.datum_rad]) + 0.0035 * rng.standard_normal(3),
                    np.array([0.0, 0.0, self.turn_rad_s]) + 0.0005 * rng.standard_normal(3),
                    velocity + 0.003 * rng.standard_normal(3),
                    zero,
                ),
            )

    def run(
        self, duration_s: float, rng: np.random.Generator, cfg: ForwardBeaconCfg | None = None
    ) -> tuple[list[tuple[AzimuthFix, float]], ForwardBeacon]:
        """All fixes with the true azimuth at their time."""
        forward = ForwardBeacon(cfg or ForwardBeaconCfg(), CAMERA, self.beacon)
        fixes: list[tuple[AzimuthFix, float]] = []
        start: float | None = None
        for detections, sample in self.frames(duration_s, rng):
            start = sample.time_s if start is None else start
            fix = forward.update(detections, sample)
            if fix is not None:
                fixes.append((fix, self.azimuth_rad(fix.time_s - start)))
        return fixes, forward

    def beam_rad(self, vehicle_s: float, time_s: float) -> float:
        """Angle of the beam off the line of sight to the camera."""
        beam = self.beacon.azimuth_rad(vehicle_s - self.clock_offset_s)
        return math.remainder(beam - self.azimuth_rad(time_s), math.tau)

    def _beacon_flux(self, vehicle_s: float, time_s: float) -> float:
        if not self.beacon_on or time_s > self.beacon_until_s:
            return 0.0
        angle = np.array([self.beam_rad(vehicle_s, time_s)])
        g = pass_profile(angle, beam_sigma_rad(self.beacon.divergence_deg), self.widening)
        return self.peak_flux * float(g[0])

    def _wandered(self, ray: Array, vehicle_s: float, time_s: float) -> Array:
        angle = self.wander * self.beam_rad(vehicle_s, time_s)
        x, y, z = ray.tolist()
        return np.array([x * math.cos(angle) + z * math.sin(angle), y, z * math.cos(angle) - x * math.sin(angle)])


def azimuth_errors_rad(fixes: list[tuple[AzimuthFix, float]]) -> Array:
    """(n,) errors of fixes."""
    return np.array([math.remainder(fix.azimuth_rad - truth, math.tau) for fix, truth in fixes])
