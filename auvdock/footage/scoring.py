"""What was perceived against labels: lights found, spurious ones, names, and whether a pose puts lights where they are.

Labels are JSON: {"frames": [{"frame": name, "lights": [{"id", "x", "y", "clipped"}, ...]}, ...]}, `id` the beacon's
number. What lies near a clipped light counts for nothing.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from auvdock.core.arrays import Array, BoolArray, IntArray
from auvdock.core.camera import Camera
from auvdock.core.errors import ConfigError
from auvdock.footage.rows import FootageRow

__all__ = ["LabelledLights", "Score", "read_labels", "score"]

_GATE_PX = 6.0
"""A light is found if a detection is no farther from it."""
_CARE_PX = 12.0
"""So near a clipped light counts for nothing."""
_RIGHT_PX = 4.0
"""A pose is right if it puts the labelled lights no farther from their places, on the mean."""
_ENOUGH = 4


class LabelledLights(NamedTuple):
    """One frame's labels.

    Attributes:
        place_px: (n, 2) of the lights.
        beacon: (n,) whose they are.
        clipped: (n,) whether the picture's edge cuts them.
    """

    place_px: Array
    beacon: IntArray
    clipped: BoolArray


@dataclass(frozen=True)
class Score:
    """Counts over the labelled frames that were perceived.

    Attributes:
        frames: that were.
        lights: not clipped, in them.
        found: of these.
        spurious: detections that are no light.
        enough: frames with four or more lights that are not clipped.
        right: of these, those with a right measured pose.
        wrong: frames with a measured pose that is not right, or with one although there is no light.
        misnamed: frames with a light under another's name.
        error_px: median distance of the lights found from their places, None without any.
    """

    frames: int
    lights: int
    found: int
    spurious: int
    enough: int
    right: int
    wrong: int
    misnamed: int
    error_px: float | None


def read_labels(path: Path) -> dict[str, LabelledLights]:
    """Labels by frame.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    try:
        frames: list[Mapping[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["frames"]
        return {str(frame["frame"]): _labels(frame["lights"]) for frame in frames}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError("labels", str(path), f"a file of labels ({type(error).__name__}: {error})") from error


def score(rows: Sequence[FootageRow], labels: Mapping[str, LabelledLights], camera: Camera, array_m: Array) -> Score:
    """Compare rows with the labels of their frames.

    Args:
        rows: what was perceived.
        labels: by frame.
        camera: that took the footage.
        array_m: (k, 3) array beacons in the station frame.
    """
    frames = lights = spurious = enough = right = wrong = misnamed = 0
    errors: list[float] = []
    for row in rows:
        label = labels.get(str(row.frame))
        if label is None:
            continue
        whole = label.place_px[~label.clipped]
        found = np.array(row.lights).reshape(-1, 2)
        gap = np.linalg.norm(label.place_px[:, None] - found[None], axis=2)
        matched = _matched(gap[~label.clipped])
        near_cut = (gap[label.clipped] <= _CARE_PX).any(axis=0)
        errors += [gap[~label.clipped][i, j] for i, j in matched]
        is_right = _is_right(row, label, camera, array_m)
        frames, lights = frames + 1, lights + len(whole)
        spurious += int((~near_cut).sum()) - sum(not near_cut[j] for _, j in matched)
        enough, right = enough + (len(whole) >= _ENOUGH), right + (len(whole) >= _ENOUGH and is_right)
        wrong += row.measured and not is_right
        misnamed += any(row.beacon_ids[j] not in (None, label.beacon[~label.clipped][i]) for i, j in matched)
    middle = float(np.median(errors)) if errors else None
    return Score(frames, lights, len(errors), spurious, enough, right, wrong, misnamed, middle)


def _labels(lights: Sequence[Mapping[str, Any]]) -> LabelledLights:
    return LabelledLights(
        np.array([(float(light["x"]), float(light["y"])) for light in lights]).reshape(-1, 2),
        np.array([int(light["id"]) for light in lights], dtype=np.int64),
        np.array([bool(light.get("clipped", False)) for light in lights], dtype=np.bool_),
    )


def _matched(gap: Array) -> list[tuple[int, int]]:
    """Pairs of light and detection that are one, by the Hungarian method."""
    if not gap.size:
        return []
    rows, columns = linear_sum_assignment(np.where(gap <= _GATE_PX, gap, 1e3))
    pairs = zip(rows.tolist(), columns.tolist(), strict=True)
    return [(i, j) for i, j in pairs if gap[i, j] <= _GATE_PX]


def _is_right(row: FootageRow, label: LabelledLights, camera: Camera, array_m: Array) -> bool:
    """Whether a measured pose puts the labelled lights where they are; clipped ones where there are no others."""
    if row.pose is None or not row.measured or not len(label.beacon):
        return False
    judged = ~label.clipped if not label.clipped.all() else label.clipped
    pose = np.array(row.pose)
    points = (array_m[label.beacon[judged]] - pose[:3, 3]) @ pose[:3, :3]
    if float(points[:, 2].min()) <= 0.0:
        return False
    return float(np.linalg.norm(camera.project(points) - label.place_px[judged], axis=1).mean()) <= _RIGHT_PX
