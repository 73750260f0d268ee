"""The vehicle's attitude and depth from a CSV file, frame by frame, in the words of a vehicle's log."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from auvdock.core.contracts import Proprioception
from auvdock.core.errors import ConfigError

__all__ = ["AttitudeLog", "Pose", "read_attitude", "sensed_attitude"]

_COLUMNS = ("frame", "roll_deg", "pitch_deg", "heading_deg", "depth_m")


class Pose(NamedTuple):
    """What the vehicle knew of itself in one frame.

    Attributes:
        roll_deg: positive to starboard.
        pitch_deg: positive nose up.
        heading_deg: clockwise from north, None where it is not known.
        depth_m: positive down, None where it is not known.
    """

    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float | None = None
    depth_m: float | None = None


@dataclass(frozen=True)
class AttitudeLog:
    """Rows of the file by the frames that they belong to; a frame without one has that of the frame before."""

    rows: dict[str, Pose]

    @property
    def has_heading(self) -> bool:
        """Whether headings are known."""
        return all(pose.heading_deg is not None for pose in self.rows.values())

    @property
    def has_depth(self) -> bool:
        """Whether depths are known."""
        return all(pose.depth_m is not None for pose in self.rows.values())

    def after(self, before: Pose, frame: str | int) -> Pose:
        """What was known in a frame, by its name or number."""
        return self.rows.get(str(frame), before)


def read_attitude(path: Path) -> AttitudeLog:
    """Read a CSV file with the columns frame, roll_deg, pitch_deg, and perhaps heading_deg and depth_m.

    Raises:
        ConfigError: a file that cannot be read or does not fit.
    """
    rows: dict[str, Pose] = {}
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            table = csv.DictReader(file, skipinitialspace=True)
            names = list(table.fieldnames or ())
            if not set(_COLUMNS[:3]) <= set(names):
                raise ConfigError("attitude", str(path), f"CSV whose first line names {', '.join(_COLUMNS)}")
            for number, row in enumerate(table, start=2):
                values = [_number(path, number, name, row.get(name)) for name in _COLUMNS[1:]]
                roll, pitch, heading, depth = values
                rows[row["frame"]] = Pose(roll or 0.0, pitch or 0.0, heading, depth)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigError("attitude", str(path), f"a CSV file that can be read ({error})") from error
    return AttitudeLog(rows)


def sensed_attitude(pose: Pose, time_s: float, heading_of_x_deg: float) -> Proprioception:
    """The vehicle's sensors as perception takes them: body x forward, y to port, z up, yaw positive to port.

    Args:
        pose: of the vehicle.
        time_s: of the frame.
        heading_of_x_deg: heading, clockwise from north, of the world's x axis.
    """
    yaw_deg = 180.0 if pose.heading_deg is None else heading_of_x_deg - pose.heading_deg
    euler = np.radians([pose.roll_deg, -pose.pitch_deg, yaw_deg])
    at_rest = np.zeros(3)
    depth_m = math.nan if pose.depth_m is None else pose.depth_m
    return Proprioception(time_s, depth_m, euler, at_rest, at_rest, at_rest)


def _number(path: Path, line: int, name: str, text: str | None) -> float | None:
    if text is None or not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError("attitude", text, f"a finite number for {name} in line {line} of {path}")
    return value
