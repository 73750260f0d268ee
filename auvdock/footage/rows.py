"""What perception says of footage, a row a frame, and the files that hold it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from auvdock.core.errors import ConfigError

__all__ = ["ENDINGS", "FootageRow", "check_rows_file", "write_rows"]

ENDINGS = (".jsonl", ".parquet")
"""Of files with rows."""
_POINT = pa.list_(pa.float64())
_TYPES = {
    "frame": pa.string(),
    "lights": pa.list_(_POINT),
    "beacon_ids": pa.list_(pa.int64()),
    "pose": pa.list_(pa.list_(pa.float64())),
    "measured": pa.bool_(),
    "reprojection_error_px": pa.float64(),
    "position_sigma_m": pa.float64(),
    "tag_ids": pa.list_(pa.int64()),
    "tag_corners": pa.list_(pa.list_(_POINT)),
}


@dataclass(frozen=True)
class FootageRow:
    """One frame.

    Attributes:
        frame: the file's name, or the frame's number.
        lights: [x, y] of each light that the detector found, px; pixel centres have integer coordinates.
        beacon_ids: which of the station's lights of the role "array" each of them is, from 0 in the station's order;
            None for a light that is none of them or not known.
        pose: T_station_camera (4, 4) by rows, None where there is none.
        measured: True if the pose rests on this frame's lights or tag, False if it is carried on or there is none.
        reprojection_error_px: mean distance between lights and their reprojections, None where there is no pose.
        position_sigma_m: greatest standard deviation of the camera's place in any direction, None without a pose.
        tag_ids: numbers of the tags that were read, within their family.
        tag_corners: [x, y] of the four corners of each, px: upper left, upper right, lower right, lower left as the tag
            is read.
    """

    frame: str | int
    lights: list[list[float]]
    beacon_ids: list[int | None]
    pose: list[list[float]] | None
    measured: bool
    reprojection_error_px: float | None
    position_sigma_m: float | None
    tag_ids: list[int]
    tag_corners: list[list[list[float]]]


def check_rows_file(path: Path) -> None:
    """Refuse a file's name that says neither kind, or a folder that is not there.

    Raises:
        ConfigError: such a path.
    """
    if path.suffix not in ENDINGS:
        raise ConfigError("out", str(path), f"a file name that ends in {' or '.join(ENDINGS)}")
    if not path.absolute().parent.is_dir():
        raise ConfigError("out", str(path), f"a file in a folder that exists; {path.absolute().parent} does not")


def write_rows(rows: Sequence[FootageRow], path: Path) -> None:
    """Write the rows as JSON, an object a line, or as Parquet, by the name's ending.

    Raises:
        OSError: the file cannot be written.
    """
    plain = [asdict(row) for row in rows]
    if path.suffix == ".jsonl":
        path.write_text("".join(json.dumps(row, allow_nan=False) + "\n" for row in plain), encoding="utf-8")
        return
    by_number = all(isinstance(row.frame, int) for row in rows) and bool(rows)
    types = _TYPES | ({"frame": pa.int64()} if by_number else {})
    schema = pa.schema([pa.field(name, kind) for name, kind in types.items()])
    pq.write_table(pa.Table.from_pylist(plain, schema=schema), path)
