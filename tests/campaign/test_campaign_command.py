"""`auvdock sweep` as a user runs it: flags, JSON, kill and resume, replay."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time

import pytest

from auvdock.campaign.report.page import recording_path, replay_command
from auvdock.campaign.store import read_table
from auvdock.cli.main import main
from auvdock.episode.stations import STATIONS

FLAGS = [
    *("--station", "conical", "--fidelity", "beacons", "--current", "0:0.4:2", "--attenuation", "0.2,0.8"),
    *("--world.limits.max-time-s", "2", "--seed", "3"),
]


def command(*words):
    return [sys.executable, "-m", "auvdock.cli", *words]


def run(*words):
    return subprocess.run(command(*words), capture_output=True, text=True, timeout=300, check=False)


def test_the_last_thing_printed_is_one_json_object(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["sweep", *FLAGS, "--episodes", "4", "--out", str(out), "--executor", "serial", "--json"]) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert {"success_rate", "ci_low", "ci_high", "episodes", "failures", "wall_s", "peak_rss_mb"} <= set(found)
    assert found["episodes"] == 4
    assert sum(found["failures"].values()) == round(4 * (1 - found["success_rate"]))
    assert found["ci_low"] <= found["success_rate"] <= found["ci_high"]
    assert printed.err == ""
    points = [(row["current"], row["attenuation"]) for row in read_table(out).to_pylist()]
    assert sorted(points) == [(0.0, 0.2), (0.0, 0.8), (0.4, 0.2), (0.4, 0.8)]

    assert main(["dock", "conical", "--from", f"{out}#2", "--json"]) in (0, 1)
    replay = capsys.readouterr()
    row = read_table(out).to_pylist()[2]
    result = json.loads(replay.out)
    assert json.loads(row.pop("poses_by_solver")) == result["poses_by_solver"]
    assert {name: result[name] for name in row if name in result} == {name: row[name] for name in row if name in result}
    assert "bit for bit" in replay.err

    assert main(["sweep", "--out", str(out), "--resume", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["episodes"] == 4


def test_killed_and_resumed_the_table_is_that_of_an_undisturbed_run(tmp_path):
    flags = [*FLAGS, "--episodes", "16", "--json"]
    assert main(["sweep", *flags, "--out", str(tmp_path / "whole"), "--executor", "serial"]) == 0
    whole = read_table(tmp_path / "whole")
    out = tmp_path / "killed"
    journal = out / "journal.jsonl"
    process = subprocess.Popen(
        command("sweep", *flags, "--out", str(out), "--workers", "2"), start_new_session=True, stdout=subprocess.PIPE
    )
    started = time.monotonic()
    while not (journal.exists() and journal.read_bytes().count(b"\n") >= 3) and process.poll() is None:
        assert time.monotonic() - started < 200
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    kept = read_table(out).to_pylist()
    assert len(kept) >= 3
    done = run("sweep", "--out", str(out), "--resume", "--workers", "2", "--json")
    assert done.returncode == 0, done.stderr
    assert read_table(out).equals(whole)
    assert read_table(out).to_pylist()[kept[0]["episode"]] == kept[0]


@pytest.mark.parametrize("station", STATIONS)
def test_an_episode_of_any_station_is_flown_again_and_recorded(station, tmp_path, capsys):
    """The command that the report gives for a failure, as it stands there."""
    out = tmp_path / "out"
    flags = ["--station", station, "--fidelity", "beacons", "--episodes", "2", "--world.limits.max-time-s", "2"]
    assert main(["sweep", *flags, "--out", str(out), "--executor", "serial", "--json"]) == 0
    program, *words = shlex.split(replay_command(out, 1))
    assert program == "auvdock"
    assert main([*words, "--json"]) == 1
    assert "episode 1 equals the campaign's, bit for bit" in capsys.readouterr().err
    assert recording_path(out, 1).stat().st_size > 0

    other = "landing" if station != "landing" else "rotating"
    assert main(["dock", other, "--from", f"{out}#1", "--json"]) == 2
    assert f"auvdock dock {station}" in capsys.readouterr().err
    assert main(["report", str(out)]) == 0
    assert recording_path(out, 1).name in (out / "report.html").read_text()


def test_dock_alone_tells_what_it_wants(capsys):
    assert main(["dock"]) == 2
    assert "--from DIR#EPISODE" in capsys.readouterr().err
    assert main(["dock", "--help"]) == 0
    assert "landing" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "field", "remedy"),
    [
        (["--current", "0:1"], "current", None),
        (["--current", "0:0.5:0"], "current", "2 or more"),
        (["--current", "fast"], "current", "finite numbers"),
        (["--attenuation", "1:0:3"], "attenuation", "low below high"),
        (["--flicker", "none,awful"], "flicker", "moderate"),
        (["--axis", "world.start.heading_deg"], "axis", "NAME=RANGE"),
        (["--axis", "world.strat.heading_deg=0:60:4"], "strat", "start"),
        (["--level", "0,9"], "level", "0, 1, 2, 3, 4"),
        (["--episodes", "0"], "episodes", "1 to 1000000"),
        (["--workers", "0"], "workers", "1 or more"),
        (["--seed", "-1"], "seed", "0 or more"),
        (["--until-ci", "0.7"], "until-ci", "0.5"),
        (["--episode-limit", "0"], "episode-limit", "more than 0 s"),
        (["--episode-limit", "1e300"], "episode-limit", "at most"),
        (["--campaign", "no-such-file.toml"], "file", "readable"),
        (["--detector", "oracle"], "detector", "threshold"),
        (["--detector", "threshold,oracle"], "detector", "threshold"),
        (["--controller", "own,oracle"], "controller", "own"),
        (["--water", "pool,champagne"], "water", "clear"),
        (["--water", "clear,pool", "--attenuation", "0.04,0.2"], "attenuation", "0.05"),
        (["--attenuation", "0.2:1e308"], "attenuation", "at most"),
        (["--axis", "world.turbidity_per_m=0.1,0.5"], "turbidity_per_m", "0.151 1/m, Petzold's clear ocean, to 1.92"),
        (["--axis", "turbidity=0.2:1.93:3"], "turbidity_per_m", "1.92 1/m"),
        (["--axis", "turbidity=0.2,0.5", "--attenuation", "0.4"], "turbidity_per_m", "attenuation_per_m"),
        (["--axis", "turbidity=0.2,0.5", "--water", "pool"], "axes", "a water of its own"),
        (["--axis", "world.station.array_count=4,65"], "array_count", "0 to 64"),
        (["--axis", "world.start.lateral_m=0:1:999999999"], "lateral_m", "0 to 1000"),
        (["--world.station.depth-m", "1e20"], "depth_m", "11000"),
        (["--episodes", "9" * 20], "episodes", "64 bits"),
        (["--episodes", "1000001"], "episodes", "1000000"),
        (["--seed", "9" * 20], "seed", "64 bits"),
        (["--workers", "100000"], "workers", "up to"),
    ],
)
def test_input_that_cannot_be_used_is_named_in_one_line(tmp_path, capsys, words, field, remedy):
    flags = ["sweep", "--fidelity", "beacons", "--out", str(tmp_path / "out"), "--executor", "serial", *words]
    if remedy is None:
        assert main([*flags, "--episodes", "1", "--world.limits.max-time-s", "0.2", "--json"]) == 0
        return
    assert main([*flags, "--json"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert len(printed.err.splitlines()) == 1
    assert field in printed.err
    assert remedy in printed.err
    assert not (tmp_path / "out").exists()


def refusal_of_ray(tmp_path, capsys):
    flags = ["--out", str(tmp_path / "out"), "--executor", "ray", "--address", "nonsense://x", "--json"]
    assert main(["sweep", *FLAGS, "--episodes", "1", *flags]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def test_ray_address_that_leads_nowhere_is_named(tmp_path, capsys):
    pytest.importorskip("ray")
    assert "address" in (line := refusal_of_ray(tmp_path, capsys))
    assert "cluster" in line


def test_without_ray_the_extra_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    assert "auvdock[ray]" in refusal_of_ray(tmp_path, capsys)


def test_where_the_output_is_no_terminal_lines_are_plain(tmp_path, capsys):
    assert main(["sweep", *FLAGS, "--episodes", "2", "--out", str(tmp_path / "out"), "--executor", "serial"]) == 0
    lines = capsys.readouterr().err
    assert "\x1b" not in lines
    assert "\r" not in lines
    assert "2/2 episodes" in lines
    assert "left  success" in lines
