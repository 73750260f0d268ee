"""An exception that nobody foresaw: one line for the person, the traceback in a file for whoever mends it."""

from __future__ import annotations

import os
import platform
import shlex
import sys
import tempfile
import traceback
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from auvdock.cli.console import tell

__all__ = ["report_crash"]

_PACKAGES = ("auvdock", "mujoco", "numpy", "numba", "opencv-python-headless", "rerun-sdk", "rich", "tyro")
_LONGEST = 200
"""Characters of the exception's own words that the one line shows."""


def report_crash(error: BaseException, words: Sequence[str]) -> None:
    """Tell of the exception in one line, and write its traceback to a file, or else to standard error.

    Args:
        error: what was raised.
        words: the command line, without the program's name.
    """
    said = " ".join(str(error).split())
    short = said if len(said) <= _LONGEST else f"{said[:_LONGEST]}..."
    what = f"{type(error).__name__}: {short}" if short else type(error).__name__
    text = _document(error, words)
    path = _write(text)
    where = "the traceback below; no file could be written for it" if path is None else str(path)
    tell(f"unexpected error: {what}; the command has no result: please report this with {where}")
    if path is None:
        print(text, end="", file=sys.stderr, flush=True)


def _document(error: BaseException, words: Sequence[str]) -> str:
    versions = ", ".join(f"{name} {_version(name)}" for name in _PACKAGES)
    return (
        f"command: auvdock {shlex.join(words)}\n"
        f"system: {platform.platform()}, Python {platform.python_version()}\n"
        f"versions: {versions}\n\n"
        f"{''.join(traceback.format_exception(error))}"
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "missing"


def _write(text: str) -> Path | None:
    """In the folder for temporary files, or else in the current one."""
    for folder in (None, os.curdir):
        name = None
        try:
            handle, name = tempfile.mkstemp(prefix="auvdock-crash-", suffix=".txt", dir=folder)
            with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
            return Path(name).absolute()
        except OSError:
            if name is not None:
                with suppress(OSError):
                    os.unlink(name)  # what a full disk left of it
    return None
