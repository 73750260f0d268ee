"""Every kind of station has its part of a recording, and what the blueprint shows is there."""

from __future__ import annotations

from pathlib import Path

import pytest
from recording_reader import Recording

from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.stations import STATIONS
from auvdock.recording import paths
from auvdock.recording.parts import PARTS
from auvdock.recording.rerun_recorder import RerunRecorder

pytestmark = pytest.mark.filterwarnings("error::rerun.error_utils.RerunWarning")


def test_recordings_know_the_stations_that_episodes_know() -> None:
    assert set(PARTS) == set(STATIONS)


@pytest.mark.parametrize("station", STATIONS)
def test_a_flight_there_shows_only_what_was_recorded_and_all_that_was_plotted(station: str, tmp_path: Path) -> None:
    change = {"world": {"fidelity": "beacons", "limits": {"max_time_s": 1.0}}}
    runner = EpisodeRunner(STATIONS[station].level(1).override(change))
    assert runner.task.kind == station
    runner.run(0, [RerunRecorder(tmp_path / "run.rrd")])
    recording = Recording(tmp_path / "run.rrd")
    origins = recording.blueprint_values("ViewBlueprint:space_origin")
    for origin in origins:
        assert any((entity + "/").startswith(origin.rstrip("/") + "/") for entity in recording.entities), origin
    plots = {entity for entity in recording.temporal_entities if entity.startswith("/plots/")}
    assert all(any((plot + "/").startswith(origin + "/") for origin in origins) for plot in plots)
    modes = recording.static(paths.MODE_STATE, "StateConfiguration:values")
    assert {"docked", "abort"} < set(modes)
    (text,) = recording.static(paths.SUMMARY, "TextDocument:text")
    assert "| outcome | **failed**" in text
    names = [line.split(" | ")[0].removeprefix("| ") for line in text.splitlines()]
    assert {line.name for line in STATIONS[station].lines(runner.run(0))} <= set(names)
