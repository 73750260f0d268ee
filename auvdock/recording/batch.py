"""A stream at the times of some control periods: one call writes a column."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import rerun as rr

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.recording import paths

__all__ = ["PIXEL_CORNER", "Batch"]

PIXEL_CORNER = 0.5
"""Rerun's (0, 0) is the corner of the first pixel, this package's its centre."""


class Batch:
    """A stream at the times of some rows."""

    def __init__(self, stream: rr.RecordingStream, frames: IntArray, times_s: Array) -> None:
        """Bind to the numbers (n,) and times (n,) of the periods."""
        self._stream = stream
        self._frames = frames
        self._times_s = times_s
        self._index = (rr.TimeColumn(paths.SIM_TIME, duration=times_s), rr.TimeColumn(paths.FRAME, sequence=frames))

    def select(self, index: IntArray) -> Batch:
        """Only some rows."""
        if len(index) == len(self._frames):
            return self
        return Batch(self._stream, self._frames[index], self._times_s[index])

    def send(self, path: str, columns: Iterable[rr.ComponentColumn]) -> None:
        """One row of each column per time."""
        self._stream.send_columns(path, self._index, columns, strict=True)

    def scalars(self, path: str, values: Array, present: BoolArray | None = None) -> None:
        """One or several series; `values` has a row for each time, or for each that is `present`."""
        width = 1 if values.ndim == 1 else values.shape[1]
        lengths = np.full(len(self._frames), width) if present is None else width * present.astype(np.int64)
        self.send(path, rr.Scalars.columns(scalars=values.ravel()).partition(lengths))
