"""An exception that nobody foresaw is no verdict: exit code 70, one line, and the traceback in a file."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from types import ModuleType

import pytest

from auvdock.cli import crash
from auvdock.cli.main import COMMANDS, main

ALL = sorted(COMMANDS)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.chdir(tmp_path)
    return folder


def break_command(command: tuple[str, ...], error: BaseException, monkeypatch: pytest.MonkeyPatch) -> None:
    def run(argv: list[str], prog: str) -> int:
        raise error

    module = ModuleType("broken")
    monkeypatch.setattr(module, "run", run, raising=False)
    monkeypatch.setitem(sys.modules, "broken", module)
    monkeypatch.setitem(COMMANDS, command, ("broken:run", "break"))


@pytest.mark.parametrize("command", ALL)
def test_every_command(command, temporary, monkeypatch, capsys):
    break_command(command, RuntimeError("first line\nsecond [/x] line"), monkeypatch)
    assert main([*command, "--seed", "5"]) == 70
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "RuntimeError: first line second [/x] line" in captured.err
    (file,) = temporary.iterdir()
    assert str(file) in captured.err
    text = file.read_text(encoding="utf-8")
    assert f"auvdock {' '.join(command)} --seed 5" in text
    assert "Traceback (most recent call last)" in text
    assert "mujoco" in text


def test_the_current_folder_serves_where_temporary_files_cannot_be(temporary, monkeypatch, capsys):
    temporary.rmdir()
    break_command(("bench",), ValueError("why"), monkeypatch)
    assert main(["bench"]) == 70
    (file,) = Path.cwd().glob("auvdock-crash-*.txt")
    assert str(file) in capsys.readouterr().err


def test_without_any_file_the_traceback_is_on_standard_error(temporary, monkeypatch, capsys):
    def full(*args: object, **flags: object) -> tuple[int, str]:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(crash.tempfile, "mkstemp", full)
    break_command(("bench",), ValueError("why"), monkeypatch)
    assert main(["bench"]) == 70
    error = capsys.readouterr().err
    assert "ValueError: why" in error.splitlines()[0]
    assert "Traceback (most recent call last)" in error


def test_text_that_is_none_does_not_hinder_the_report(temporary, monkeypatch, capsys):
    break_command(("view",), KeyError("\udcff"), monkeypatch)
    assert main(["view", "odd\udcff.rrd"]) == 70
    (file,) = temporary.iterdir()
    assert "udcff" in file.read_text(encoding="utf-8")


def test_a_plug_in_that_ends_the_program_with_a_word_gives_no_verdict(temporary, monkeypatch, capsys):
    break_command(("bench",), SystemExit("good bye"), monkeypatch)
    assert main(["bench"]) == 70
    assert "SystemExit: good bye" in capsys.readouterr().err


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (SystemExit(2), 2), (SystemExit(), 0)])
def test_other_ends_keep_their_codes(error, code, temporary, monkeypatch, capsys):
    break_command(("bench",), error, monkeypatch)
    assert main(["bench"]) == code
    assert list(temporary.iterdir()) == []
