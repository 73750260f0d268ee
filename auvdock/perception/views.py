"""Tracks as others may see them, made only when somebody looks: recordings do, campaigns do not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import overload

from auvdock.core.arrays import Array, IntArray
from auvdock.core.contracts import TrackView

__all__ = ["TrackViews"]


class TrackViews(Sequence[TrackView]):
    """The tracks of one frame; holds copies, so it stays what it was when the tracker goes on."""

    __slots__ = ("_centre_px", "_labels", "_made")

    def __init__(self, centre_px: Array, labels: IntArray) -> None:
        """Copy what the views will show.

        Args:
            centre_px: (n, 2 or more) positions in the first columns.
            labels: (n, 4 or more) track id, class id, beacon id (-1 for none), frames missed in the first columns.
        """
        self._centre_px = centre_px.copy()
        self._labels = labels.copy()
        self._made: tuple[TrackView, ...] | None = None

    def __len__(self) -> int:
        """Number of tracks."""
        return len(self._labels)

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
            rows = zip(self._labels[:, :4].tolist(), self._centre_px[:, :2], strict=True)
            self._made = tuple(
                TrackView(track_id, centre, class_id, beacon_id if beacon_id >= 0 else None, missed)
                for (track_id, class_id, beacon_id, missed), centre in rows
            )
        return self._made
