"""Reads recordings back with Rerun's own reader."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rerun as rr
from rerun.chunk import RrdReader


@dataclass(frozen=True)
class Column:
    """A component of an entity over time.

    Attributes:
        frames: value of the timeline `frame` of each row, empty if the rows are static.
        times_s: value of the timeline `sim_time`.
        values: what each row holds, a list with one entry per instance.
    """

    frames: list[int]
    times_s: list[float]
    values: list[Any]


class Recording:
    """All of a file's data."""

    def __init__(self, path: Path) -> None:
        with warnings.catch_warnings():
            # A killed run has no footer: the reader says so and reads the whole file instead.
            warnings.simplefilter("ignore")
            reader = RrdReader(path)
        self.recordings = reader.recordings()
        self.blueprints = reader.blueprints()
        self._chunks = [chunk for entry in self.recordings for chunk in reader.stream(store=entry)]
        self._blueprint_chunks = [chunk for entry in self.blueprints for chunk in reader.stream(store=entry)]

    @property
    def entities(self) -> set[str]:
        return {chunk.entity_path for chunk in self._chunks}

    @property
    def temporal_entities(self) -> set[str]:
        return {chunk.entity_path for chunk in self._chunks if not chunk.is_static}

    def column(self, entity: str, component: str) -> Column:
        """All temporal rows, ordered by frame."""
        rows: list[tuple[int, float, Any]] = []
        for chunk in self._chunks:
            batch = chunk.to_record_batch()
            if chunk.entity_path != entity or chunk.is_static or component not in batch.schema.names:
                continue
            frames = batch.column("frame").to_pylist()
            times_s = [value.value * 1e-9 for value in batch.column("sim_time")]
            rows += zip(frames, times_s, batch.column(component).to_pylist(), strict=True)
        rows.sort(key=lambda row: row[0])
        return Column([row[0] for row in rows], [row[1] for row in rows], [row[2] for row in rows])

    def static(self, entity: str, component: str) -> list[Any]:
        """The static value logged last."""
        found = [
            chunk.to_record_batch().column(component).to_pylist()[-1]
            for chunk in self._chunks
            if chunk.entity_path == entity and chunk.is_static and component in chunk.to_record_batch().schema.names
        ]
        return found[-1]

    def blueprint_values(self, component: str) -> list[Any]:
        """All values of a component in the blueprint."""
        return [
            value
            for chunk in self._blueprint_chunks
            if component in chunk.to_record_batch().schema.names
            for row in chunk.to_record_batch().column(component).to_pylist()
            for value in row
        ]


def no_global_recording() -> bool:
    return rr.get_global_data_recording() is None and rr.get_thread_local_data_recording() is None
