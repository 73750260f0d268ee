"""What a person sees while an episode runs and when it is over."""

from __future__ import annotations

import math
from pathlib import Path

from rich.progress import BarColumn, Progress, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from auvdock.cli.console import command_line, description, live, messages, output
from auvdock.core.station import ConicalStationCfg
from auvdock.episode.result import EpisodeResult
from auvdock.episode.trace import EpisodeSetup, Tick

__all__ = ["ProgressDisplay", "print_result"]

_Line = tuple[str, float | int | None, str]
"""Name, value, format."""
PLAIN_EVERY_S = 10.0
"""Simulated time between progress lines where the output is no terminal."""


class ProgressDisplay:
    """A live line: distance made good, mode, range, speed. Plain lines where standard error is no terminal."""

    def __init__(self) -> None:
        """Prepare; nothing is shown before the episode starts."""
        self._console = messages()
        self._inside_m = 0.0
        self._progress: Progress | None = None
        self._start_range_m: float | None = None
        self._next_plain_s = 0.0
        self._around = False

    def on_start(self, setup: EpisodeSetup) -> None:
        """Show the title."""
        station = setup.station
        if isinstance(station, ConicalStationCfg):
            # Starts all around may lie behind the station, where no way along the axis is left.
            self._around = station.rotating is not None
            self._inside_m = station.funnel.length_m + station.latch.depth_m
        line = f"auvdock: {setup.title}, water {setup.water}, detector {setup.detector}"
        self._console.print(line, soft_wrap=True)
        if self._console.is_terminal:
            self._progress = live(self._console, description(), BarColumn(40), TimeElapsedColumn())
            self._progress.add_task("starting", total=1.0)
            self._progress.start()

    def on_tick(self, tick: Tick) -> None:
        """Update the line."""
        range_m = tick.truth.range_m if self._around and tick.truth.range_m > 3.0 else tick.truth.to_go_m
        if self._start_range_m is None:
            self._start_range_m = range_m
        speed_m_s = math.hypot(*(float(part) for part in tick.truth.nu_body[:3]))
        line = f"t {tick.truth.time_s:5.1f} s  {tick.command.mode:8s} range {range_m:5.1f} m  {speed_m_s:4.2f} m/s"
        if self._progress is not None:
            done = 1.0 - max(0.0, range_m + self._inside_m) / (self._start_range_m + self._inside_m)
            self._progress.update(self._progress.task_ids[0], description=line, completed=max(0.0, done))
        elif tick.truth.time_s >= self._next_plain_s:
            self._next_plain_s += PLAIN_EVERY_S
            self._console.print(line, highlight=False)

    def on_end(self, result: EpisodeResult) -> None:
        """Nothing: the table comes last."""

    def close(self) -> None:
        """Take the live line away."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None


def print_result(result: EpisodeResult, record: Path | None, title: str = "conical docking") -> None:
    """The result as a table on standard output."""
    console = output()
    table = Table(title=f"{title}, seed {result.seed}", title_justify="left")
    table.add_column("metric")
    table.add_column("value", justify="right")
    verdict = Text("docked", "green") if result.success else Text(f"failed: {result.failure_reason}", "red")
    table.add_row("outcome", verdict)
    rows: list[_Line] = [
        ("time", result.time_s, "{:.1f} s"),
        ("path length", result.path_length_m, "{:.1f} m"),
        ("thruster work", result.energy_j, "{:.0f} J"),
        *(_entry(result) if result.aligned_frames is None else _landing(result)),
        ("peak contact force", result.peak_contact_force_n, "{:.0f} N"),
        *_rotating_rows(result),
        ("approaches", result.attempts, "{:d}"),
        ("wall-clock time", result.wall_s, "{:.1f} s"),
        ("real-time factor", result.real_time_factor, "{:.1f} x"),
    ]
    for name, value, form in rows:
        table.add_row(name, "-" if value is None else form.format(value))
    console.print(table)
    if record is not None:
        view = command_line("auvdock", "view", record)
        console.print(f"recording: {record}   ({view})", highlight=False, soft_wrap=True)


def _rotating_rows(result: EpisodeResult) -> list[tuple[str, float | int | None, str]]:
    """What only an episode with a start all around has."""
    if result.start_azimuth_rad is None:
        return []
    return [
        ("start azimuth", _degrees(result.start_azimuth_rad), "{:+.0f}°"),
        ("start range", result.start_range_m, "{:.1f} m"),
        ("beacon or array found after", result.acquire_s, "{:.1f} s"),
        ("azimuth fixes", result.azimuth_fixes, "{:d}"),
        ("azimuth error (rms)", _degrees(result.azimuth_rms_rad), "{:.2f}°"),
        ("azimuth error at hand-over", _degrees(result.handover_azimuth_error_rad), "{:+.2f}°"),
    ]


def _entry(result: EpisodeResult) -> list[_Line]:
    return [
        ("entry distance (first pose)", result.entry_distance_m, "{:.1f} m"),
        ("precise-guidance range", result.precise_range_m, "{:.1f} m"),
        ("precise frames", result.precise_frames, "{:d}"),
        ("invalid frames", result.invalid_frames, "{:d}"),
        ("distortion rate", _percent(result.distortion_rate), "{:.2f} %"),
        ("median pose error", result.pose_error_median_m, "{:.3f} m"),
        ("false poses", _percent(result.false_pose_rate), "{:.2f} %"),
        ("lateral error at entry", result.lateral_error_m, "{:+.3f} m"),
        ("heading error at entry", _degrees(result.heading_error_rad), "{:.1f}°"),
        ("entry speed", result.entry_speed_m_s, "{:.2f} m/s"),
    ]


def _landing(result: EpisodeResult) -> list[_Line]:
    return [
        ("range of the first pose", result.entry_distance_m, "{:.1f} m"),
        ("frames by lights alone", _percent(result.lights_share), "{:.1f} %"),
        ("frames by the tag alone", _percent(result.tag_share), "{:.1f} %"),
        ("frames by both", _percent(result.fused_share), "{:.1f} %"),
        ("frames by neither", _percent(result.blind_share), "{:.1f} %"),
        ("false poses", _percent(result.false_pose_rate), "{:.2f} %"),
        ("position error at the latch", _millimetres(result.final_position_error_m), "{:.1f} mm"),
        ("greatest after alignment", _millimetres(result.max_position_error_m), "{:.1f} mm"),
        ("heading error at the latch", _degrees(result.final_heading_error_rad), "{:.2f}°"),
        ("greatest after alignment", _degrees(result.max_heading_error_rad), "{:.2f}°"),
        ("estimate's position error, 95 %", _millimetres(result.estimate_position_p95_m), "{:.1f} mm"),
        ("estimate's heading error, 95 %", _degrees(result.estimate_heading_p95_rad), "{:.2f}°"),
        ("estimates within 20 mm and 3°", _percent(result.estimate_within_20mm_3deg), "{:.1f} %"),
        ("estimates within 10 mm and 1°", _percent(result.estimate_within_10mm_1deg), "{:.1f} %"),
        ("touchdown speed", result.touchdown_speed_m_s, "{:.3f} m/s"),
        ("touchdown force", result.touchdown_force_n, "{:.0f} N"),
    ]


def _millimetres(value_m: float | None) -> float | None:
    return None if value_m is None else 1000.0 * value_m


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value


def _degrees(value: float | None) -> float | None:
    return None if value is None else math.degrees(value)
