"""Axes keep the type of what they vary; stations, waters and detectors of one's own fly, again without their files."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from auvdock.assets import asset
from auvdock.campaign.axes import AxisCfg, Distribution, axis_kind
from auvdock.campaign.axis_text import parse_axis
from auvdock.campaign.config import CampaignCfg, campaign_from_plain
from auvdock.campaign.files import load_campaign
from auvdock.campaign.plan import Plan
from auvdock.campaign.replay import stored_episode
from auvdock.campaign.row import columns
from auvdock.campaign.store import read_table
from auvdock.cli.main import main
from auvdock.core.errors import ConfigError
from auvdock.core.strict import to_plain
from auvdock.episode.config import EpisodeCfg, LandingEpisodeCfg
from auvdock.optics.water import WaterCfg

BRIEF = ["--fidelity", "beacons", "--world.limits.max-time-s", "0.2"]
MURKY = """
name = "murky"
source = "ours"
absorption_per_m = [0.3, 0.2, 0.4]
scattering_per_m = [0.9, 0.8, 0.7]
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of one's own, with a lake and a station of four lights in it; the current one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "murky.toml").write_text(MURKY, encoding="utf-8")
    (tmp_path / "four.toml").write_text("array_count = 4\ndepth_m = 9.0\n", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("name", "text", "values"),
    [
        ("world.station.array_count", "4,6", (4, 6)),
        ("world.station.array_count", "4:8:3", (4, 6, 8)),
        ("world.camera.width_px", "320,640", (320, 640)),
        ("current", "0,1", (0.0, 1.0)),
        ("world.imaging.noise", "true,false", (True, False)),
        ("world.detection_model", "1,true,a:b", ("1", "true", "a:b")),
        ("level", "0,2", (0, 2)),
    ],
)
def test_an_axis_has_the_type_of_its_setting(name: str, text: str, values: tuple[object, ...]):
    kind = axis_kind(EpisodeCfg, name)
    cfg = CampaignCfg(episodes=len(values), axes=(parse_axis(name, text, kind),))
    again = campaign_from_plain(json.loads(json.dumps(to_plain(cfg))))
    for campaign in (cfg, again):
        points = [Plan(campaign)[index].point[name] for index in range(len(values))]
        assert points == list(values)
        assert {type(point) for point in points} == {kind} == {columns(campaign)[name]}
        Plan(campaign).config(Plan(campaign)[1])


@pytest.mark.parametrize("values", [(4, 6), (4.0, 6.0)])
def test_numbers_of_a_file_become_what_the_setting_is(tmp_path: Path, values: tuple[float, ...]):
    path = tmp_path / "campaign.toml"
    text = f"episodes = 2\n[[axes]]\nname = 'world.station.array_count'\nvalues = {list(values)}\n"
    path.write_text(text + "[[axes]]\nname = 'current'\nvalues = [1, 2]", encoding="utf-8")
    plan = Plan(load_campaign(path))
    point = plan[0].point
    assert (point, type(point["current"])) == ({"world.station.array_count": 4, "current": 1.0}, float)
    assert plan.config(plan[0]).world.station.array_count == 4  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("world.station.array_count", "4.5,6"),
        ("world.station.array_count", "4:8:4"),
        ("world.station.array_count", "true"),
        ("world.imaging.noise", "1,0"),
        ("world.imaging.noise", "false:true"),
        ("current", "slow"),
        ("level", "1.5"),
        ("curent", "1"),
        ("world.station", "four.toml"),
        ("world.station.arrey_count", "4"),
    ],
)
def test_values_of_another_type_are_refused_under_the_setting_s_name(name: str, text: str):
    with pytest.raises(ConfigError) as caught:
        CampaignCfg(axes=(parse_axis(name, text, axis_kind(EpisodeCfg, name)),))
    assert caught.value.field == name


@pytest.mark.parametrize("distribution", get_args(Distribution))
def test_whole_numbers_are_drawn_whole(distribution: Distribution):
    axis = AxisCfg("world.station.array_count", low=4, high=9, distribution=distribution)
    drawn = [axis.drawn(place, int) for place in np.linspace(0.0, 1.0, 601)]
    assert set(drawn) == set(range(4, 10))
    assert {type(value) for value in drawn} == {int}
    assert drawn == sorted(drawn)
    if distribution == "uniform":
        assert min(drawn.count(value) for value in range(4, 10)) >= 99


def test_a_station_and_a_water_of_one_s_own_fly_and_fly_again_without_their_files(here: Path, capsys):
    out = ["--out", "out", "--episodes", "2", "--executor", "serial", "--json"]
    assert main(["sweep", *BRIEF, "--station", "four.toml", "--water", "pool,murky.toml", *out]) == 0
    rows = read_table(here / "out").to_pylist()
    assert [row["water"] for row in rows] == ["pool", "murky.toml"]
    for name in ("four.toml", "murky.toml"):
        (here / name).unlink()
    cfg = stored_episode("out#1").cfg
    assert isinstance(cfg.world.water, WaterCfg)
    assert (cfg.world.water.name, cfg.world.station.depth_m, len(cfg.world.station.layout.beacons)) == ("murky", 9.0, 4)
    capsys.readouterr()
    assert main(["dock", "conical", "--from", "out#1", "--json"]) == 1
    printed = capsys.readouterr()
    assert "bit for bit" in printed.err
    assert json.loads(printed.out)["config"]["world"]["water"]["scattering_per_m"] == [0.9, 0.8, 0.7]


@pytest.mark.parametrize("station", ["conical", "rotating", "landing"])
def test_each_station_takes_a_file_beneath_the_other_flags(here: Path, station: str, capsys):
    text = asset("stations", station).read_text(encoding="utf-8")
    depth = "depth_m = 10.0" if station == "landing" else "depth_m = 8.0"
    (here / "own.toml").write_text(text.replace(depth, "depth_m = 12.5"), encoding="utf-8")
    flags = ["--station", "own.toml", "--water", "murky.toml", "--world.station.latch.hold-s", "0.7", "--json"]
    assert main(["dock", station, *BRIEF, *flags]) == 1
    world = json.loads(capsys.readouterr().out)["config"]["world"]
    assert (world["station"]["depth_m"], world["station"]["latch"]["hold_s"]) == (12.5, 0.7)
    assert world["water"]["name"] == "murky"
    other = "conical" if station == "landing" else "landing"
    assert main(["dock", other, *BRIEF, "--station", "own.toml"]) == 2
    assert "world.station." in capsys.readouterr().err


def test_a_campaign_file_names_its_station_and_keeps_what_it_says(here: Path):
    (here / "landing.toml").write_text("depth_m = 11.0\nlength_m = 2.0\n", encoding="utf-8")
    text = "station = 'landing.toml'\n[episode.world]\nwater = 'murky.toml'\n[episode.world.station]\nwidth_m = 1.2"
    (here / "campaign.toml").write_text(text, encoding="utf-8")
    cfg = load_campaign(here / "campaign.toml")
    for name in ("landing.toml", "murky.toml"):
        (here / name).unlink()
    again = campaign_from_plain(json.loads(json.dumps(to_plain(cfg))))
    assert again == cfg
    episode = Plan(again).config(Plan(again)[0])
    assert isinstance(episode, LandingEpisodeCfg)
    station = episode.world.station
    assert (station.depth_m, station.length_m, station.width_m, station.beacons) == (11.0, 2.0, 1.2, ())


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--station", "none.toml"], "none.toml"),
        (["--station", "five"], "station"),
        (["--water", "none.toml"], "none.toml"),
        (["--world.water", "tea.toml"], "tea.toml"),
    ],
)
def test_files_that_are_not_there_are_told_in_one_line(here: Path, flags: list[str], told: str, capsys):
    for command in (["dock", "conical", *BRIEF], ["sweep", *BRIEF, "--out", "out"]):
        assert main([*command, *flags]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert told in line


def test_a_module_in_the_current_folder_is_found_and_one_that_is_nowhere_is_told(here: Path, capsys):
    (here / "light_finder_of_mine.py").write_text(
        "from auvdock.core.contracts import Detections\n"
        "class Blind:\n"
        "    def detect(self, frame, regions=()):\n"
        "        return Detections.empty()\n"
    )
    (here / "broken_finder_of_mine.py").write_text("1 / 0\n")
    flags = ["--world.limits.max-time-s", "0.1", "--world.detection-model", "none", "--detector"]
    beacons = ["dock", "conical", *BRIEF, "--detector"]
    assert main([*beacons, "light_finder_of_mine:Blind"]) == 2  # found; what is missing is a model of it
    assert "fit-detector" in capsys.readouterr().err
    for name, told in (("no_finder_of_mine:X", "PYTHONPATH"), ("broken_finder_of_mine:X", "ZeroDivisionError")):
        assert main(["dock", "conical", *flags, name]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert line.startswith("auvdock: error: perception.detector: ")
        assert told in line
