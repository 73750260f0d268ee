"""The commands with names that Rich, matplotlib, a shell or UTF-8 could trip over."""

from __future__ import annotations

import json
import os
import shlex
import sys
from pathlib import Path

import pytest

from auvdock.assets import asset
from auvdock.cli.main import main

NAME = "r[/x] out[seed] :warning: $a$ 'b' " + os.fsdecode(b"\xff")
SHORT = ["--fidelity", "beacons", "--level", "0", "--world.limits.max-time-s", "0.3"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / NAME
    try:
        place.mkdir(parents=True)  # the slash in the name makes it two folders
    except (OSError, ValueError):
        pytest.skip("this file system takes no such names")
    monkeypatch.setenv("COLUMNS", "80")
    return place


def run(capsysbinary: pytest.CaptureFixture[bytes], code: int, *words: str | Path) -> tuple[str, str]:
    assert main([str(word) for word in words]) == code, capsysbinary.readouterr().err
    captured = capsysbinary.readouterr()
    return os.fsdecode(captured.out), os.fsdecode(captured.err)


def test_from_a_campaign_to_its_report_and_back(folder, capsysbinary, monkeypatch):
    campaign = folder / "campaign.toml"
    campaign.write_text(f'name = "{NAME[:-1]}"\n', encoding="utf-8")
    out = folder / "out"
    sweep = ["sweep", "--out", out, "--campaign", campaign, "--episodes", "1", "--executor", "serial", *SHORT]
    said, _ = run(capsysbinary, 0, *sweep, "--axis", "detector=threshold,blob")
    *_, following = said.splitlines()
    assert shlex.split(following.removeprefix("next: ")) == ["auvdock", "report", str(out)]
    said, _ = run(capsysbinary, 0, "report", out)
    assert f"page: {out / 'report.html'}" in said.splitlines()
    record = folder / "a[b].rrd"
    said, _ = run(capsysbinary, 1, "dock", "--from", f"{out}#0", "--record", record)
    *_, line = said.splitlines()
    start, end = f"recording: {record}   (", ")"
    assert line.startswith(start)
    assert shlex.split(line.removeprefix(start).removesuffix(end)) == ["auvdock", "view", str(record)]
    viewer = folder.parent / "viewer"
    viewer.write_text(f"#!{sys.executable}\nimport sys\nprint(sys.argv[1:])\nsys.exit(3)\n", encoding="utf-8")
    viewer.chmod(0o755)
    monkeypatch.setenv("RERUN_CLI_PATH", str(viewer))
    _, error = run(capsysbinary, 2, "view", record)
    assert error.count("\n") == 1


def test_a_plan(folder, capsysbinary):
    station = folder / f"$a$ [b] {NAME[-1]}.toml"
    station.write_text(asset("stations", "conical").read_text(encoding="utf-8"), encoding="utf-8")
    plan = ["plan", station, "--resolution", "16", "--out", folder / "out"]
    said, _ = run(capsysbinary, 0, *plan)
    assert {str(folder / "out" / name) for name in ("sections.png", "region.rrd")} <= set(said.splitlines())
    (folder / "out" / "region.rrd").unlink()
    (folder / "out" / "region.rrd").symlink_to("/dev/full")
    said, error = run(capsysbinary, 74, *plan, "--json")
    assert json.loads(said)["files"] == [str(folder / "out" / "sections.png")]
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        *(["dock", "conical", flag, NAME] for flag in ("--config", "--detector", "--water", "--controller", "--seed")),
        ["dock", "--from", f"{NAME}#1"],
        *([command, NAME] for command in ("dock", "reproduce", "report", "view", "plan", "doctor", "bench")),
        ["fit-detector", NAME, "--out", "model.toml"],
        ["fit-landing", "cores", NAME, "--out-lights", "lights.toml", "--out-tags", "tags.toml"],
        *(["sweep", "--out", "nowhere", flag, NAME] for flag in ("--campaign", "--axis", "--executor")),
        ["reproduce", "guidance-region", "--waters", NAME, "--steps", "2"],
        ["reproduce", "guidance-design", "--water", NAME],
        ["reproduce", "landing-trials", "--levels", NAME],
        ["reproduce", "rotating-docking", "--arms", NAME],
        ["reproduce", "azimuth", "--fidelity", NAME],
        [NAME],
    ],
    ids=lambda words: "-".join(words[:3]).encode("ascii", "replace").decode(),
)
def test_a_name_that_nothing_has_is_told_in_one_line(words, tmp_path, monkeypatch, capsysbinary):
    monkeypatch.chdir(tmp_path)
    said, error = run(capsysbinary, 2, *words)
    assert said == ""
    assert error.count("\n") == 1
    assert "r[/x]" in error
    assert list(tmp_path.iterdir()) == []
