"""A data set's folder: frames as PNG, one record a scene, and what is assembled from the records at the end.

| File in the folder | Content |
|---|---|
| `recipe.json` | what was asked for: another command does not go on in the same folder |
| `scenes/NAME.json` | a finished scene, written last and in one step: a run that was killed goes on after it |
| `SPLIT/images/*.png` | frames |
| `SPLIT/labels/*.txt`, `SPLIT/ignored/*.txt` | YOLO's text; what is neither positive nor negative |
| `shards/NAME.npy` | a scene's frames (n, H, W, 3) uint8, if asked for |
| `annotations/SPLIT.json` | COCO's keypoints |
| `data.yaml`, `card.md`, `card.json` | where YOLO's trainers begin; the data card |
"""

from __future__ import annotations

import dataclasses
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.core.errors import ConfigError
from auvdock.dataset.card import card, card_markdown
from auvdock.dataset.formats import coco, data_yaml, yolo_text
from auvdock.dataset.labels import Label, LabelledFrame
from auvdock.dataset.plan import SPLITS, SceneSpec

__all__ = ["SHARDS", "Store", "label_record", "read_json"]

SHARDS = "shards"
"""Folder of the shards."""


_DIGITS = 3
_PNG = (
    *(cv2.IMWRITE_PNG_COMPRESSION, 1),
    *(cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_AVG),
    *(cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY),
)
"""Noise has no strings that come again: looking for them takes three times as long and makes larger files."""


class Store:
    """A folder in which a data set grows.

    A failed read or write of any of its files is a `ConfigError` that names the file.
    """

    def __init__(self, folder: Path, field: str = "out") -> None:
        """Keep the place.

        Args:
            folder: where it is.
            field: the setting that named it, for errors.
        """
        self.folder, self._field = folder, field

    def open(self, recipe: Mapping[str, Any]) -> None:
        """Begin a data set, or go on with one of the same recipe.

        Raises:
            ConfigError: the folder holds something else, or cannot be written.
        """
        path = self.folder / "recipe.json"
        if path.exists():
            if read_json(path, self._field) != json.loads(_json(recipe)):
                remedy = "another folder, or the same command as before: it holds a data set of another recipe"
                raise ConfigError(self._field, str(self.folder), remedy)
            return
        if self.folder.is_dir() and any(self.folder.iterdir()):
            raise ConfigError(self._field, str(self.folder), "an empty folder, or that of a data set to go on with")
        self._write(path, _json(recipe))

    def is_done(self, scene: SceneSpec) -> bool:
        """Whether a scene is there as a whole."""
        return self._record(scene).exists()

    def put(self, scene: SceneSpec, frames: Iterable[LabelledFrame], *, shard: bool = False) -> None:
        """Write a scene's frames, as a shard too if asked, then its record."""
        records: list[dict[str, Any]] = []
        images: list[Image] = []
        for index, frame in enumerate(frames):
            name = f"{scene.name}_{index:03d}"
            done, code = cv2.imencode(".png", cv2.cvtColor(frame.image, cv2.COLOR_RGB2BGR), _PNG)
            if not done:
                raise RuntimeError(f"{name}: OpenCV writes no PNG")
            self._write(self.folder / scene.split / "images" / f"{name}.png", code.tobytes())
            record = _frame_record(name, frame)
            for kind, ignored in (("labels", False), ("ignored", True)):
                path = self.folder / scene.split / kind / f"{name}.txt"
                self._write(path, yolo_text(record, ignored=ignored))
            records.append(record)
            if shard:
                images.append(frame.image)
        if shard:
            held = io.BytesIO()
            np.save(held, np.stack(images), allow_pickle=False)
            self._write(self.folder / SHARDS / f"{scene.name}.npy", held.getvalue())
        content = {"split": scene.split, "number": scene.number, "seed": scene.seed, "frames": records}
        self._write(self._record(scene), _json(content))

    def finish(self, recipe: Mapping[str, Any], scenes: Sequence[SceneSpec]) -> dict[str, Any]:
        """Assemble annotations and card from the records; the card."""
        records = [read_json(self._record(scene), self._field) for scene in scenes]
        for split in SPLITS:
            ours = [record for record in records if record["split"] == split]
            self._write(self.folder / "annotations" / f"{split}.json", _json(coco(split, ours, recipe["version"])))
        content = card(recipe, records)
        self._write(self.folder / "card.json", _json(content))
        self._write(self.folder / "card.md", card_markdown(content))
        self._write(self.folder / "data.yaml", data_yaml())
        return content

    def _record(self, scene: SceneSpec) -> Path:
        return self.folder / "scenes" / f"{scene.name}.json"

    def _write(self, path: Path, content: str | bytes) -> None:
        """Write a whole file or none."""
        data = content.encode() if isinstance(content, str) else content
        part = path.with_name(f".{path.name}.part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(data)
            os.replace(part, path)
        except OSError as error:
            remedy = f"a folder that can be written ({error.strerror or error})"
            raise ConfigError(self._field, str(path), remedy) from error


def read_json(path: Path, field: str) -> Any:  # noqa: ANN401 - whatever it holds
    """A JSON file.

    Raises:
        ConfigError: it cannot be read, or is no JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ConfigError(field, str(path), f"a file as `auvdock dataset` writes it ({error})") from error


def _frame_record(name: str, frame: LabelledFrame) -> dict[str, Any]:
    height, width = frame.image.shape[:2]
    facts = {key: _rounded(value) for key, value in frame.facts.items()}
    labels = [label_record(label) for label in frame.labels]
    return {"name": name, "width": width, "height": height, "facts": facts, "labels": labels}


def label_record(label: Label) -> dict[str, Any]:
    """A label as plain data, as it stands in a scene's record."""
    return {
        **{key: _rounded(value) for key, value in dataclasses.asdict(label).items()},
        "visibility": label.visibility,
    }


def _rounded(value: Any) -> Any:  # noqa: ANN401
    """Floats to three digits after the point, small ones to four that count."""
    if isinstance(value, tuple | list):
        return [_rounded(item) for item in value]
    if isinstance(value, float | np.floating):
        number = float(value)
        return round(number, _DIGITS) if abs(number) >= 1.0 else float(f"{number:.4g}")
    return value


def _json(content: Any) -> str:  # noqa: ANN401
    return json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":")) + "\n"
