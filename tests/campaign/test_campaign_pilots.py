"""A user's own pilot by name, in single episodes and as an axis of a campaign."""

import json

import pytest

from auvdock.campaign.axes import AxisCfg
from auvdock.campaign.axis_text import parse_axis
from auvdock.campaign.config import CampaignCfg
from auvdock.campaign.plan import Plan
from auvdock.campaign.store import read_table
from auvdock.cli.main import main
from auvdock.core.errors import ConfigError
from auvdock.episode.config import LandingEpisodeCfg, level_cfg
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.stations import STATIONS

SHORT = {"world": {"fidelity": "beacons", "limits": {"max_time_s": 2.0}}}
AHEAD = "campaign_pilots:Ahead"


def test_a_pilot_of_one_s_own_flies_and_its_modes_are_no_failure_reasons():
    runner = EpisodeRunner(level_cfg(1).override(SHORT).override({"control": {"controller": AHEAD}}))
    result = runner.run(0)
    assert type(runner.pilot).__name__ == "Ahead"
    assert result.failure_reason == "timeout"
    assert result.path_length_m > 0.1
    assert result.config["control"]["controller"] == AHEAD


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("ahead", "package.module:Name"),
        ("no_such_module_here:Ahead", "imported"),
        ("campaign_pilots:Astern", "campaign_pilots has"),
        ("campaign_pilots:Nobody", "methods"),
        ("builtins:iter", "vehicle, station, camera"),
    ],
)
def test_what_is_no_pilot_is_refused_in_one_line(name, remedy):
    with pytest.raises(ConfigError, match=remedy):
        EpisodeRunner(level_cfg(1).override(SHORT).override({"control": {"controller": name}}))


def test_pilots_are_an_axis_and_a_flag(tmp_path, capsys):
    flags = ["--fidelity", "beacons", "--world.limits.max-time-s", "2", "--episodes", "2", "--executor", "serial"]
    assert main(["sweep", *flags, "--controller", f"own,{AHEAD}", "--out", str(tmp_path / "out"), "--json"]) == 0
    rows = read_table(tmp_path / "out").to_pylist()
    assert [row["controller"] for row in rows] == ["own", AHEAD]
    assert rows[0]["energy_j"] != rows[1]["energy_j"]
    capsys.readouterr()
    assert main(["dock", "conical", "--from", f"{tmp_path / 'out'}#1", "--json"]) == 1
    assert "bit for bit" in capsys.readouterr().err
    short = ["--fidelity", "beacons", "--world.limits.max-time-s", "2"]
    assert main(["dock", "conical", *short, "--controller", AHEAD, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["config"]["control"]["controller"] == AHEAD


def test_a_name_with_a_colon_is_no_range():
    assert parse_axis("controller", "a.b:C,own", str) == AxisCfg("controller", ("a.b:C", "own"))
    assert parse_axis("detector", "a.b:C", str) == AxisCfg("detector", ("a.b:C",))


@pytest.mark.parametrize("station", STATIONS)
def test_campaigns_of_every_station_can_be_planned(station):
    axes = (AxisCfg("current", (0.0, 0.2)), AxisCfg("attenuation", (0.3,)), AxisCfg("level", (0, 2)))
    plan = Plan(CampaignCfg(station=station, episodes=4, axes=axes))
    configs = [plan.config(spec) for spec in map(plan.__getitem__, range(4))]
    assert [cfg.world.sim.current.speed_m_s for cfg in configs] == [0.0, 0.0, 0.2, 0.2]
    assert {cfg.world.attenuation_per_m for cfg in configs} == {0.3}
    assert isinstance(configs[0], LandingEpisodeCfg) == (station == "landing")
    assert STATIONS[station].level(0).world.station == configs[0].world.station
