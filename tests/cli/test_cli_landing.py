"""Bad input to `auvdock dock landing`: one line that names the field and the remedy, exit code 2."""

from __future__ import annotations

import pytest

from auvdock.cli.main import main


@pytest.mark.parametrize(
    ("words", "field", "remedy"),
    [
        (["--vehicle", "nautilus"], "vehicle", "bluerov2_heavy"),
        (["--tag-detector", "eye"], "tag_detector", "contour"),
        (["--detector", "threshold"], "detector", "cores"),  # nothing was fitted for it on landing frames
        (["--level", "9"], "level", "0"),
        (["--world.control-hz", "30"], "control_hz", "multiple"),
        (["--seed", "-1"], "seed", "0 or more"),
        (["--world.start.max-height-m", "30"], "max_height_m", "surface"),
        (["--record", "/nonexistent/folder/run.rrd"], "record", "folder"),
    ],
)
def test_bad_flags_of_a_landing(words: list[str], field: str, remedy: str, capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["dock", "landing", "--fidelity", "beacons", *words])
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert field in captured.err
    assert remedy in captured.err
