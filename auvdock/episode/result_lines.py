"""What a result says, line by line, for whoever shows it: names, figures and units."""

from __future__ import annotations

import math
from typing import NamedTuple

from auvdock.episode.result import EpisodeResult

__all__ = ["Line", "docking_lines", "landing_lines", "shared_lines"]


class Line(NamedTuple):
    """A figure of a result.

    Attributes:
        name: what it is.
        value: the figure; None for "did not happen".
        form: how it is written, with its unit.
    """

    name: str
    value: float | int | None
    form: str

    @property
    def text(self) -> str:
        """The figure in words, a dash for None."""
        return "-" if self.value is None else self.form.format(self.value)


def shared_lines(result: EpisodeResult) -> list[Line]:
    """What every kind of docking has."""
    return [
        Line("time", result.time_s, "{:.1f} s"),
        Line("path length", result.path_length_m, "{:.1f} m"),
        Line("thruster work", result.energy_j, "{:.0f} J"),
        *([] if result.electrical_j is None else [Line("electrical work", result.electrical_j, "{:.0f} J")]),
        Line("peak contact force", result.peak_contact_force_n, "{:.0f} N"),
        Line("approaches", result.attempts, "{:d}"),
        Line("measured poses", result.measured_poses, "{:d}"),
        Line("false poses", _percent(result.false_pose_rate), "{:.2f} %"),
        Line("perception per frame, median", result.frame_ms_median, "{:.2f} ms"),
        Line("perception per frame, 95 %", result.frame_ms_p95, "{:.2f} ms"),
    ]


def docking_lines(result: EpisodeResult) -> list[Line]:
    """What docking into a funnel has, and what a rotating beacon adds where the pilot went by one."""
    lines = [
        Line("entry distance", result.entry_distance_m, "{:.1f} m"),
        Line("precise-guidance range", result.precise_range_m, "{:.1f} m"),
        Line("precise frames", result.precise_frames, "{:d}"),
        Line("invalid frames", result.invalid_frames, "{:d}"),
        Line("distortion rate", _percent(result.distortion_rate), "{:.2f} %"),
        Line("without even a predicted pose", _percent(result.distortion_available), "{:.2f} %"),
        Line("median pose error", result.pose_error_median_m, "{:.3f} m"),
        Line("lateral error at entry", result.lateral_error_m, "{:+.3f} m"),
        Line("vertical error at entry", result.vertical_error_m, "{:+.3f} m"),
        Line("heading error at entry", _degrees(result.heading_error_rad), "{:.1f}°"),
        Line("entry speed", result.entry_speed_m_s, "{:.2f} m/s"),
    ]
    if result.start_azimuth_rad is None:
        return lines
    return [
        *lines,
        Line("start azimuth", _degrees(result.start_azimuth_rad), "{:+.0f}°"),
        Line("start range", result.start_range_m, "{:.1f} m"),
        Line("beacon or array found after", result.acquire_s, "{:.1f} s"),
        Line("azimuth fixes", result.azimuth_fixes, "{:d}"),
        Line("azimuth error (rms)", _degrees(result.azimuth_rms_rad), "{:.2f}°"),
        Line("azimuth error at hand-over", _degrees(result.handover_azimuth_error_rad), "{:+.2f}°"),
    ]


def landing_lines(result: EpisodeResult) -> list[Line]:
    """What a landing has."""
    return [
        Line("entry distance", result.entry_distance_m, "{:.1f} m"),
        Line("frames by lights alone", _percent(result.lights_share), "{:.1f} %"),
        Line("frames by the tag alone", _percent(result.tag_share), "{:.1f} %"),
        Line("frames by both", _percent(result.fused_share), "{:.1f} %"),
        Line("frames by neither", _percent(result.blind_share), "{:.1f} %"),
        Line("position error at the latch", _millimetres(result.final_position_error_m), "{:.1f} mm"),
        Line("greatest after alignment", _millimetres(result.max_position_error_m), "{:.1f} mm"),
        Line("heading error at the latch", _degrees(result.final_heading_error_rad), "{:.2f}°"),
        Line("greatest after alignment", _degrees(result.max_heading_error_rad), "{:.2f}°"),
        Line("estimate's position error, 95 %", _millimetres(result.estimate_position_p95_m), "{:.1f} mm"),
        Line("estimate's heading error, 95 %", _degrees(result.estimate_heading_p95_rad), "{:.2f}°"),
        Line("estimates within 20 mm and 3°", _percent(result.estimate_within_20mm_3deg), "{:.1f} %"),
        Line("estimates within 10 mm and 1°", _percent(result.estimate_within_10mm_1deg), "{:.1f} %"),
        Line("touchdown speed", result.touchdown_speed_m_s, "{:.3f} m/s"),
        Line("touchdown force", result.touchdown_force_n, "{:.0f} N"),
    ]


def _millimetres(value_m: float | None) -> float | None:
    return None if value_m is None else 1000.0 * value_m


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value


def _degrees(value: float | None) -> float | None:
    return None if value is None else math.degrees(value)
