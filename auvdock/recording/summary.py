"""The episode in words: a Markdown document inside the recording."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from auvdock.episode.result import EpisodeResult
    from auvdock.episode.trace import EpisodeSetup

__all__ = ["result_document", "unfinished_document"]


def unfinished_document(setup: EpisodeSetup) -> str:
    """What the document says until the episode has ended, and for good if the run was killed."""
    return f"{_heading(setup)}\n\nNo result: this recording stops before the episode's end.\n"


def result_document(setup: EpisodeSetup, result: EpisodeResult) -> str:
    """The result as a table; what did not happen shows as a dash."""
    outcome = "**docked**" if result.success else f"**failed**: {result.failure_reason}"
    rows = [
        ("Outcome", outcome),
        ("Simulated time", _quantity(result.time_s, "s", 1)),
        ("Attempts", str(result.attempts)),
        *(_entry_rows(result) if result.aligned_frames is None else _landing_rows(result)),
        ("Peak contact force", _quantity(result.peak_contact_force_n, "N", 0)),
        ("Path length", _quantity(result.path_length_m, "m", 1)),
        ("Energy", _quantity(result.energy_j, "J", 0)),
        ("Seed", str(result.seed)),
        ("Versions", ", ".join(f"{name} {version}" for name, version in result.versions.items())),
    ]
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    return f"{_heading(setup)}\n\n| | |\n|---|---|\n{table}\n"


def _entry_rows(result: EpisodeResult) -> list[tuple[str, str]]:
    return [
        ("Distortion rate", _share(result.distortion_rate, result.invalid_frames, result.precise_frames)),
        ("Entry distance", _quantity(result.entry_distance_m, "m", 2)),
        ("Range of precise guidance", _quantity(result.precise_range_m, "m", 2)),
        ("Median pose error", _quantity(result.pose_error_median_m, "m", 3)),
        ("False poses", _share(result.false_pose_rate, result.false_poses, result.measured_poses)),
        ("Lateral error at the throat", _quantity(result.lateral_error_m, "m", 3)),
        ("Vertical error at the throat", _quantity(result.vertical_error_m, "m", 3)),
        ("Heading error at the throat", _quantity(_degrees(result.heading_error_rad), "°", 1)),
        ("Entry speed", _quantity(result.entry_speed_m_s, "m/s", 2)),
    ]


def _landing_rows(result: EpisodeResult) -> list[tuple[str, str]]:
    levels = (result.lights_share, result.tag_share, result.fused_share, result.blind_share)
    shares = " / ".join("–" if share is None else f"{100.0 * share:.1f} %" for share in levels)
    return [
        ("Range of the first pose", _quantity(result.entry_distance_m, "m", 2)),
        ("Frames by lights / tag / both / neither", shares),
        ("False poses", _share(result.false_pose_rate, result.false_poses, result.measured_poses)),
        ("Position error at the latch", _quantity(result.final_position_error_m, "m", 4)),
        ("Greatest after alignment", _quantity(result.max_position_error_m, "m", 4)),
        ("Heading error at the latch", _quantity(_degrees(result.final_heading_error_rad), "°", 2)),
        ("Greatest after alignment", _quantity(_degrees(result.max_heading_error_rad), "°", 2)),
        ("Estimate's position error, 95 %", _quantity(result.estimate_position_p95_m, "m", 4)),
        ("Estimate's heading error, 95 %", _quantity(_degrees(result.estimate_heading_p95_rad), "°", 2)),
        ("Touchdown speed", _quantity(result.touchdown_speed_m_s, "m/s", 3)),
        ("Touchdown force", _quantity(result.touchdown_force_n, "N", 0)),
    ]


def _degrees(value: float | None) -> float | None:
    return None if value is None else math.degrees(value)


def _heading(setup: EpisodeSetup) -> str:
    return f"# {setup.title}\n\n{setup.vehicle.description}; water *{setup.water}*, detector *{setup.detector}*."


def _quantity(value: float | None, unit: str, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f} {unit}"


def _share(rate: float | None, part: int, whole: int) -> str:
    return "–" if rate is None else f"{100.0 * rate:.1f} % ({part} of {whole} frames)"
