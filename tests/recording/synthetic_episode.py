"""An episode made up for the recorder: a straight approach with lights that come and go. No simulator needed."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from auvdock.core.arrays import Array, Image
from auvdock.core.camera import CameraCfg, make_camera
from auvdock.core.contracts import BLUE, RED, Command, Detections, Percept, PoseEstimate, Proprioception, TrackView
from auvdock.core.marine import flip_vector
from auvdock.core.station import load_conical_station
from auvdock.core.transforms import invert, make_transform, rotation_from_euler_zyx
from auvdock.core.vehicle import load_vehicle
from auvdock.episode.result import EpisodeResult
from auvdock.episode.trace import EpisodeSetup
from auvdock.metrics.tick import Tick
from auvdock.sim.truth import Truth

POSE_OFFSET_STATION_M = np.array([-0.30, 0.10, 0.05])
"""What every estimated position is off by: along x, y, z of the station."""
YAW_ERROR_DEG = 2.0
MODES = ("acquire", "far", "mid", "near", "terminal")


def make_setup(width_px: int = 640, height_px: int = 360) -> EpisodeSetup:
    vehicle = load_vehicle("remus_hybrid")
    station = load_conical_station()
    mount = vehicle.bow_camera
    camera = make_camera(
        CameraCfg(width_px=width_px, height_px=height_px),
        *(flip_vector(np.array(part)) for part in (mount.position_m, mount.direction, mount.up)),
    )
    return EpisodeSetup(
        title="synthetic approach",
        kind="conical",
        station=station,
        vehicle=vehicle,
        camera=camera,
        T_world_station=make_transform(np.eye(3), np.array([0.0, 0.0, -station.depth_m])),
        detector="threshold",
        water="made up",
    )


def ticks(
    setup: EpisodeSetup, count: int, *, images: bool = False, lights: bool = True, rate_hz: float = 30.0
) -> Iterator[Tick]:
    """From 20 m out to the mouth in `count` control periods.

    Every fourth pose is predicted instead of measured; without `lights` there are neither detections nor poses.
    """
    rng = np.random.default_rng(5)
    backdrop = np.clip(rng.normal(8.0, 2.0, (setup.camera.height_px, setup.camera.width_px, 3)), 0, 255)
    for index in range(count):
        share = index / max(count - 1, 1)
        T_station_body = make_transform(
            rotation_from_euler_zyx(0.0, 0.0, math.pi + 0.1 * math.cos(4.0 * share)),
            np.array([20.0 * (1.0 - share) + 1.0, 1.5 * math.sin(4.0 * share) * (1.0 - share), 0.4 * (1.0 - share)]),
        )
        T_world_body = setup.T_world_station @ T_station_body
        current = np.array([0.0, 0.2 + 0.05 * math.sin(9.0 * share), 0.0])
        velocity = T_world_body[:3, :3].T @ np.array([-1.0, 0.0, 0.0])
        truth = Truth(
            time_s=index / rate_hz,
            T_world_body=T_world_body,
            nu_body=np.concatenate([velocity, np.zeros(3)]),
            nu_relative_body=np.concatenate([velocity - T_world_body[:3, :3].T @ current, np.zeros(3)]),
            current_world_m_s=current,
            nose_station_m=(T_station_body @ np.array([setup.vehicle.nose_x_m, 0.0, 0.0, 1.0]))[:3],
            axis_angle_rad=abs(0.1 * math.cos(4.0 * share)),
            contact_force_n=80.0 if share > 0.97 else 0.0,
            peak_contact_force_n=80.0 if share > 0.97 else 0.0,
            touching_station=share > 0.97,
            latched=False,
            docked=False,
            entry_speed_m_s=None,
            entry_angle_rad=None,
            entry_lateral_m=None,
            entry_vertical_m=None,
            energy_j=0.0,
            path_length_m=20.0 * share,
            immersed_share=1.0,
            broached_s=0.0,
            diverged=False,
        )
        yield Tick(
            truth=truth,
            proprioception=Proprioception(index / rate_hz, 8.0, np.zeros(3), np.zeros(3), velocity, velocity),
            image=_image(backdrop, index) if images else None,
            percept=_percept(setup, T_station_body, index, rate_hz, lights),
            command=Command(
                0.5 * np.sin(share * 20.0 + np.arange(len(setup.vehicle.actuators))),
                mode=MODES[min(int(share * len(MODES)), len(MODES) - 1)],
            ),
        )


def make_result(*, success: bool = True) -> EpisodeResult:
    return EpisodeResult(
        success=success,
        failure_reason=None if success else "timeout",
        distortion_rate=0.0413,
        distortion_available=0.0124,
        precise_frames=242,
        invalid_frames=10,
        unavailable_frames=3,
        entry_distance_m=17.25,
        precise_range_m=15.5,
        time_s=60.0,
        path_length_m=21.0,
        energy_j=5400.0,
        peak_contact_force_n=85.0,
        lateral_error_m=0.021,
        vertical_error_m=None,
        heading_error_rad=math.radians(3.0),
        entry_speed_m_s=0.61,
        pose_error_median_m=0.12,
        measured_poses=232,
        false_poses=3,
        false_pose_rate=3 / 232,
        poses_by_solver={"sqpnp": 2, "tracked": 230},
        attempts=1,
        seed=7,
        wall_s=1.0,
        real_time_factor=60.0,
        frame_ms_median=0.4,
        frame_ms_p95=1.1,
        versions={"auvdock": "0.1.0"},
        config={},
    )


def _image(backdrop: Array, index: int) -> Image:
    return np.roll(backdrop, 17 * index, axis=1).astype(np.uint8)


def _percept(setup: EpisodeSetup, T_station_body: Array, index: int, rate_hz: float, lights: bool) -> Percept:
    time_s = index / rate_hz
    if not lights:
        return Percept(time_s, None, None, None, 0, Detections.empty())
    camera = setup.camera
    T_station_camera = T_station_body @ camera.T_body_camera
    points = setup.station.layout.positions_m
    in_camera = (invert(T_station_camera) @ np.column_stack([points, np.ones(len(points))]).T).T[:, :3]
    visible = camera.in_view(in_camera)
    kinds = np.array([BLUE if beacon.role != "entrance" else RED for beacon in setup.station.layout.beacons])
    pixels = camera.project(np.where(visible[:, None], in_camera, [0.0, 0.0, 1.0]))
    detections = Detections.from_points(pixels[visible], np.full(visible.sum(), 0.9), kinds[visible], 5.0)
    array = setup.station.layout.indices("array")
    tracks = tuple(
        TrackView(100 + beacon, pixels[beacon], int(kinds[beacon]), beacon if beacon in array else None, 0)
        for beacon in np.flatnonzero(visible).tolist()
    )
    estimate = T_station_camera @ make_transform(
        rotation_from_euler_zyx(0.0, math.radians(YAW_ERROR_DEG), 0.0), np.zeros(3)
    )
    estimate[:3, 3] += POSE_OFFSET_STATION_M
    pose = PoseEstimate(estimate, np.eye(6), array, "ippe", 0.4, measured=index % 4 != 3)
    return Percept(time_s, pose, None, None, len(array), detections, tracks)
