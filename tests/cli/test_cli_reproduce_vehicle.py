"""`auvdock reproduce vehicle`: published beside ours, and what it refuses."""

from __future__ import annotations

import json

import pytest

from auvdock.cli import main
from auvdock.experiments.tank_run import PUBLISHED, STICKS


def test_one_json_object_with_published_and_ours(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "vehicle", "--voltage", "16", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    rows = said["tank"]["by_voltage"]["16"]
    assert len(rows) == len(STICKS) * len(PUBLISHED)
    assert any("voltage" in assumption for assumption in said["tank"]["assumed"])
    assert {row["model"] for row in said["turns"]["models"]} > {"ours", "Prestero 2001", "Sgarioto 2006"}
    assert all(row["course_1_s"] < 0.0 < row["prestero_course_1_s"] for row in said["stability"])


def test_tables_name_what_is_assumed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "vehicle"]) == 0
    told = capsys.readouterr().out
    assert "assumed: the supply voltage" in told
    assert "hands off" in told


def test_a_voltage_beyond_the_measurements_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "vehicle", "--voltage", "25"]) == 2
    assert "voltage: 25.0" in capsys.readouterr().err
