"""Tracks as others may see them, made only when somebody looks: recordings do, campaigns do not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import overload

import numpy as np

from auvdock.core.contracts import TrackView
from auvdock.numeric.records import Records
from auvdock.numeric.tracks import Track

__all__ = ["TrackViews"]


class TrackViews(Sequence[TrackView]):
    """The tracks of one frame; holds copies, so it stays what it was when the tracker goes on."""

    __slots__ = ("_made", "_rows")

    def __init__(self, tracks: Records[Track]) -> None:
        """Copy the tracks (n,), byte by byte: NumPy takes a hundred times as long to copy records."""
        self._rows = tracks.tobytes()
        self._made: tuple[TrackView, ...] | None = None

    def __len__(self) -> int:
        """Number of tracks."""
        return len(self._rows) // Track.dtype().itemsize

    def __iter__(self) -> Iterator[TrackView]:
        """In the tracker's order."""
        return iter(self._views())

    @overload
    def __getitem__(self, index: int) -> TrackView: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[TrackView, ...]: ...

    def __getitem__(self, index: int | slice) -> TrackView | tuple[TrackView, ...]:
        """One or several of them."""
        return self._views()[index]

    def _views(self) -> tuple[TrackView, ...]:
        if self._made is None:
            rows = np.frombuffer(self._rows, dtype=Track.dtype())
            names = ("track_id", "class_id", "beacon_id", "missed")
            columns = zip(rows["centre_px"].copy(), *(rows[name].tolist() for name in names), strict=True)
            self._made = tuple(
                TrackView(track_id, centre, class_id, beacon_id if beacon_id >= 0 else None, missed)
                for centre, track_id, class_id, beacon_id, missed in columns
            )
        return self._made
