"""The episode in words: a Markdown document inside the recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from auvdock.episode.stations import result_lines

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
        ("outcome", outcome),
        *((line.name, line.text) for line in result_lines(setup.kind, result)),
        ("seed", str(result.seed)),
        ("versions", ", ".join(f"{name} {version}" for name, version in result.versions.items())),
    ]
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    return f"{_heading(setup)}\n\n| | |\n|---|---|\n{table}\n"


def _heading(setup: EpisodeSetup) -> str:
    return f"# {setup.title}\n\n{setup.vehicle.description}; water *{setup.water}*, detector *{setup.detector}*."
