"""Whole landings in the `beacons` fidelity, their metrics, their recording and their command."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from auvdock.campaign.row import RESULT_COLUMNS
from auvdock.cli.main import main
from auvdock.core.arrays import Array
from auvdock.core.contracts import Command, Detections, PoseEstimate, Proprioception
from auvdock.core.transforms import invert, make_transform, rotation_from_euler_zyx
from auvdock.envs.landing_config import LandingWorldCfg
from auvdock.envs.landing_world import LandingWorld
from auvdock.episode.config import LEVELS, LandingEpisodeCfg, landing_level_cfg
from auvdock.episode.result import FAILURE_REASONS, EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.estimation.landing.percept import LandingPercept
from auvdock.metrics.landing import LandingMetrics, estimate_error
from auvdock.metrics.tick import Tick
from auvdock.recording import paths
from auvdock.recording.rerun_recorder import RerunRecorder

WORLD = LandingWorld(LandingWorldCfg(fidelity="beacons"))


def beacons(**world: Any) -> LandingEpisodeCfg:
    return landing_level_cfg(1).override({"world": {"fidelity": "beacons", **world}})


class Ticks:
    """Keeps all ticks."""

    def __init__(self) -> None:
        self.ticks: list[Tick] = []

    def on_start(self, setup: object) -> None: ...

    def on_tick(self, tick: Tick) -> None:
        self.ticks.append(tick)

    def on_end(self, result: EpisodeResult) -> None: ...

    def close(self) -> None: ...


@pytest.fixture(scope="module")
def landing(tmp_path_factory: pytest.TempPathFactory) -> tuple[EpisodeResult, list[Tick], Path]:
    path = tmp_path_factory.mktemp("landing") / "run.rrd"
    watcher = Ticks()
    result = EpisodeRunner(beacons()).run(0, [watcher, RerunRecorder(path)])
    return result, watcher.ticks, path


def test_a_landing_docks_and_tells_its_metrics(landing: tuple[EpisodeResult, list[Tick], Path]) -> None:
    result, ticks, _ = landing
    assert result.success, result.failure_reason
    json.dumps(result.to_json(), allow_nan=False)
    assert result.touchdown_speed_m_s is not None
    assert 0.0 < result.touchdown_speed_m_s < 0.3
    shares = [result.lights_share, result.tag_share, result.fused_share, result.blind_share]
    assert sum(share or 0.0 for share in shares) == pytest.approx(1.0)
    assert result.distortion_rate == result.blind_share == result.invalid_frames / result.precise_frames
    # The history that observers see leads to the figures of the result.
    aligned = [tick for tick in ticks if tick.command.mode in ("descend", "touchdown") and not tick.truth.latched]
    offsets = [math.hypot(*tick.truth.landing.seat_error_m[:2]) for tick in aligned if tick.truth.landing]
    assert result.final_position_error_m == pytest.approx(offsets[-1])
    assert result.max_position_error_m is not None
    assert result.max_position_error_m >= max(offsets[-40:]) - 1e-12
    assert result.lateral_error_m is None  # there is no throat


def test_its_recording_shows_place_level_and_tag(landing: tuple[EpisodeResult, list[Tick], Path]) -> None:
    _, _, path = landing
    reader = RrdReader(path)
    found = {chunk.entity_path for entry in reader.recordings() for chunk in reader.stream(store=entry)}
    wanted = (paths.PLACE, paths.PLACE_ANGLE, paths.LEVEL_STATE, paths.TAG_OUTLINE, f"{paths.PLATFORM}/slab")
    assert set(wanted) <= found
    assert {f"{paths.HULL}/frame", f"{paths.HULL}/keel"} <= found
    assert not {paths.FUNNEL, paths.TUBE} & found


def test_same_seed_same_landing_in_a_used_and_in_a_fresh_runner() -> None:
    cfg = beacons(limits={"max_time_s": 2.0})
    used = EpisodeRunner(cfg)
    used.run(8)
    first, second = used.run(7).to_json(), EpisodeRunner(cfg).run(7).to_json()
    for name in EpisodeResult.WALL_CLOCK_FIELDS:
        del first[name], second[name]
    assert first == second
    assert first["failure_reason"] in FAILURE_REASONS


@pytest.mark.parametrize("level", LEVELS)
def test_every_level_loads_and_differs_from_the_default(level: int) -> None:
    assert landing_level_cfg(level) != LandingEpisodeCfg()


def test_campaign_rows_take_the_landing_metrics_along() -> None:
    assert RESULT_COLUMNS["touchdown_speed_m_s"] is float
    assert RESULT_COLUMNS["aligned_frames"] is int


def test_command_prints_one_json_object(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["dock", "landing", "--fidelity", "beacons", "--vehicle", "remus_hybrid", "--seed", "3", "--json"]
    code = main([*words, "--levels", "lights", "--world.limits.max-time-s", "1"])
    plain = json.loads(capsys.readouterr().out)
    assert code == 1
    assert plain["config"]["world"]["sim"]["vehicle"] == "remus_hybrid"
    assert plain["config"]["perception"]["levels"] == "lights"
    assert plain["tag_share"] in (None, 0.0)


def metrics() -> LandingMetrics:
    simulator = WORLD.simulator
    return LandingMetrics(WORLD.camera, simulator.vehicle, simulator.T_world_station)


def tick(
    mode: str, seat_error: tuple[float, float, float], off: Array | None, level: str = "tag", measured: bool = True
) -> Tick:
    """A made-up period whose pose estimate is off by a transform of the body, None for no estimate."""
    WORLD.reset(0)
    simulator = WORLD.simulator
    station = WORLD.cfg.station
    place = np.array([0.0, 0.0, station.guide.seat_height_m - station.depth_m])
    position: Array = np.array(seat_error) + place - simulator.vehicle.seat_body_m
    simulator.reset(position, np.array([1.0, 0.0, 0.0, 0.0]), np.random.default_rng(0))
    truth = simulator.truth
    pose = None
    if off is not None:
        T_station_camera = off @ invert(simulator.T_world_station) @ truth.T_world_body @ WORLD.camera.T_body_camera
        pose = PoseEstimate(T_station_camera, np.eye(6), (), "test", 0.0, measured=measured)
    percept = LandingPercept(0.0, pose, None, None, 0, Detections.empty(), level=level)
    zero = np.zeros(3)
    own = Proprioception(0.0, 10.0, zero, zero, zero, zero)
    return Tick(truth, own, None, percept, Command(np.zeros(8), mode=mode))


def shifted(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw_deg: float = 0.0) -> Array:
    return make_transform(rotation_from_euler_zyx(0.0, 0.0, math.radians(yaw_deg)), np.array([x, y, z]))


def test_nothing_seen_leaves_nothing_but_counts() -> None:
    empty = metrics()
    empty.add(tick("search", (0.0, 0.0, 3.0), None, "none"))
    fields = empty.fields(WORLD.truth)
    assert fields["precise_frames"] == fields["aligned_frames"] == 0
    assert all(fields[name] is None for name in ("distortion_rate", "entry_distance_m", "max_position_error_m"))


def test_only_the_last_descent_counts_as_after_alignment() -> None:
    gathered = metrics()
    gathered.add(tick("align", (0.5, 0.0, 2.0), shifted(0.2)))
    gathered.add(tick("descend", (0.2, 0.0, 1.0), shifted(0.1)))
    gathered.add(tick("abort", (0.4, 0.0, 1.5), shifted(0.1)))
    gathered.add(tick("descend", (0.0, 0.03, 1.0), shifted(0.015)))
    gathered.add(tick("touchdown", (0.0, 0.01, 0.2), shifted(0.0, -0.025), "fused"))
    fields = gathered.fields(WORLD.simulator.truth)
    assert fields["max_position_error_m"] == pytest.approx(0.03)
    assert fields["final_position_error_m"] == pytest.approx(0.01)
    assert fields["aligned_frames"] == 2
    assert fields["estimate_within_20mm_3deg"] == pytest.approx(0.5)
    assert fields["estimate_within_10mm_1deg"] == pytest.approx(0.0)
    assert fields["entry_distance_m"] == pytest.approx(math.hypot(0.5, 2.0))
    assert fields["tag_share"] == pytest.approx(0.8)
    assert fields["fused_share"] == pytest.approx(0.2)


def test_held_poses_count_as_blind_and_are_judged_all_the_same() -> None:
    gathered = metrics()
    for _ in range(3):
        gathered.add(tick("descend", (0.0, 0.0, 1.0), shifted()))
    gathered.add(tick("descend", (0.0, 0.0, 0.9), shifted(0.05), "none", measured=False))
    fields = gathered.fields(WORLD.simulator.truth)
    assert fields["blind_share"] == fields["distortion_rate"] == pytest.approx(0.25)
    assert fields["distortion_available"] == 0.0
    assert fields["aligned_frames"] == 4
    assert fields["estimate_within_20mm_3deg"] == pytest.approx(0.75)


def test_estimate_error_is_the_seats() -> None:
    """A yaw error of 2° about the station's origin moves a seat 1 m ahead of it by 35 mm to port."""
    truth = make_transform(np.eye(3), np.array([1.0, 0.0, 2.0]))
    error = estimate_error(shifted(yaw_deg=2.0) @ truth, truth, np.array([0.0, 0.0, -0.28, 1.0]))
    expected = [math.cos(math.radians(2.0)) - 1.0, math.sin(math.radians(2.0)), 0.0, math.radians(2.0)]
    np.testing.assert_allclose(error, expected, atol=1e-12)


@pytest.mark.parametrize("faults", [{"dead_lights": ("B0", "B2")}, {"tag_hidden_from_s": 0.0, "tag_hidden_for_s": 2.0}])
def test_faults_reach_the_world(faults: dict[str, Any]) -> None:
    """With two lights dead no more than three are seen; while the tag is covered it never is."""
    cfg = LandingWorldCfg(fidelity="beacons")
    start = dataclasses.replace(cfg.start, min_height_m=3.0, max_height_m=3.0, lateral_m=0.0, heading_deg=0.0)
    world = LandingWorld(dataclasses.replace(cfg, start=start, faults=dataclasses.replace(cfg.faults, **faults)))
    seen: list[tuple[int, int]] = []
    for seed in range(12):
        world.reset(seed)
        sensed = world.sense()
        seen.append((len(sensed.detections or ()), len(sensed.tags)))
    lights, tags = np.array(seen).T
    if "dead_lights" in faults:
        assert np.median(lights) <= 3
    else:
        assert tags.sum() == 0
        assert np.median(lights) >= 3
