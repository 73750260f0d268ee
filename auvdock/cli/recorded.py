"""An episode that is recorded: a recording that fails does not cost the result."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from auvdock.cli.saving import Saving
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeObserver

__all__ = ["check_recordable", "run_recorded"]

_TEMPORARY = ".tmp-"
"""Before the name of what is not whole yet, as in a campaign's store."""


def check_recordable(path: Path) -> None:
    """Refuse a recording's path that cannot be written.

    Raises:
        ConfigError: such a path.
    """
    from auvdock.recording.rerun_recorder import check_writable  # half a second, for a recording alone

    check_writable(path)


def run_recorded(
    runner: EpisodeRunner,
    seed: int,
    path: Path,
    saving: Saving,
    others: Sequence[EpisodeObserver] = (),
    *,
    whole: bool = False,
) -> EpisodeResult:
    """Fly an episode and record it.

    Args:
        runner: flies it.
        seed: of the episode.
        path: the recording.
        saving: gets to know of the recording, or of its failure.
        others: observers beside the recorder.
        whole: leave nothing at `path` but a recording of the whole episode: none if it is interrupted or the disk full.

    Raises:
        ConfigError: a path that cannot be written even before the episode begins.
    """
    from auvdock.recording.rerun_recorder import RecordingWarning, RerunRecorder  # half a second, for a recording alone

    written = path.with_name(f"{_TEMPORARY}{path.name}") if whole else path
    recorder = RerunRecorder(written)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RecordingWarning)
            result = runner.run(seed, [recorder, *others])
        if recorder.failure is not None:
            saving.note(path, f"recording {path} is incomplete: {recorder.failure}")
        elif whole:
            saving.attempt(path, written.replace)
        else:
            saving.note(path, None)
    finally:
        if whole:
            with suppress(OSError):
                written.unlink(missing_ok=True)
    return result
