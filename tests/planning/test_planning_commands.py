"""`auvdock plan` and `auvdock reproduce guidance-*`: what they print and what they refuse."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from auvdock.cli.main import main
from auvdock.planning.pictures import Panel, draw_sections

STATION = str(Path(__file__).resolve().parents[2] / "assets" / "stations" / "conical.toml")


def test_plan_prints_one_object_and_writes_its_files(tmp_path, capsys):
    station = tmp_path / "my station.toml"
    station.write_text(Path(STATION).read_text(encoding="utf-8"), encoding="utf-8")
    words = ["plan", str(station), "--water", "lake", "--attenuation", "0.8", "--resolution", "16"]
    assert main([*words, "--out", str(tmp_path), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["volume_m3"] > 10.0 * report["discretisation_error_m3"]
    assert 0.0 < report["near_m"] < report["range_m"]
    assert report["array_power_w"] == pytest.approx(60.0)
    for name in ("sections.png", "region.rrd"):
        assert (tmp_path / name).stat().st_size > 5000
    assert (tmp_path / "sections.png").read_bytes().startswith(b"\x89PNG")
    auvdock, *command = shlex.split(report["fly_it"])
    assert auvdock == "auvdock"
    assert main([*command, "--fidelity", "beacons", "--world.limits.max-time-s", "0.1", "--json"]) == 1
    world = json.loads(capsys.readouterr().out)["config"]["world"]
    assert (world["water"], world["attenuation_per_m"]) == ("lake", 0.8)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["plan", "nowhere.toml"], "nowhere.toml"),
        (["plan", STATION, "--water", "tea"], "pool"),
        (["plan", STATION, "--min-lights", "7"], "at most 6"),
        (["plan", STATION, "--attenuation", "nan"], "attenuation: "),
        (["plan", STATION, "--attenuation", "0"], "error: attenuation: "),
        (["plan", STATION, "--attenuation", "1e308"], "error: attenuation: "),
        (["plan", STATION, "--optimise", "volume", "--cone", "1"], "error: cone: "),
        (["plan", STATION, "--width", "20"], "error: width: "),
        (["plan", STATION, "--width", "9999"], "error: width: "),
        (["reproduce", "guidance-design", "--cone", "1"], "error: cone: "),
        (["reproduce", "halo", "--water", "pool", "--range", "5", "--attenuation", "0.01"], "error: attenuation: "),
        (["plan", STATION, "--resolution", "1"], "resolution"),
        (["plan", STATION, "--optimise", "volume", "--bounds.lights", "3"], "4 to 16"),
        (["plan", STATION, "--optimise", "volume", "--seed", "-1"], "seed"),
        (["reproduce", "guidance-space", "--workers", "0"], "workers"),
        (["reproduce", "guidance-region", "--steps", "1"], "steps"),
        (["reproduce", "guidance-region", "--waters", "tea", "--steps", "2"], "pool"),
        (["reproduce", "guidance-design", "--episodes", "-1"], "episodes"),
        (["reproduce", "guidance-design", "--water", "tea"], "pool"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(words, told, capsys):
    assert main(words) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    lines = printed.err.strip().splitlines()
    assert len(lines) == 1
    assert told in lines[0]


def test_folder_that_cannot_be_written_is_told_before_the_work(tmp_path, capsys):
    blocker = tmp_path / "file"
    blocker.write_text("")
    assert main(["plan", STATION, "--out", str(blocker / "sub")]) == 2
    assert "out" in capsys.readouterr().err


def test_sections_are_drawn_where_nothing_is_seen(tmp_path):
    across = np.linspace(0.0, 1.0, 4)
    panel = Panel("none", "x", "y", across, across, np.zeros((4, 4), dtype=np.int64), np.zeros((1, 2)))
    draw_sections(tmp_path / "deep" / "empty.png", "nothing", [panel], 4)
    assert (tmp_path / "deep" / "empty.png").stat().st_size > 1000
