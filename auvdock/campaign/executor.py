"""The interface of executors, and the simplest one."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterable, Iterator
from importlib import import_module
from types import FrameType
from typing import Any, Protocol

from auvdock.campaign.job import EpisodeFunction, Job, attempt
from auvdock.campaign.plan import EpisodeSpec
from auvdock.campaign.row import Row, lost_row

__all__ = ["Executor", "SerialExecutor", "peak_rss_mb"]


class Executor(Protocol):
    """Runs episodes somewhere.

    Every executor gives the same rows; only their order and the time they take differ.
    """

    def start(self, job: Job) -> None:
        """Make the workers ready; each builds the job once."""
        ...

    def run(self, specs: Iterable[EpisodeSpec]) -> Iterator[Row]:
        """Rows as they finish, in any order; specs are taken only as workers become free."""
        ...

    def close(self) -> None:
        """Stop the workers."""
        ...

    @property
    def workers(self) -> int:
        """Episodes that can run at the same time."""
        ...

    @property
    def peak_rss_mb(self) -> float:
        """Sum of the workers' peak resident memory, without the calling process."""
        ...


def peak_rss_mb() -> float:
    """Peak resident memory of this process so far, MiB."""
    try:
        resource: Any = import_module("resource")
    except ImportError:  # Windows
        psutil: Any = import_module("psutil")
        return psutil.Process().memory_info().peak_wset / 2.0**20
    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak / (2.0**20 if sys.platform == "darwin" else 2.0**10)  # bytes there, KiB elsewhere


class SerialExecutor:
    """One episode after the other in the calling process; for debugging and as the reference for the others.

    The time limit works by an alarm signal, so only in the main thread, only between Python instructions, and not on
    Windows, which has none.
    """

    def __init__(self, limit_s: float) -> None:
        """Prepare.

        Args:
            limit_s: wall-clock limit of an episode.
        """
        self._limit_s = limit_s
        self._job: Job | None = None
        self._run: EpisodeFunction | None = None

    def start(self, job: Job) -> None:
        """Build the job here."""
        self._job = job
        self._run = job.build()

    def run(self, specs: Iterable[EpisodeSpec]) -> Iterator[Row]:
        """Rows in the order of the specs."""
        for spec in specs:
            yield self._timed(spec)

    def close(self) -> None:
        """Drop the job."""
        self._run = None

    @property
    def workers(self) -> int:
        """One."""
        return 1

    @property
    def peak_rss_mb(self) -> float:
        """None but the calling process."""
        return 0.0

    def _timed(self, spec: EpisodeSpec) -> Row:
        if self._run is None or self._job is None:
            raise RuntimeError("start comes before run")
        if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
            return attempt(self._run, spec)
        before = signal.signal(signal.SIGALRM, _raise_overtime)
        signal.setitimer(signal.ITIMER_REAL, self._limit_s)
        try:
            return attempt(self._run, spec)
        except _OvertimeError:
            self._run = self._job.build()  # what was interrupted is in no state to be used again
            return lost_row(spec, "hung", f"no end within {self._limit_s:g} s")
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)


class _OvertimeError(BaseException):
    """Not an Exception, so that no handler within the episode takes it."""


def _raise_overtime(number: int, frame: FrameType | None) -> None:
    raise _OvertimeError
