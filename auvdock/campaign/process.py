"""Executor over local processes: dead workers are replaced, hanging episodes are ended."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.job import Job
from auvdock.campaign.plan import EpisodeSpec
from auvdock.campaign.row import Row, lost_row
from auvdock.campaign.worker import READY, THREAD_LIMITS, work
from auvdock.core.errors import AuvdockError

__all__ = ["ProcessExecutor", "usable_cores"]

PREFETCH = 2
"""Specs that a worker holds at a time: the one it runs and the next, so that it never waits for the parent."""
START_LIMIT_S = 180.0
"""Time that a worker may take to import and build its job."""
TRIES = 2
"""Times that an episode may kill its worker before it counts as `crashed`."""


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class ProcessExecutor:
    """A pool of spawned processes, one pipe each.

    A pool of its own because the standard ones lose everything when a worker dies and cannot end a single task.
    Processes are spawned, not forked: OpenGL contexts and MuJoCo's threads do not survive a fork.
    """

    def __init__(self, workers: int, limit_s: float) -> None:
        """Prepare; no process starts before `start`.

        Args:
            workers: processes.
            limit_s: wall-clock limit of an episode.
        """
        self._count = workers
        self._limit_s = limit_s
        self._job: Job | None = None
        self._workers: list[_Worker] = []
        self._peaks_mb: dict[int, float] = {}
        self._failed_starts = 0
        self._deaths: dict[int, int] = {}

    def start(self, job: Job) -> None:
        """Start the processes."""
        self._job = job
        self._workers = [self._spawn(slot) for slot in range(self._count)]

    def run(self, specs: Iterable[EpisodeSpec]) -> Iterator[Row]:
        """Rows as they finish."""
        source = iter(specs)
        again: deque[EpisodeSpec] = deque()
        while True:
            self._hand_out(source, again)
            busy = [worker for worker in self._workers if worker.held]
            if not busy:
                return
            now = time.monotonic()
            timeout_s = max(0.0, min(worker.deadline for worker in self._workers) - now)
            ready = set(wait([worker.connection for worker in self._workers], timeout_s))
            for worker in list(self._workers):
                if worker.connection in ready:
                    yield from self._listen(worker, again)
                elif time.monotonic() >= worker.deadline:
                    yield from self._overtime(worker, again)

    def close(self) -> None:
        """Stop all processes; what they were doing is lost."""
        for worker in self._workers:
            worker.stop()
        self._workers = []

    @property
    def workers(self) -> int:
        """Number of processes."""
        return self._count

    @property
    def peak_rss_mb(self) -> float:
        """Sum over the processes, each at its own peak; a replaced worker counts only if its successor is smaller."""
        return sum(self._peaks_mb.values())

    def _hand_out(self, source: Iterator[EpisodeSpec], again: deque[EpisodeSpec]) -> None:
        for depth in range(PREFETCH):  # first one for everybody, then a second: the last episodes spread evenly
            for worker in self._workers:
                if worker.is_ready and len(worker.held) <= depth:
                    spec = again.popleft() if again else next(source, None)
                    if spec is None:
                        return
                    worker.give(spec, self._limit_s)
                elif not worker.is_ready and not worker.held and depth == 0:
                    # An idle worker must be seen as busy until it is ready, or the loop would end without it.
                    spec = again.popleft() if again else next(source, None)
                    if spec is None:
                        return
                    worker.held.append(spec)

    def _listen(self, worker: _Worker, again: deque[EpisodeSpec]) -> Iterator[Row]:
        try:
            message = worker.connection.recv()
        except (EOFError, OSError):
            yield from self._died(worker, again)
            return
        if isinstance(message, AuvdockError):
            raise message
        if message == READY:
            self._failed_starts = 0
            worker.become_ready(self._limit_s)
            return
        row, peak_mb = message
        self._peaks_mb[worker.slot] = max(self._peaks_mb.get(worker.slot, 0.0), peak_mb)
        worker.finish(self._limit_s)
        yield row

    def _died(self, worker: _Worker, again: deque[EpisodeSpec]) -> Iterator[Row]:
        was_ready, held = worker.is_ready, list(worker.held)
        code = worker.stop()
        if not was_ready:
            self._failed_starts += 1
            if self._failed_starts >= TRIES * self._count:
                raise CampaignError(f"workers: they end before they are ready ({_ending(code)}); try --executor serial")
        elif held:
            culprit = held.pop(0)
            self._deaths[culprit.episode] = self._deaths.get(culprit.episode, 0) + 1
            if self._deaths[culprit.episode] < TRIES:
                again.append(culprit)
            else:
                yield lost_row(culprit, "crashed", f"its worker ended {TRIES} times ({_ending(code)})")
        again.extend(held)
        self._replace(worker)

    def _overtime(self, worker: _Worker, again: deque[EpisodeSpec]) -> Iterator[Row]:
        if not worker.is_ready:
            raise CampaignError(f"workers: not ready within {START_LIMIT_S:g} s; try fewer --workers")
        held = list(worker.held)
        worker.stop()
        if held:
            yield lost_row(held.pop(0), "hung", f"no end within {self._limit_s:g} s")
        again.extend(held)
        self._replace(worker)

    def _replace(self, worker: _Worker) -> None:
        self._workers[self._workers.index(worker)] = self._spawn(worker.slot)

    def _spawn(self, slot: int) -> _Worker:
        if self._job is None:
            raise RuntimeError("start comes before run")
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=work, args=(theirs, self._job), name=f"auvdock-worker-{slot}", daemon=True)
        with _environment(THREAD_LIMITS):
            process.start()
        theirs.close()  # or the end of the process would not show as the end of the pipe
        return _Worker(slot, process, ours)


class _Worker:
    """A process, its pipe, and the specs it holds; the first of them is the one it runs."""

    def __init__(self, slot: int, process: BaseProcess, connection: Connection) -> None:
        self.slot = slot
        self.process = process
        self.connection = connection
        self.held: deque[EpisodeSpec] = deque()
        self.is_ready = False
        self.deadline = time.monotonic() + START_LIMIT_S

    def become_ready(self, limit_s: float) -> None:
        self.is_ready = True
        waiting, self.held = self.held, deque()
        self.deadline = float("inf")
        for spec in waiting:
            self.give(spec, limit_s)

    def give(self, spec: EpisodeSpec, limit_s: float) -> None:
        if not self.held:
            self.deadline = time.monotonic() + limit_s
        self.held.append(spec)
        with suppress(BrokenPipeError, ConnectionResetError):  # its end shows at the next receive
            self.connection.send(spec)

    def finish(self, limit_s: float) -> None:
        self.held.popleft()
        self.deadline = time.monotonic() + limit_s if self.held else float("inf")

    def stop(self) -> int | None:
        """Kill the process; its exit code."""
        self.process.join(0.0 if self.process.is_alive() else None)
        ended = self.process.exitcode
        if ended is None:
            self.process.kill()
            self.process.join()
            ended = self.process.exitcode
        self.connection.close()
        return ended


def _ending(code: int | None) -> str:
    return f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"


@contextmanager
def _environment(changes: dict[str, str]) -> Generator[None]:
    """Set environment variables that are not set, for the children started meanwhile."""
    added = [name for name in changes if name not in os.environ]
    os.environ.update({name: changes[name] for name in added})
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]
