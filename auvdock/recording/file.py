"""A stream's file, written here and not by Rerun, so that a full disk can be told.

Rerun's own file sink writes from a thread of its own. If that fails, it says so on standard error, ends, and from then
on every flush waits for ever. So Rerun writes into a pipe, and a thread here moves the bytes from there to the file: an
error is kept in `failure`, and what comes after it is thrown away. A file that ends within a message cannot be read, so
an incomplete one is cut back to where it was last whole.
"""

from __future__ import annotations

import atexit
import os
import selectors
import threading
from contextlib import suppress
from pathlib import Path

import rerun as rr

__all__ = ["RecordingFile"]

_PIPES = Path("/dev/fd")
"""Where an open pipe has a path that Rerun can open; Windows has none, there Rerun writes the file itself."""
_CHUNK = 1 << 16
_PATIENCE_S = 0.05


class RecordingFile:
    """The file that a stream is saved to."""

    def __init__(self, stream: rr.RecordingStream, path: Path) -> None:
        """Create the file, or empty an older one, and send the stream's data there.

        Raises:
            OSError: it cannot be opened.
        """
        self.failure: str | None = None
        """Why the file is incomplete; None as long as all is well."""
        self._stream = stream
        self._thread: threading.Thread | None = None
        self._ended = threading.Event()
        self._moving = threading.Lock()
        self._written = self._whole = 0
        """Bytes in the file, and how many of them are whole messages for certain."""
        if _PIPES.is_dir():
            self._file = path.open("wb", buffering=0)
            self._pipe, entrance = os.pipe()
            self._selector = selectors.DefaultSelector()
            self._selector.register(self._pipe, selectors.EVENT_READ)
            self._thread = threading.Thread(target=self._move, name=f"recording {path.name}", daemon=True)
            self._thread.start()
            stream.save(_PIPES / str(entrance))
            os.close(entrance)  # Rerun has opened it for itself
        else:
            path.open("wb").close()
            stream.save(path)
        self._process = os.getpid()
        atexit.register(self._leave)

    def flush(self) -> None:
        """Wait until all that Rerun was given is in the file; a disk that is slow holds the caller up here."""
        self._stream.flush()
        if self._thread is not None:
            with self._moving:
                self._move_all()
                if self.failure is None:
                    self._whole = self._written

    def close(self) -> None:
        """Let Rerun write its end, and close the file; `failure` is then final."""
        atexit.unregister(self._leave)
        self._stream.flush()
        self._stream.disconnect()
        if self._thread is None:
            return
        self._ended.set()
        self._thread.join()
        self._thread = None
        self._selector.close()
        os.close(self._pipe)
        if self.failure is not None:
            with suppress(OSError):  # no regular file
                self._file.truncate(self._whole)
        try:
            self._file.close()
        except OSError as error:  # some network file systems tell only now
            self._fail(error)

    def _leave(self) -> None:
        """Close what nobody closed, or Rerun's own end would wait for a pipe that is no longer read."""
        if os.getpid() == self._process:  # a forked child has neither thread nor stream
            self.close()

    def _move(self) -> None:
        """Move bytes until Rerun has closed its end of the pipe.

        A forked child may hold that end as well; then no more bytes after `close` began are the end.
        """
        while True:
            if self._selector.select(_PATIENCE_S):
                with self._moving:
                    if not self._move_all():
                        return
            elif self._ended.is_set():
                return

    def _move_all(self) -> bool:
        """Move what is in the pipe now; False at its end."""
        while self._selector.select(0.0):
            data = os.read(self._pipe, _CHUNK)
            if not data:
                return False
            self._write(data)
        return True

    def _write(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest and self.failure is None:
            try:
                count = self._file.write(rest)
            except OSError as error:
                self._fail(error)
            else:
                self._written += count
                rest = rest[count:]

    def _fail(self, error: OSError) -> None:
        self.failure = self.failure or error.strerror or str(error)
