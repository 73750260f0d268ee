"""Standard output and standard error that a full disk, a closed pipe or an odd encoding does not turn into a traceback.

What cannot be written to standard output is remembered, and the rest of it dropped: the command goes on and finishes
what else it has to do. What cannot be written to standard error is lost, there is nowhere else to tell it.
"""

from __future__ import annotations

import codecs
import errno
import io
import os
import sys
from collections.abc import Generator, Iterable
from contextlib import contextmanager, suppress
from typing import Any, TextIO, cast

__all__ = ["Forgiving", "forgiving_streams"]

_HANDLER = "auvdock"
_PLAIN = {"°": "deg", "±": "+-", "≤": "<=", "×": "x", "²": "2", "³": "3", "–": "-", "•": "*", "…": "..."}
"""What stands for a character in an encoding that lacks it; a line of a box see `_stand_in`, any other its number."""


class Forgiving:
    """A text stream whose failure to write is remembered in `error` instead of raised; everything else is passed on."""

    def __init__(self, stream: TextIO | None) -> None:
        """Wrap a stream; None is one that was closed before the program began."""
        self._stream = stream if stream is not None else io.StringIO()
        self.error: OSError | None = None if stream is not None else OSError(errno.EBADF, os.strerror(errno.EBADF))

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - a stream's own attributes
        """Whatever else a stream has."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, unless an earlier write has failed."""
        if self.error is None:
            try:
                return self._stream.write(text)
            except OSError as error:
                self._fail(error)
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write one after the other."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Flush, unless an earlier write has failed."""
        if self.error is None:
            try:
                self._stream.flush()
            except OSError as error:
                self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.error = error
        # Python flushes what its buffer still holds when the program ends, and would fail once more.
        with suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)


@contextmanager
def forgiving_streams() -> Generator[tuple[Forgiving, Forgiving]]:
    """Let `sys.stdout` and `sys.stderr` be forgiving within this context, and able to show any text."""
    before = sys.stdout, sys.stderr
    out, err = Forgiving(cast("TextIO | None", before[0])), Forgiving(cast("TextIO | None", before[1]))
    handlers = [(stream, stream.errors) for stream in before if isinstance(stream, io.TextIOWrapper)]
    for stream, _ in handlers:
        stream.reconfigure(errors=_HANDLER)
    sys.stdout, sys.stderr = cast(TextIO, out), cast(TextIO, err)
    try:
        yield out, err
    finally:
        out.flush()
        err.flush()
        sys.stdout, sys.stderr = before
        for stream, errors in handlers:
            stream.reconfigure(errors=errors)


def _stand_in(error: UnicodeError) -> tuple[bytes, int]:
    """What is written for text that the stream's encoding lacks: see `codecs.register_error`.

    A byte of a file name that is no text is written as that byte, so that what is printed names the file; the lines of
    a box become strokes, a few signs are spelled out, and everything else becomes its number.
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    written = b""
    for character in error.object[error.start : error.end]:
        code = ord(character)
        if 0xDC80 <= code <= 0xDCFF:
            written += bytes([code - 0xDC00])
        elif 0x2500 <= code <= 0x257F:
            written += b"-" if character in "─━═╴╸╶╺" else b"|" if character in "│┃║" else b"+"
        else:
            written += _PLAIN.get(character, character).encode("ascii", "backslashreplace")
    return written, error.end


codecs.register_error(_HANDLER, _stand_in)
