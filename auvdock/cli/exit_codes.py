"""What the program's exit code tells; scripts go by these numbers."""

from __future__ import annotations

__all__ = ["BAD_INPUT", "BROKEN_PIPE", "DONE", "FAULT", "INTERRUPTED", "NOT_MET", "NOT_WRITTEN", "with_unwritten"]

DONE = 0
"""Docked; or whatever the command is for has been done."""
NOT_MET = 1
"""Not docked; or a target that the command's help names was not met."""
BAD_INPUT = 2
"""Input that cannot be used."""
FAULT = 70
"""An exception that nobody foresaw (EX_SOFTWARE of sysexits.h)."""
NOT_WRITTEN = 74
"""Something that was asked for could not be written (EX_IOERR of sysexits.h), a recording or standard output; beside
`NOT_MET` it is one more."""
INTERRUPTED = 130
"""By the user; 128 and the number of SIGINT, as a shell counts."""
BROKEN_PIPE = 141
"""Whoever read standard output has gone; 128 and the number of SIGPIPE."""


def with_unwritten(code: int) -> int:
    """The code of a command of whose result something could not be written: it tells of both."""
    return NOT_WRITTEN + code if code in (DONE, NOT_MET) else code
