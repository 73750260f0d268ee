"""An observer that streams an episode to a Rerun file."""

from __future__ import annotations

import dataclasses
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import rerun as rr

from auvdock.core.arrays import Image
from auvdock.core.errors import AuvdockError, AuvdockWarning, ConfigError
from auvdock.recording import paths
from auvdock.recording.columns import ColumnWriter, Row
from auvdock.recording.file import RecordingFile
from auvdock.recording.layout import make_blueprint
from auvdock.recording.parts import part_of
from auvdock.recording.scene import log_scene
from auvdock.recording.summary import result_document, unfinished_document

if TYPE_CHECKING:
    from auvdock.episode.result import EpisodeResult
    from auvdock.episode.trace import EpisodeSetup
    from auvdock.metrics.tick import Tick

__all__ = ["RecordingWarning", "RerunRecorder", "check_writable"]

_BATCH_ROWS = 256
_BATCH_WALL_S = 0.5


class RecordingWarning(AuvdockWarning):
    """A recording is incomplete, its file could not be written any further."""


class RerunRecorder:
    """Records one episode to an .rrd file; implements `auvdock.episode.trace.EpisodeObserver`.

    Control periods are gathered and written in batches of at most 256, or half a second of wall-clock time: writing
    each by itself would cost more than simulating it. Each batch reaches the file at once, so a killed run leaves a
    recording that lacks its last half second. Each recorder has a stream of its own; several can be open side by side.

    A file that cannot be written any further, on a full disk say, ends the recording and not the episode: `failure`
    says why, and `close` warns of it by a `RecordingWarning`.
    """

    def __init__(self, path: Path, *, image_every: int = 1, jpeg_quality: int = 80) -> None:
        """Check that the file can be written; it is written from `on_start` on.

        Args:
            path: file to write, with the ending .rrd; an older file of that name is replaced when the episode starts.
            image_every: record every n-th rendered frame.
            jpeg_quality: 1 to 100.

        Raises:
            ConfigError: the path cannot be written, or a number is out of its range.
        """
        if image_every < 1:
            raise ConfigError("image_every", image_every, "1 or more, to record every n-th frame")
        if not 1 <= jpeg_quality <= 100:
            raise ConfigError("jpeg_quality", jpeg_quality, "1 to 100")
        check_writable(path)
        self.path = path
        self.failure: str | None = None
        """Why the last recording is incomplete; None if it is whole, or was not begun."""
        self._image_every = image_every
        self._jpeg_options = (cv2.IMWRITE_JPEG_QUALITY, jpeg_quality)
        self._setup: EpisodeSetup | None = None
        self._stream: rr.RecordingStream | None = None
        self._file: RecordingFile | None = None
        self._writer: ColumnWriter | None = None
        self._rows: list[Row] = []
        self._frame = 0
        self._images = 0
        self._batch_began_s = 0.0

    def on_start(self, setup: EpisodeSetup) -> None:
        """Open the file and write what stays the same.

        Raises:
            AuvdockError: the environment switches Rerun off, or the file can no longer be written.
        """
        self.close()
        self.failure = None
        stream = rr.RecordingStream(paths.APPLICATION_ID)
        if not rr.is_enabled(stream):
            raise AuvdockError("the environment variable RERUN switches recordings off; unset it to record")
        try:
            self._file = RecordingFile(stream, self.path)
        except OSError as error:
            raise _unwritable(self.path, error) from error
        stream.send_recording_name(setup.title)
        part = part_of(setup)
        stream.send_blueprint(make_blueprint(setup, part))
        log_scene(stream, setup, part)
        _log_document(stream, unfinished_document(setup))
        self._file.flush()
        self._setup, self._stream, self._writer = setup, stream, ColumnWriter(stream, setup, part)
        self._frame = self._images = 0

    def on_tick(self, tick: Tick) -> None:
        """Add a control period."""
        if not self._rows:
            self._batch_began_s = time.monotonic()
        self._rows.append(Row(self._frame, dataclasses.replace(tick, image=None), self._encode(tick.image)))
        self._frame += 1
        if len(self._rows) >= _BATCH_ROWS or time.monotonic() - self._batch_began_s >= _BATCH_WALL_S:
            self._write_batch()

    def on_end(self, result: EpisodeResult) -> None:
        """Write the rest and the result."""
        stream, setup = self._stream, self._setup
        if stream is None or setup is None:
            raise RuntimeError("on_end came before on_start or after close")
        self._write_batch()
        _log_document(stream, result_document(setup, result))

    def close(self) -> None:
        """Write what is left and close the file; does nothing if it is closed."""
        try:
            self._write_batch()
        finally:
            file, self._file = self._file, None
            self._setup = self._stream = self._writer = None
            if file is not None:
                file.close()
                self.failure = file.failure
        if file is not None and self.failure is not None:
            warnings.warn(f"{self.path} is incomplete: {self.failure}", RecordingWarning, stacklevel=2)

    def _write_batch(self) -> None:
        rows, self._rows = self._rows, []
        if not rows:
            return
        if self._writer is None or self._file is None:
            raise RuntimeError("a tick came before on_start or after close")
        if self._file.failure is None:
            self._writer.write(rows)
            self._file.flush()

    def _encode(self, image: Image | None) -> bytes | None:
        """The image as JPEG if it is one to record; a black one before the first, so that marks have a ground."""
        if image is None:
            if self._frame > 0 or self._setup is None:
                return None
            camera = self._setup.camera
            return self._jpeg(np.zeros((camera.height_px, camera.width_px, 3), dtype=np.uint8))
        number = self._images
        self._images += 1
        if number % self._image_every != 0:
            return None
        return self._jpeg(image)

    def _jpeg(self, image: Image) -> bytes:
        _, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), self._jpeg_options)
        return data.tobytes()


def _log_document(stream: rr.RecordingStream, text: str) -> None:
    text = text.encode("utf-8", "replace").decode()  # it may name a file whose name is no text
    stream.log(paths.SUMMARY, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True, strict=True)


def check_writable(path: Path) -> None:
    """Refuse a path that cannot be opened for writing; leaves the folder as it was.

    Raises:
        ConfigError: such a path.
    """
    if path.suffix != ".rrd":
        raise ConfigError("record", str(path), "a file name that ends in .rrd")
    try:
        if not path.parent.is_dir():
            raise ConfigError("record", str(path), f"a file in a folder that exists; {path.parent} does not")
        existed = path.exists()
        with path.open("ab"):
            pass
        if not existed:
            path.unlink()
    except OSError as error:
        raise _unwritable(path, error) from error


def _unwritable(path: Path, error: OSError) -> ConfigError:
    return ConfigError("record", str(path), f"a file that can be written ({error.strerror})")
