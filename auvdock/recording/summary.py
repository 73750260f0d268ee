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
    heading_deg = None if result.heading_error_rad is None else math.degrees(result.heading_error_rad)
    rows = [
        ("Outcome", outcome),
        ("Simulated time", _quantity(result.time_s, "s", 1)),
        ("Attempts", str(result.attempts)),
        ("Distortion rate", _share(result.distortion_rate, result.invalid_frames, result.precise_frames)),
        ("Entry distance", _quantity(result.entry_distance_m, "m", 2)),
        ("Range of precise guidance", _quantity(result.precise_range_m, "m", 2)),
        ("Median pose error", _quantity(result.pose_error_median_m, "m", 3)),
        ("Lateral error at the throat", _quantity(result.lateral_error_m, "m", 3)),
        ("Vertical error at the throat", _quantity(result.vertical_error_m, "m", 3)),
        ("Heading error at the throat", _quantity(heading_deg, "°", 1)),
        ("Entry speed", _quantity(result.entry_speed_m_s, "m/s", 2)),
        ("Peak contact force", _quantity(result.peak_contact_force_n, "N", 0)),
        ("Path length", _quantity(result.path_length_m, "m", 1)),
        ("Energy", _quantity(result.energy_j, "J", 0)),
        ("Seed", str(result.seed)),
        ("Versions", ", ".join(f"{name} {version}" for name, version in result.versions.items())),
    ]
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    return f"{_heading(setup)}\n\n| | |\n|---|---|\n{table}\n"


def _heading(setup: EpisodeSetup) -> str:
    return f"# {setup.title}\n\n{setup.vehicle.description}; water *{setup.water}*, detector *{setup.detector}*."


def _quantity(value: float | None, unit: str, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f} {unit}"


def _share(rate: float | None, part: int, whole: int) -> str:
    return "–" if rate is None else f"{100.0 * rate:.1f} % ({part} of {whole} frames)"
