"""An episode that is recorded: a recording that fails does not cost the result."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

from auvdock.cli.saving import Saving
from auvdock.episode.result import EpisodeResult
from auvdock.episode.runner import EpisodeRunner
from auvdock.episode.trace import EpisodeObserver

__all__ = ["run_recorded"]


def run_recorded(
    runner: EpisodeRunner, seed: int, path: Path, saving: Saving, others: Sequence[EpisodeObserver] = ()
) -> EpisodeResult:
    """Fly an episode and record it.

    Args:
        runner: flies it.
        seed: of the episode.
        path: the recording.
        saving: gets to know of the recording, or of its failure.
        others: observers beside the recorder.

    Raises:
        ConfigError: a path that cannot be written even before the episode begins.
    """
    from auvdock.recording.rerun_recorder import RecordingWarning, RerunRecorder  # half a second, for a recording alone

    recorder = RerunRecorder(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        result = runner.run(seed, [recorder, *others])
    saving.note(path, recorder.failure and f"recording {path} is incomplete: {recorder.failure}")
    return result
