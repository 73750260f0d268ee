"""The viewer is replaced by a script through Rerun's own variable RERUN_CLI_PATH: no window opens in a test."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from auvdock.core.errors import AuvdockError, ConfigError
from auvdock.recording.viewer import view


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, body: str) -> None:
    script = folder / "viewer"
    script.write_text(f"#!{sys.executable}\nimport json, sys\nfrom pathlib import Path\n{body}\n")
    script.chmod(0o755)
    monkeypatch.setenv("RERUN_CLI_PATH", str(script))


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.rrd"
    path.write_bytes(b"RRF2" + bytes(12))
    return path


def test_the_viewer_gets_the_file(tmp_path: Path, recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = tmp_path / "told.json"
    stand_in(tmp_path, monkeypatch, f"Path({str(told)!r}).write_text(json.dumps(sys.argv[1:]))")
    monkeypatch.chdir(tmp_path)
    view(Path("run.rrd"))
    arguments = json.loads(told.read_text())
    assert str(recording) in arguments
    assert arguments[arguments.index("--bind") + 1] == "127.0.0.1"


def test_a_viewer_that_does_not_start_says_why(
    tmp_path: Path, recording: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(
        tmp_path,
        monkeypatch,
        "print('Error: os error at /src/a.rs:7: no DISPLAY is set.', file=sys.stderr); print('bye'); sys.exit(1)",
    )
    with pytest.raises(AuvdockError, match="code 1: Error: no DISPLAY is set;"):
        view(recording)


def test_a_missing_viewer_is_an_error(tmp_path: Path, recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RERUN_CLI_PATH", str(tmp_path / "nowhere"))
    with pytest.raises(AuvdockError, match="Could not find rerun"):
        view(recording)


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 not a recording"])
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "run.rrd"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        view(path)
    assert caught.value.value == str(path)


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        view(tmp_path)
