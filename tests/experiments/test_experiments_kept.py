"""Long experiments go on where they were stopped, and take nothing that another configuration left."""

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

import pytest

from auvdock.campaign.errors import CampaignError
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeObserver
from auvdock.experiments import rotating_docking, rotating_tables
from auvdock.experiments.kept import Kept
from auvdock.experiments.rotating_docking import ARMS, Flight, fly_arm
from auvdock.experiments.rotating_tables import run_videos
from auvdock.experiments.rotating_watch import SCENARIOS, Place, Watch

MOMENT = dataclasses.replace(ARMS[3], world={"clock": {"offset_s": 0.05}, "limits": {"max_time_s": 1.0}})
PLACE = Place(1.5, 20.0, False)


def seen(place: Place, seed: int) -> Watch:
    return Watch(place, seed, (0.1, -0.2), 0.05, (), 0, (0.01,), (1.0,), (5, 4), None, 2, 4)


def equal(flight: Flight, other: Flight) -> bool:
    clock = dict.fromkeys(EpisodeResult.WALL_CLOCK_FIELDS, 0.0)
    return flight.path_m == other.path_m and dataclasses.replace(flight.result, **clock) == dataclasses.replace(
        other.result, **clock
    )


def test_flights_that_were_flown_are_found_and_equal_to_new_ones(tmp_path, monkeypatch):
    whole = fly_arm(MOMENT, [3, 4])
    kept = Kept(tmp_path / "flights.jsonl")
    fly_arm(MOMENT, [4], kept=kept)
    kept.close()
    flown: list[int] = []

    class Counted(EpisodeRunner):
        def run(self, seed: int, observers: Sequence[EpisodeObserver] = ()) -> EpisodeResult:
            flown.append(seed)
            return super().run(seed, observers)

    monkeypatch.setattr(rotating_docking, "EpisodeRunner", Counted)
    ticks: list[None] = []
    resumed = fly_arm(MOMENT, [3, 4], done=lambda: ticks.append(None), kept=Kept(tmp_path / "flights.jsonl"))
    assert flown == [3]
    assert len(ticks) == 2
    assert [flight.seed for flight in resumed] == [3, 4]
    assert all(equal(one, other) for one, other in zip(whole, resumed, strict=True))


def test_flights_of_another_configuration_are_flown_again(tmp_path):
    path = tmp_path / "flights.jsonl"
    fly_arm(MOMENT, [3], kept=Kept(path))
    other = dataclasses.replace(MOMENT, current_m_s=0.3)
    assert not equal(fly_arm(other, [3], kept=Kept(path))[0], fly_arm(MOMENT, [3], kept=Kept(path))[0])
    assert len(path.read_text(encoding="utf-8").splitlines()) == 2


def test_flights_of_several_processes_are_kept(tmp_path):
    kept = Kept(tmp_path / "flights.jsonl")
    both = fly_arm(MOMENT, [3, 4], workers=2, kept=kept)
    alone = fly_arm(MOMENT, [3, 4])
    assert all(equal(one, other) for one, other in zip(both, alone, strict=True))
    assert len((tmp_path / "flights.jsonl").read_text(encoding="utf-8").splitlines()) == 2


def test_videos_are_shared_and_scenarios_kept_apart(tmp_path, monkeypatch):
    looked: list[Any] = []

    def watch(place: Place, seed: int, *more: Any) -> Watch:
        looked.append((seed, more))
        return seen(place, seed)

    monkeypatch.setattr(rotating_tables, "watch", watch)
    path = tmp_path / "watches.jsonl"
    first = run_videos([PLACE], 2, 4, "pixels", kept=Kept(path))
    assert run_videos([PLACE], 3, 4, "pixels", kept=Kept(path))[:2] == first
    assert [seed for seed, _ in looked] == [0, 1, 2]
    run_videos([PLACE], 1, 5, "pixels", kept=Kept(path))
    for scenario in SCENARIOS:
        run_videos([PLACE], 1, 4, "pixels", scenario=scenario, kept=Kept(path))
    assert len(looked) == 4 + len(SCENARIOS)


def test_a_torn_line_is_run_again_and_a_damaged_one_named(tmp_path):
    path = tmp_path / "pieces.jsonl"
    kept = Kept(path)
    for seed in range(3):
        kept.add({"seed": seed}, seen(PLACE, seed))
    kept.close()
    text = path.read_text(encoding="utf-8")
    path.write_text(text[:-40], encoding="utf-8")
    again = Kept(path)
    assert again.find(Watch, {"seed": 1}) == seen(PLACE, 1)
    assert again.find(Watch, {"seed": 2}) is None
    again.add({"seed": 2}, seen(PLACE, 2))
    again.close()
    assert path.read_text(encoding="utf-8") == text
    path.write_text(text.replace('"seed": 1', '"seed', 1), encoding="utf-8")
    with pytest.raises(CampaignError, match="line 2"):
        Kept(path)
    path.write_text('{"episode": 3}\n', encoding="utf-8")
    with pytest.raises(CampaignError, match="line 1 holds no finished piece"):
        Kept(path)


def test_other_versions_are_not_found_but_other_revisions_are_told(tmp_path):
    path = tmp_path / "pieces.jsonl"
    kept = Kept(path)
    kept.add({"seed": 0}, seen(PLACE, 0))
    kept.close()
    row = json.loads(path.read_text(encoding="utf-8"))
    row["revision"] = "earlier"
    path.write_text(json.dumps(row) + "\n", encoding="utf-8")
    again = Kept(path)
    assert again.find(Watch, {"seed": 0}) == seen(PLACE, 0)
    assert again.revisions == {"earlier"}
    row["key"]["versions"]["mujoco"] = "0.0"
    path.write_text(json.dumps(row) + "\n", encoding="utf-8")
    assert Kept(path).find(Watch, {"seed": 0}) is None
