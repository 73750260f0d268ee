"""The rotating beacon's experiment: arms that differ as they say, summaries by hand, pairs by seed, a picture."""

import dataclasses
import json
import math
from typing import Any

import cv2
import numpy as np
import pytest

from auvdock.cli.main import main
from auvdock.core.errors import ConfigError
from auvdock.episode.result import EpisodeResult
from auvdock.experiments.rotating_docking import ARMS, Flight, arm_cfg, fly_arm, paired, pick_arms, summarise
from auvdock.experiments.rotating_docking_picture import draw_tracks

NOTHING: dict[str, Any] = {field.name: None for field in dataclasses.fields(EpisodeResult)}


def flight(seed, success, azimuth_deg, **changes):
    values: dict[str, Any] = {
        **NOTHING,
        "seed": seed,
        "success": success,
        "failure_reason": None if success else "circle",
        "start_azimuth_rad": math.radians(azimuth_deg),
        "time_s": 100.0 + seed,
        **changes,
    }
    result = EpisodeResult(**values)
    angle = math.radians(azimuth_deg)
    return Flight(seed, result, ((30.0 * math.cos(angle), 30.0 * math.sin(angle)), (0.0, 0.0)))


def test_summary_counts_front_and_behind_apart():
    flights = [
        flight(0, True, 20.0, acquire_s=5.0, azimuth_fixes=1, azimuth_rms_rad=math.radians(1.0)),
        flight(1, True, -170.0, acquire_s=9.0, azimuth_fixes=3, azimuth_rms_rad=math.radians(3.0)),
        flight(2, False, 100.0, handover_azimuth_error_rad=-math.radians(2.0)),
    ]
    summary = summarise(ARMS[0], flights)
    assert (summary.docked.successes, summary.docked.episodes) == (2, 3)
    assert (summary.front.successes, summary.front.episodes) == (1, 1)
    assert (summary.behind.successes, summary.behind.episodes) == (1, 2)
    assert summary.acquire_s == 7.0
    assert summary.time_s == 100.5
    assert summary.azimuth_rms_deg == pytest.approx(math.sqrt((1.0 + 3.0 * 9.0) / 4.0))
    assert summary.azimuth_median_deg == pytest.approx(2.0)
    assert summary.handover_deg == pytest.approx(2.0)
    assert summary.failures == {"circle": 1}


def test_summary_of_nothing():
    summary = summarise(ARMS[0], [])
    assert summary.docked.rate is None
    assert summary.acquire_s is summary.azimuth_rms_deg is None
    assert summary.failures == {}


def test_pairs_go_by_seed():
    first = [flight(seed, success, 0.0) for seed, success in ((0, True), (1, True), (2, False), (3, True))]
    second = [flight(seed, success, 0.0) for seed, success in ((3, False), (2, False), (1, True), (9, True))]
    test = paired(first, second)
    assert (test.both, test.only_first, test.only_second, test.neither) == (1, 1, 0, 1)


def test_arms_change_what_they_say_and_nothing_else():
    base = arm_cfg(ARMS[0]).world
    for arm in ARMS:
        world = arm_cfg(arm).world
        assert world.fidelity == "beacons"
        assert world.start == base.start
        assert world.sim.current.speed_m_s == arm.current_m_s
        changed = {key for key in vars(base) if getattr(world, key) != getattr(base, key)} - {"sim"}
        assert changed == set(arm.world)
    assert arm_cfg(pick_arms(["fixed"])[0]).world.station.rotating is None
    with pytest.raises(ConfigError, match=r"beacon-0\.3"):
        pick_arms(["beacons"])
    with pytest.raises(ConfigError, match="arms"):
        pick_arms([])


def test_picture_shows_tracks_of_both_arms(tmp_path):
    flights = [flight(seed, seed % 2 == 0, azimuth) for seed, azimuth in enumerate((0.0, 100.0, -170.0))]
    draw_tracks(tmp_path / "tracks.png", [(ARMS[0], flights), (ARMS[2], flights)])
    image = cv2.imread(str(tmp_path / "tracks.png"))
    assert image is not None
    assert image.shape[1] > 1.7 * image.shape[0]
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50


def test_command_refuses_what_cannot_be():
    for words in (["--episodes", "0"], ["--workers", "0"], ["--arms", "none"]):
        assert main(["reproduce", "rotating-docking", *words]) == 2


def test_command_reports_and_stores_what_was_flown(tmp_path, capsys, monkeypatch):
    def flown(arm, seeds, fidelity, workers, done, kept):
        assert (fidelity, workers) == ("beacons", 1)
        return tuple(flight(seed, arm.name == "beacon" or seed % 2 == 0, 50.0 * seed) for seed in seeds)

    monkeypatch.setattr("auvdock.cli.reproduce_rotating.fly_arm", flown)
    monkeypatch.setattr(EpisodeResult, "to_json", lambda self: {"seed": self.seed, "config": {}, "versions": {}})
    words = ["--episodes", "4", "--first-seed", "2", "--arms", "beacon", "beacon-0.3", "--out", str(tmp_path), "--json"]
    code = main(["reproduce", "rotating-docking", *words])
    report = json.loads(capsys.readouterr().out)
    assert code == 1  # 2 of 4 at 0.3 m/s
    assert report["met"] == {"beacon": True, "beacon-0.3": False}
    assert [arm["docked"]["successes"] for arm in report["arms"]] == [4, 2]
    assert report["paired_with_beacon"]["beacon-0.3"]["only_first"] == 2
    rows = json.loads((tmp_path / "rotating_docking.json").read_text(encoding="utf-8"))
    assert list(rows) == ["beacon", "beacon-0.3"]
    assert (tmp_path / "rotating_docking.png").stat().st_size > 10_000


def test_flights_do_not_depend_on_the_company_they_keep():
    """The same seed gives the same episode after another one; a moment of it is enough."""
    arm = dataclasses.replace(ARMS[0], world={"limits": {"max_time_s": 2.0}})
    alone, together = fly_arm(arm, [1002]), fly_arm(arm, [1001, 1002])
    assert alone[0].path_m == together[1].path_m
    assert alone[0].result.energy_j == together[1].result.energy_j
