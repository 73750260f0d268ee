"""The landing environment: its reward, its world's start and senses."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from auvdock.core.arrays import Array
from auvdock.core.calibrated_camera import CalibratedCameraCfg
from auvdock.core.errors import ConfigError
from auvdock.core.transforms import invert
from auvdock.envs.landing import LandingEnv
from auvdock.envs.landing_config import LandingStartCfg, LandingWorldCfg
from auvdock.envs.landing_world import LandingWorld
from auvdock.sim.simulator import SimCfg

BEACONS = LandingWorldCfg(fidelity="beacons")


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("observation", ["state", "pose"])
def test_gymnasiums_checker_is_content_with_another_vehicle(observation: str) -> None:
    cfg = LandingWorldCfg(fidelity="beacons", sim=SimCfg(vehicle="remus_hybrid"))
    check_env(LandingEnv(cfg, observation=observation), skip_render_check=True)


def test_going_down_is_rewarded() -> None:
    env = LandingEnv(LandingWorldCfg(start=LandingStartCfg(lateral_m=0.0, heading_deg=0.0)))
    down = np.array([0.0] * 4 + [-0.5] * 4, dtype=np.float32)

    def total(action: np.ndarray) -> float:
        env.reset(seed=0)
        return sum(float(env.step(action)[1]) for _ in range(40))

    assert total(down) > 0.0 > total(-down)


@pytest.mark.parametrize("vehicle", ["bluerov2_heavy", "remus_hybrid"])
def test_starts_lie_within_the_configured_ranges_and_fill_them(vehicle: str) -> None:
    cfg = LandingStartCfg()
    env = LandingEnv(LandingWorldCfg(sim=SimCfg(vehicle=vehicle)))
    starts = np.array([env.reset(seed=seed)[0] for seed in range(60)])
    assert np.all(np.abs(starts[:, :2]) <= cfg.lateral_m)
    assert np.all((starts[:, 2] >= cfg.min_height_m) & (starts[:, 2] <= cfg.max_height_m))
    heading_deg = np.degrees(np.arctan2(starts[:, 4], starts[:, 3]))
    assert np.all(np.abs(heading_deg) <= cfg.heading_deg + 1e-9)
    for values, low, high in (
        (starts[:, 0], -cfg.lateral_m, cfg.lateral_m),
        (starts[:, 2], cfg.min_height_m, cfg.max_height_m),
        (heading_deg, -cfg.heading_deg, cfg.heading_deg),
    ):
        assert np.ptp(values) > 0.8 * (high - low)


def test_frames_come_at_the_cameras_rate() -> None:
    """At 40 Hz of control the 20 Hz camera gives a frame in every other period."""
    world = LandingWorld(dataclasses.replace(BEACONS, control_hz=40.0))
    world.reset(0)
    seen: list[bool] = []
    for _ in range(8):
        seen.append(world.sense().detections is not None)
        world.step(np.zeros(8))
    assert seen == [True, False] * 4


def test_right_above_the_station_the_beacons_fidelity_sees_lights_and_tag() -> None:
    start = LandingStartCfg(min_height_m=3.0, max_height_m=3.0, lateral_m=0.0, heading_deg=0.0)
    world = LandingWorld(dataclasses.replace(BEACONS, start=start))
    tags = lights = 0
    for seed in range(10):
        world.reset(seed)
        sensed = world.sense()
        assert sensed.frame is None
        assert sensed.detections is not None
        lights += len(sensed.detections) >= 3
        tags += len(sensed.tags) == 1 and sensed.tags[0].tag_id == world.cfg.station.tag.tag_id
    assert lights >= 9
    assert tags >= 9


@pytest.mark.render
def test_image_up_is_forward_and_right_is_starboard() -> None:
    """The station's head lamp, a metre and a half before the vehicle's camera axis, shows in the upper half."""
    start = LandingStartCfg(min_height_m=3.0, max_height_m=3.0, lateral_m=0.0, heading_deg=0.0)
    world = LandingWorld(LandingWorldCfg(start=start))
    world.reset(0)
    camera = world.camera
    T_camera_world: Array = invert(world.truth.T_world_body @ camera.T_body_camera)
    for point, column, row in (((0.75, 0.0, 0.0), 0.0, -1.0), ((0.45, -0.35, 0.0), 1.0, -1.0)):
        world_point = np.array([*point, 1.0]) - np.array([0.0, 0.0, world.cfg.station.depth_m, 0.0])
        pixel = camera.project((T_camera_world @ world_point)[None, :3])[0]
        image = world.picture()
        x, y = (round(float(part)) for part in pixel)
        assert image[y - 2 : y + 3, x - 2 : x + 3].mean() > image.mean() + 50.0  # the lamp is where geometry puts it
        centre = camera.matrix[:2, 2]
        assert math.copysign(1.0, y - centre[1]) == row
        assert abs(x - centre[0]) < 20.0 if column == 0.0 else x > centre[0] + 20.0
    world.close()


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"control_hz": 30.0}, "control_hz"),
        ({"camera": CalibratedCameraCfg(rate_hz=25.0)}, "rate_hz"),
        ({"start": LandingStartCfg(max_height_m=20.0)}, "max_height_m"),
        ({"fidelity": "dreams"}, "fidelity"),
    ],
)
def test_worlds_that_cannot_be_are_refused_by_name(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigError, match=field):
        LandingWorldCfg(**changes)
