"""A sheet of labelled frames, to look at before one trains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.core.errors import ConfigError
from auvdock.dataset.frames import read_frame
from auvdock.dataset.plan import SceneSpec
from auvdock.dataset.store import read_json

__all__ = ["write_preview"]

_TILES = (4, 5)
"""Columns and rows."""
_TILE_PX = (640, 400)
_POSITIVE, _IGNORED, _WORDS = (64, 255, 64), (255, 160, 32), (255, 255, 255)
_GAMMA = 0.7
"""Dark frames are shown somewhat brighter than they are."""


def write_preview(folder: Path, scenes: Sequence[SceneSpec], path: Path) -> None:
    """Draw frames spread evenly over a finished data set, with boxes (green; ignored ones orange) and keypoints.

    Raises:
        ConfigError: a file that cannot be read or written.
    """
    frames: list[tuple[str, Mapping[str, Any]]] = []
    for scene in scenes:
        record = read_json(folder / "scenes" / f"{scene.name}.json", "out")
        frames += [(record["split"], frame) for frame in record["frames"]]
    columns, rows = _TILES
    count = min(columns * rows, len(frames))
    chosen = [frames[k * len(frames) // count] for k in range(count)]
    tiles = [
        _tile(read_frame(folder / split / "images" / f"{frame['name']}.png"), split, frame) for split, frame in chosen
    ]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % columns)
    sheet = np.vstack([np.hstack(tiles[k : k + columns]) for k in range(0, len(tiles), columns)])
    done, code = cv2.imencode(".png", cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR))
    try:
        path.write_bytes(code.tobytes() if done else b"")
    except OSError as error:
        raise ConfigError("preview", str(path), f"a file that can be written ({error.strerror})") from error


def _tile(image: Image, split: str, frame: Mapping[str, Any]) -> Image:
    height, width = image.shape[:2]
    scale = min(_TILE_PX[0] / width, _TILE_PX[1] / height)
    table = np.array([round(255.0 * (code / 255.0) ** _GAMMA) for code in range(256)], dtype=np.uint8)
    size = (round(width * scale), round(height * scale))
    shown = cv2.resize(cv2.LUT(image, table), size, interpolation=cv2.INTER_AREA)
    tile: Image = np.zeros((_TILE_PX[1], _TILE_PX[0], 3), dtype=np.uint8)
    tile[: size[1], : size[0]] = shown
    for label in frame["labels"]:
        colour = _IGNORED if label["ignored"] else _POSITIVE
        left, top, right, bottom = (round((part + 0.5) * scale) for part in label["xyxy"])
        cv2.rectangle(tile, (left, top), (right, bottom), colour, 1)
        if label["ignored"]:
            cv2.putText(tile, label["ignored"], (left, top - 2), cv2.FONT_HERSHEY_SIMPLEX, 0.35, colour)
    facts = frame["facts"]
    words = f"{split} {facts['kind']} {facts['lights']}  {facts['water']}  c r = {facts['c_range']:.1f}"
    cv2.putText(tile, words, (6, _TILE_PX[1] - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.45, _WORDS)
    return tile
