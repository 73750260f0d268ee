"""Standard output and error that cannot be written, or lack a character: an answer, never a traceback."""

from __future__ import annotations

import codecs
import io
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from auvdock.cli import exit_codes
from auvdock.cli.console import output
from auvdock.cli.main import COMMANDS, main
from auvdock.cli.streams import Forgiving, forgiving_streams

FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], int]], None]:
    """Makes a function the command `auvdock trial`."""

    def use(function: Callable[[], int]) -> None:
        module = ModuleType("trial")
        monkeypatch.setattr(module, "run", lambda argv, prog: function(), raising=False)
        monkeypatch.setitem(sys.modules, "trial", module)
        monkeypatch.setitem(COMMANDS, ("trial",), ("trial:run", "a trial"))

    return use


def says(code: int, done: list[str]) -> Callable[[], int]:
    """A command that prints in both ways, then finishes its work."""

    def run() -> int:
        print("a line")
        output().print("another")
        done.append("all")
        return code

    return run


@needs_full
@pytest.mark.parametrize(("code", "told"), [(0, 74), (1, 75), (2, 2), (74, 74)])
def test_a_full_disk_costs_no_work_and_is_told(code, told, command, monkeypatch, capsys):
    done: list[str] = []
    command(says(code, done))
    with FULL.open("w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        assert main(["trial"]) == told
    assert done == ["all"]
    error = capsys.readouterr().err
    assert error == "auvdock: error: standard output could not be written: No space left on device\n"


@pytest.mark.parametrize("code", [0, 1, 75])
def test_nobody_reads_any_more(code, command, monkeypatch, capsys):
    done: list[str] = []
    command(says(code, done))
    entrance, exit_ = os.pipe()
    os.close(entrance)
    with os.fdopen(exit_, "w") as pipe:
        monkeypatch.setattr(sys, "stdout", pipe)
        assert main(["trial"]) == exit_codes.BROKEN_PIPE
    assert done == ["all"]
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("stream", "code"), [("stdout", 74), ("stderr", 0)])
def test_a_stream_that_was_closed_before(stream, code, command, monkeypatch):
    command(says(0, []))
    monkeypatch.setattr(sys, stream, None)
    assert main(["trial"]) == code
    assert getattr(sys, stream) is None


@needs_full
def test_standard_error_that_cannot_be_written_changes_nothing(command, monkeypatch, capsys):
    command(says(1, []))
    with FULL.open("w") as full:
        monkeypatch.setattr(sys, "stderr", full)
        assert main(["trial"]) == 1
        assert main(["nonsense"]) == 2
    assert capsys.readouterr().out == "a line\nanother\n"


@needs_full
def test_nothing_is_said_when_the_interpreter_ends():
    with FULL.open("w") as full:
        words = [sys.executable, "-m", "auvdock.cli", "--version"]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    assert done.returncode == 74
    assert done.stderr.count("\n") == 1


@given(st.text(st.characters(codec=None)), st.sampled_from(["ascii", "latin-1", "utf-8", "cp1252"]))
def test_any_text_can_be_written_in_any_encoding(text, encoding):
    written = text.encode(encoding, "auvdock")
    if all(ord(character) < 128 for character in text):
        assert written == text.encode("ascii")
    kept = "".join(character for character in text if not codecs_lack(character, encoding))
    assert set(kept.encode(encoding)) <= set(written)


def codecs_lack(character: str, encoding: str) -> bool:
    try:
        codecs.encode(character, encoding)
    except UnicodeEncodeError:
        return True
    return False


@given(st.binary().map(os.fsdecode))
def test_a_file_name_that_is_no_text_is_printed_as_its_bytes(name):
    raw = io.BytesIO()
    assert name.encode("utf-8", "auvdock") == os.fsencode(name)
    stream = Forgiving(io.TextIOWrapper(raw, "utf-8", errors="auvdock", newline=""))
    stream.write(name)
    stream.flush()
    assert raw.getvalue() == os.fsencode(name)
    assert stream.error is None


def test_a_box_in_ascii_is_a_box():
    assert "╭─┐│ 7° ≤ 3 m³".encode("ascii", "auvdock") == b"+-+| 7deg <= 3 m3"


def test_the_streams_are_as_they_were_afterwards(monkeypatch):
    stream = io.TextIOWrapper(io.BytesIO(), "ascii", errors="strict")
    monkeypatch.setattr(sys, "stdout", stream)
    with forgiving_streams():
        print("\udcff°")
    assert sys.stdout is stream
    assert stream.errors == "strict"
    assert stream.buffer.getvalue() == b"\xffdeg\n"
