"""What cannot be written does not cost the result that is printed: a line for each file, and an exit code."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest

from auvdock.cli.exit_codes import with_unwritten
from auvdock.cli.main import main
from auvdock.cli.recorded import run_recorded
from auvdock.cli.saving import Saving
from auvdock.core.errors import ConfigError
from auvdock.recording.file import RecordingFile

SHORT = ["--fidelity", "beacons", "--level", "0", "--world.limits.max-time-s", "0.3"]


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings end after their first bytes, as on a disk that is full."""

    def write(self: RecordingFile, data: bytes) -> None:
        self._fail(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))

    monkeypatch.setattr(RecordingFile, "_write", write)


@pytest.mark.usefixtures("full_disk")
@pytest.mark.parametrize("flags", [[], ["--json"]])
def test_a_docking(flags, tmp_path, capsys):
    path = tmp_path / "run.rrd"
    assert main(["dock", "conical", *SHORT, "--record", str(path), *flags]) == 75
    captured = capsys.readouterr()
    *_, last = captured.err.splitlines()
    assert last == f"auvdock: error: recording {path} is incomplete: No space left on device"
    if flags:
        result = json.loads(captured.out)
        assert result["recording_error"] in last
        assert result["success"] is False
    else:
        assert "failed: " in captured.out
        assert "auvdock view" not in captured.out


def test_a_docking_that_is_recorded_says_so(tmp_path, capsys):
    assert main(["dock", "conical", *SHORT, "--record", str(tmp_path / "run.rrd"), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["recording_error"] is None


def test_failures_of_a_campaign(tmp_path, capsys, monkeypatch, request):
    out = tmp_path / "out"
    assert main(["sweep", "--out", str(out), "--episodes", "2", "--executor", "serial", *SHORT]) == 0
    request.getfixturevalue("full_disk")
    capsys.readouterr()
    assert main(["report", str(out), "--record-failures", "2", "--json"]) == 74
    captured = capsys.readouterr()
    assert json.loads(captured.out)["episodes"] == 2
    assert captured.err.count("is incomplete: No space left on device") == captured.err.count("\n") == 2
    assert (out / "report.html").exists()
    assert list(out.glob("**/*.rrd")) == []  # what is there is taken for whole
    monkeypatch.undo()
    assert main(["report", str(out), "--record-failures", "2"]) == 0
    assert len(list(out.glob("**/*.rrd"))) == 2


class Interrupted:
    """Flies nothing; writes part of the recording, as an episode does, and is interrupted or not."""

    def __init__(self, error: type[BaseException] | None) -> None:
        self.error = error

    def run(self, seed, observers):
        observers[0].path.write_bytes(b"part")
        if self.error is not None:
            raise self.error


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_what_is_interrupted_is_never_taken_for_whole(error, tmp_path):
    path, saving = tmp_path / "episode.rrd", Saving()
    whole: Any = Interrupted(None)
    part: Any = Interrupted(error)
    with pytest.raises(error):
        run_recorded(part, 0, path, saving, whole=True)
    assert list(tmp_path.iterdir()) == []
    run_recorded(whole, 0, path, saving, whole=True)
    assert list(tmp_path.iterdir()) == [path]
    assert saving.written == [str(path)]
    with pytest.raises(error):  # of a docking as much as was flown is kept
        run_recorded(part, 0, tmp_path / "docking.rrd", saving)
    assert (tmp_path / "docking.rrd").exists()


@pytest.mark.parametrize(("code", "told"), [(0, 74), (1, 75), (2, 2), (70, 70), (130, 130)])
def test_the_code_tells_of_both(code, told):
    assert with_unwritten(code) == told


def test_one_line_for_each_file(tmp_path, capsys):
    def refuse(path: Path) -> None:
        raise ConfigError("out", str(path), "a better one")

    saving = Saving()
    saving.text(tmp_path / "missing" / "a.json", "{}")
    saving.attempt(tmp_path / "b", refuse)
    saving.text(tmp_path / "c", "there")
    assert saving.written == [str(tmp_path / "c")]
    assert saving.finish(0) == 74
    first, second = capsys.readouterr().err.splitlines()
    assert "a.json could not be written: No such file or directory" in first
    assert "a better one" in second


def test_the_last_attempt_at_a_file_counts(tmp_path, capsys):
    saving = Saving()
    saving.text(tmp_path / "later" / "a", "x")
    (tmp_path / "later").mkdir()
    saving.text(tmp_path / "later" / "a", "x")
    assert saving.finish(1) == 1
    assert capsys.readouterr().err == ""
