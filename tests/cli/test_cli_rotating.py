"""`auvdock dock rotating`: its flags end where they should."""

import json

import pytest

from auvdock.cli.dock_rotating import DockRotating
from auvdock.cli.main import main
from auvdock.episode.config import level_cfg
from auvdock.experiments.rotating_docking import FALSE_LIGHT


def command(**flags):
    return DockRotating(episode=level_cfg(1, "rotating"), **flags)


def test_without_flags_it_is_the_level():
    assert command().resolve() == level_cfg(1, "rotating")


def test_own_flags_change_what_they_say():
    cfg = command(clock_offset=0.05, drop_frames=0.2, false_light=True, water="clear", current=0.3).resolve().world
    assert cfg.clock.offset_s == 0.05
    assert cfg.frame_drop_share == 0.2
    assert cfg.extra_lights == (FALSE_LIGHT,)
    assert cfg.water == "clear"
    assert cfg.sim.current.speed_m_s == 0.3
    assert cfg.station.rotating is not None
    assert command(no_beacon=True).resolve().world.station.rotating is None


@pytest.mark.parametrize(
    ("words", "field"),
    [
        (["--drop-frames", "2"], "frame_drop_share"),
        (["--clock-offset", "nan"], "clock-offset"),
        (["--world.station-heading", "guessed"], "station-heading"),
        (["--level", "7"], "level"),
    ],
)
def test_wrong_input_is_one_line_and_code_2(words, field, capsys):
    assert main(["dock", "rotating", *words]) == 2
    error = capsys.readouterr().err
    assert field in error
    assert "Traceback" not in error


def test_a_short_episode_prints_one_json_object(capsys):
    words = ["--fidelity", "beacons", "--seed", "3", "--world.limits.max-time-s", "1", "--json"]
    assert main(["dock", "rotating", *words]) == 1
    result = json.loads(capsys.readouterr().out)
    assert result["failure_reason"] == "search"
    assert 19.0 < result["start_range_m"] < 46.0
    assert result["config"]["world"]["station_heading"] == "unknown"
