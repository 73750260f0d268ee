"""Flags that cannot be used: exit code 2 and one line that names the flag and what would be right."""

from __future__ import annotations

import io
import sys

import pytest

from auvdock.cli.flag_errors import one_line
from auvdock.cli.main import COMMANDS, main

WITH_FLAGS = sorted(set(COMMANDS) - {("dock",)})


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
@pytest.mark.parametrize("command", WITH_FLAGS, ids=" ".join)
def test_an_unknown_flag_of_every_command(command, encoding, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding))  # tyro draws its box accordingly
    assert main([*command, "--nonsense"]) == 2
    captured = capsys.readouterr()
    said, hint = captured.err.split("; see ")
    # A command that lacks a file or a name says that first.
    assert said.startswith(("auvdock: error: Unrecognized options: --nonsense", "auvdock: error: Missing "))
    assert not {"─", "---", "│"} & set(said.split())
    assert hint == f"auvdock {' '.join(command)} --help\n"


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["plan", "x", "--resolution", "7.5"], ["--resolution", "'7.5'"]),
        (["plan", "x", "--resolution"], ["--resolution", "Missing value"]),
        (["plan"], ["PATH", "station"]),
        (["plan", "x", "--optimise", "[/x]"], ["--optimise", "'[/x]'", "pose_error"]),
        (["plan", "x", "--resolutoin", "7"], ["--resolutoin", "perhaps you meant", "--resolution INT"]),
        (["dock", "--from"], ["--from", "expected one argument"]),
        (["dock", "conical", "--from", "-x#3"], ["--from", "expected one argument"]),
        (["dock", "conical", "--level"], ["--level", "expected one argument"]),
        (["dock", "landing", "--station"], ["--station", "expected one argument"]),
        (["sweep", "--out"], ["--out", "expected one argument"]),
        (["sweep", "--out", "x", "--config"], ["--config", "expected one argument"]),
        (["bench", "--episodes", "0"], ["episodes: 0", "1 or more"]),
        (["fit-detector", "threshold", "--out", "x", "--frames", "0"], ["frames: 0", "1 or more"]),
        (["fit-detector", "threshold", "--out", "x", "--seed", "-1"], ["seed: -1", "0 or more"]),
        (
            ["fit-landing", "cores", "apriltag", "--out-lights", "x", "--out-tags", "y", "--frames", "-3"],
            ["frames: -3"],
        ),
        (["reproduce", "rotating-docking", "--first-seed", "-1"], ["first-seed: -1", "0 or more"]),
        (["reproduce", "rotating-docking", "--workers", "0"], ["workers: 0", "1 or more"]),
        (["reproduce", "guidance-design", "--episodes", "-1"], ["episodes: -1", "0 or more"]),
    ],
    ids=lambda value: " ".join(value[:4]),
)
def test_a_wrong_flag_is_named(words, parts, capsys):
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    for part in parts:
        assert part in error


def test_what_is_no_box_is_kept():
    assert one_line("some\nother  words\n", "auvdock x") == "some other words"
