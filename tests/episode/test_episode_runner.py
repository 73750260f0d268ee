"""Whole episodes in the `beacons` fidelity: determinism, bookkeeping, failure causes."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time

import pytest
from rerun.chunk import RrdReader

from auvdock.core.station import load_conical_station
from auvdock.core.strict import to_plain
from auvdock.episode.config import LEVELS, EpisodeCfg, level_cfg
from auvdock.episode.result import FAILURE_REASONS, EpisodeResult
from auvdock.episode.runner import EpisodeRunner

KEYS = (
    "success failure_reason distortion_rate precise_frames invalid_frames entry_distance_m precise_range_m time_s "
    "path_length_m energy_j peak_contact_force_n lateral_error_m heading_error_rad seed config"
).split()


def beacons(**world):
    return level_cfg(1).override({"world": {"fidelity": "beacons", **world}})


def comparable(result):
    plain = result.to_json()
    return {key: value for key, value in plain.items() if key not in EpisodeResult.WALL_CLOCK_FIELDS}


def test_an_episode_docks_and_tells_its_metrics():
    result = EpisodeRunner(beacons()).run(0)
    assert result.success, result.failure_reason
    plain = result.to_json()
    assert set(KEYS) <= set(plain)
    json.dumps(plain, allow_nan=False)
    assert result.invalid_frames <= result.precise_frames
    assert result.distortion_rate == pytest.approx(result.invalid_frames / result.precise_frames)
    assert result.entry_distance_m is not None
    assert result.lateral_error_m is not None
    assert 5.0 < result.entry_distance_m < 31.0
    assert result.path_length_m >= result.entry_distance_m
    assert result.energy_j > 0.0
    assert abs(result.lateral_error_m) < 0.15


def test_same_seed_same_result_in_a_used_runner_and_in_another_process():
    runner = EpisodeRunner(beacons())
    first = comparable(runner.run(7))
    runner.run(8)
    assert comparable(runner.run(7)) == first
    words = ["dock", "conical", "--fidelity", "beacons", "--seed", "7", "--json"]
    done = subprocess.run([sys.executable, "-m", "auvdock.cli", *words], capture_output=True, text=True, check=False)
    other = json.loads(done.stdout)
    assert {key: value for key, value in other.items() if key not in EpisodeResult.WALL_CLOCK_FIELDS} == first


@pytest.mark.render
def test_same_seed_same_result_in_pixels():
    cfg = level_cfg(1).override({"world": {"limits": {"max_time_s": 4.0}}})
    assert comparable(EpisodeRunner(cfg).run(3)) == comparable(EpisodeRunner(cfg).run(3))


def test_different_seeds_differ():
    runner = EpisodeRunner(beacons(limits={"max_time_s": 3.0}))
    assert comparable(runner.run(1)) != comparable(runner.run(2))


def test_time_out_is_charged_to_the_stage_in_which_it_ran_out():
    result = EpisodeRunner(beacons(limits={"max_time_s": 3.0})).run(0)
    assert not result.success
    assert result.failure_reason in FAILURE_REASONS
    assert result.time_s == pytest.approx(3.0, abs=1.0 / 30.0)


def test_without_light_nothing_leads_to_the_station():
    """With the lamps as good as off there is nothing to find; no truth leaks the station's place to the pilot."""
    lamps = [to_plain(dataclasses.replace(lamp, power_w=1e-12)) for lamp in load_conical_station().beacons]
    cfg = beacons(station={"array_power_w": 1e-12, "beacons": lamps}, limits={"max_time_s": 60.0})
    result = EpisodeRunner(cfg).run(0)
    assert not result.success
    assert result.failure_reason == "search"
    assert result.entry_distance_m is None
    assert result.distortion_rate is None


def test_a_hard_contact_ends_as_collision():
    cfg = beacons(limits={"collision_force_n": 1.0})
    reasons = {EpisodeRunner(cfg).run(seed).failure_reason for seed in range(2)}
    assert reasons <= {"collision", None}


def test_a_latch_that_closed_on_a_forbidden_entry_ends_the_episode_as_terminal():
    latch = {"max_entry_speed_m_s": 0.05}  # slower than any vehicle can enter
    result = EpisodeRunner(beacons(station={"latch": latch})).run(0)
    assert not result.success
    assert result.failure_reason == "terminal"
    assert result.entry_speed_m_s is not None
    assert result.entry_speed_m_s > 0.05
    assert result.time_s < 100.0


def test_diverging_state_ends_as_diverged():
    runner = EpisodeRunner(beacons())
    original = runner.world.step

    def explode(values):
        original(values)
        if runner.world.truth.time_s > 1.0:
            runner.world.simulator.data.qvel[0] = float("nan")

    runner.world.step = explode
    result = runner.run(0)
    assert result.failure_reason == "diverged"
    json.dumps(result.to_json(), allow_nan=False)


@pytest.mark.parametrize("level", LEVELS)
def test_every_level_loads_and_differs_from_the_default(level):
    cfg = level_cfg(level)
    assert isinstance(cfg, EpisodeCfg)
    assert cfg != EpisodeCfg()


def test_interrupt_leaves_a_readable_recording(tmp_path):
    path = tmp_path / "run.rrd"
    words = [
        "dock",
        "conical",
        "--fidelity",
        "beacons",
        "--world.limits.max-time-s",
        "3600",
        "--world.start.min-range-m",
        "100",
        "--world.start.max-range-m",
        "100",
        "--record",
        str(path),
    ]
    process = subprocess.Popen(
        [sys.executable, "-m", "auvdock.cli", *words],
        stderr=subprocess.PIPE,
        text=True,
        # Tests that were started in the background inherit that an interrupt is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60.0
    sizes: set[int] = set()
    while time.monotonic() < deadline and len(sizes) < 4:  # the scene first, then a batch every half second
        if path.exists() and path.stat().st_size >= 20_000:
            sizes.add(path.stat().st_size)
        time.sleep(0.1)
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    reader = RrdReader(path)
    paths = {chunk.entity_path for entry in reader.recordings() for chunk in reader.stream(store=entry)}
    assert len(paths) > 5


def test_beacons_make_no_camera_image_and_no_maps_of_it() -> None:
    """What only a renderer needs is not built: a campaign's worlds stay small and quick to make."""
    world = EpisodeRunner(level_cfg(1).override({"world": {"fidelity": "beacons"}})).world
    assert "imager" not in vars(world)
    world.close()
    assert "imager" not in vars(world)
