"""A file of JSON lines to which every finished piece is appended at once, so that a killed process loses none."""

from __future__ import annotations

import errno
import json
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from auvdock.campaign.errors import CampaignError

__all__ = ["Journal", "read_journal", "readable_errors"]


class Journal:
    """The file, open for appending."""

    def __init__(self, path: Path) -> None:
        """Open or create it; a last line that was cut short is taken off.

        Raises:
            CampaignError: it cannot be written.
        """
        self._folder = path.parent
        with readable_errors(self._folder):
            self._file = path.open("a+b")
            self._file.seek(0)
            self._file.truncate(self._file.read().rfind(b"\n") + 1)

    def add(self, row: Mapping[str, Any]) -> None:
        """Append one line.

        Raises:
            CampaignError: it cannot be written; what was written before stays.
        """
        line = json.dumps(row, allow_nan=False)
        with readable_errors(self._folder):
            self._file.write(line.encode() + b"\n")
            self._file.flush()

    def empty(self) -> None:
        """Take all lines off."""
        with readable_errors(self._folder):
            self._file.truncate(0)

    def close(self) -> None:
        """Close the file."""
        with suppress(OSError):
            self._file.close()


def read_journal(path: Path) -> list[dict[str, Any]]:
    """Lines of a journal, none if there is no file; a last line that was cut short is none.

    Raises:
        CampaignError: the file cannot be read, or a line is damaged that is not the last.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    except OSError as error:
        raise CampaignError(f"{path}: cannot be read ({error.strerror})") from error
    lines = text.split("\n")
    rows: list[dict[str, Any]] = []
    for number, line in enumerate(lines, start=1):
        try:
            rows.append(json.loads(line))
        except ValueError as error:
            if any(later.strip() for later in lines[number:]):
                remedy = "delete that line; started again (sweep: with --resume) it runs what the line held"
                raise CampaignError(f"{path}: line {number} is damaged; {remedy}") from error
    return rows


@contextmanager
def readable_errors(folder: Path) -> Generator[None]:
    """Errors of the file system in one line; what was written stays as it was."""
    try:
        yield
    except OSError as error:
        why = error.strerror or str(error)
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        remedy = "make room" if full else "make it writable or give another --out"
        raise CampaignError(
            f"{folder}: cannot be written ({why}); {remedy}; started again (sweep: with --resume) it goes on, what was "
            "finished is kept"
        ) from error
