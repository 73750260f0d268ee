"""All that the command line prints with. Text is shown as it is: a `[` in a folder's name is no markup of Rich's.

No other file of this room may make a console or a progress bar of its own, nor write markup: coloured text is a
`rich.text.Text`. `tests/cli/test_cli_console.py` holds them to that.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

__all__ = ["command_line", "counting_progress", "description", "live", "messages", "output", "shown", "tell", "track"]

T = TypeVar("T")


def output() -> Console:
    """Standard output."""
    return Console(markup=False, emoji=False)


def messages() -> Console:
    """Standard error."""
    return Console(stderr=True, markup=False, emoji=False)


def tell(text: str) -> None:
    """One line on standard error, however many lines `text` has."""
    print(f"auvdock: {' '.join(text.splitlines())}", file=sys.stderr, flush=True)


def shown(name: str) -> str:
    """A file's name as text; bytes of it that are none become question marks."""
    return name.encode("utf-8", "replace").decode()


def command_line(*words: str | Path) -> str:
    """A command as one may paste it into a shell; a path that begins with a dash is not taken for a flag."""
    return shlex.join(f"./{word}" if isinstance(word, Path) and str(word)[0] == "-" else str(word) for word in words)


def description() -> TextColumn:
    """A progress bar's column with the task's description."""
    return TextColumn("{task.description}", markup=False)


def live(console: Console, *columns: ProgressColumn) -> Progress:
    """A progress bar that goes away at its end; none where the console is no terminal."""
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)


def counting_progress() -> Progress:
    """A bar on standard error with the number of steps done and to do."""
    return live(
        messages(),
        description(),
        BarColumn(40),
        TextColumn("{task.completed}/{task.total}", markup=False),
        TimeElapsedColumn(),
    )


def track(items: Iterable[T], name: str, total: int | None = None) -> Generator[T]:
    """The items, one after the other, with a bar on standard error that tells how many are done.

    Args:
        items: what is worked on.
        name: of the work.
        total: how many they are, where they have no length.
    """
    columns = (description(), BarColumn(), TextColumn("{task.percentage:>3.0f}%", markup=False), TimeRemainingColumn())
    with live(messages(), *columns) as progress:
        yield from progress.track(items, total=total, description=name)
