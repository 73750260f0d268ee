"""People's own text is printed as it is: no markup, no emoji codes, whole lines, commands that can be pasted."""

from __future__ import annotations

import ast
import io
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.table import Table

import auvdock.cli
from auvdock.cli.console import command_line, description, live, messages, output, tell, track

MARKED = st.text(st.sampled_from("ab[]/:#=\\@ ") | st.characters(categories=("L", "N", "P", "S")), min_size=1).map(
    lambda text: f"x{text}x"
)
ODD = ("r[/x]", "out[seed]", "[bold]", ":warning:", "a[link=b]c", "\\[x]")


def printed(*what: object, width: int = 2000, **how: Any) -> str:
    console = output()
    console.file = io.StringIO()
    console.width = width
    console.print(*what, **how)
    return console.file.getvalue()


@given(MARKED)
def test_lines_cells_and_titles_show_text_as_it_is(text):
    table = Table(title=text)
    table.add_column(text, no_wrap=True)
    table.add_row(text)
    for how in (printed(text), printed(text, highlight=False, soft_wrap=True), printed(table)):
        assert text in how
    assert printed(table).count(text) == 3


@pytest.mark.parametrize("name", ODD)
def test_progress_bars_show_names_as_they_are(name):
    console = messages()
    console.width = 200
    progress = live(console, description())
    progress.add_task(name, total=1)
    assert name in "".join(segment.text for segment in console.render(progress.get_renderable()))


@pytest.mark.parametrize("name", ODD)
def test_tracking_yields_everything(name, capsys):
    assert list(track([1, 2, 3], name)) == [1, 2, 3]
    assert capsys.readouterr() == ("", "")  # no terminal, no bar


@given(st.lists(st.text(st.characters(exclude_characters="\0"), min_size=1), min_size=1))
def test_a_command_can_be_pasted(words):
    assert shlex.split(command_line("auvdock", *words)) == ["auvdock", *words]
    assert not command_line(Path("-record.rrd")).startswith("-")


def test_a_long_line_stays_one():
    name = "folder " * 30
    assert printed(name, width=80, soft_wrap=True) == f"{name}\n"


def test_an_error_of_several_lines_is_told_in_one(capsys):
    tell("one\ntwo\r\nthree")
    assert capsys.readouterr().err == "auvdock: one two three\n"


def other_files() -> Iterator[tuple[str, ast.AST]]:
    """Every node of the room's other files, with its place."""
    folder = Path(auvdock.cli.__file__).parent
    for path in sorted(set(folder.glob("*.py")) - {folder / "console.py"}):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            yield path.name, node


def test_no_text_is_written_as_markup():
    """It would be printed as it is: `[red]5 lost[/red]`."""
    texts = [(name, node.value) for name, node in other_files() if isinstance(node, ast.Constant)]
    assert len(texts) > 1000
    assert [text for text in texts if isinstance(text[1], str) and re.search(r"\[/[a-z ]*\]", text[1])] == []


def test_no_other_file_makes_a_console_of_its_own():
    found: list[str] = []
    for file, node in other_files():
        name = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
        if name in ("Console", "Progress", "TextColumn"):
            found.append(f"{file}: {name}")
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rich"):
            found += [f"{file}: {alias.name}" for alias in node.names if alias.name in ("track", "print")]
    assert found == []
