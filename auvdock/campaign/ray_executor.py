"""Executor over a Ray cluster: many machines, of which some may go."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Iterable, Iterator
from importlib import import_module
from typing import Any

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.executor import peak_rss_mb
from auvdock.campaign.job import Job, attempt
from auvdock.campaign.plan import EpisodeSpec
from auvdock.campaign.row import Row, lost_row
from auvdock.campaign.worker import THREAD_LIMITS
from auvdock.core.errors import AuvdockError, ConfigError
from auvdock.core.memory import relax_collector

__all__ = ["RayExecutor"]

PREFETCH = 2
"""Specs that an actor holds at a time: the one it runs and the next."""
START_LIMIT_S = 300.0
"""Time without any usable actor after which the campaign stops."""
TRIES = 3
"""Times that an episode may lose its actor before it counts as `crashed`; a lost machine is not the episode's fault."""


class RayExecutor:
    """Actors of one core each, spread by Ray over its nodes.

    An actor that is lost, alone or with its node, is asked for anew; Ray places it when a core is free, and until then
    the others go on.
    """

    def __init__(self, workers: int | None, limit_s: float, address: str | None) -> None:
        """Connect to a cluster.

        Args:
            workers: actors; None for one per core of the cluster.
            limit_s: wall-clock limit of an episode.
            address: of a running cluster, "auto" to find one; None starts one on this machine.

        Raises:
            ConfigError: Ray is not installed or does not answer at the address.
        """
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        try:
            ray: Any = import_module("ray")  # optional: type checkers must not need it
        except ImportError as error:
            raise ConfigError("executor", "ray", "process, or install Ray: pip install 'auvdock[ray]'") from error
        self._ray = ray
        self._limit_s = limit_s
        environment = {"env_vars": dict(THREAD_LIMITS)}
        try:
            ray.init(
                address=address or "local",
                num_cpus=None if address else workers,
                include_dashboard=None if address else False,
                log_to_driver=False,
                logging_level="ERROR",
                runtime_env=environment,
            )
        except (ConnectionError, RuntimeError, ValueError) as error:
            short = str(error).strip().splitlines()[0]
            raise ConfigError(
                "address", address, f"the address of a running Ray cluster, with RAY_AUTH_MODE as it has it ({short})"
            ) from error
        self._count = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
        self._make: Any = None
        self._actors: list[_Actor] = []
        self._calls: dict[Any, _Actor] = {}
        self._peaks_mb: dict[int, float] = {}
        self._losses: dict[int, int] = {}
        self._usable_since = time.monotonic()

    def start(self, job: Job) -> None:
        """Ask for the actors."""
        # max_restarts 0: a restarted actor would run its queued episodes again behind our back.
        remote = self._ray.remote(num_cpus=1, max_restarts=0, max_task_retries=0)(_Remote)
        packed = self._ray.put(job)
        self._make = lambda: remote.remote(packed)
        self._usable_since = time.monotonic()
        self._actors = [self._new(slot) for slot in range(self._count)]

    def run(self, specs: Iterable[EpisodeSpec]) -> Iterator[Row]:
        """Rows as they finish."""
        source = iter(specs)
        again: deque[EpisodeSpec] = deque()
        spare = next(source, None)
        while True:
            for depth in range(PREFETCH):
                for actor in self._actors:
                    if actor.is_ready and len(actor.held) <= depth and (again or spare is not None):
                        if again:
                            self._give(actor, again.popleft())
                        elif spare is not None:
                            self._give(actor, spare)
                            spare = next(source, None)
            if spare is None and not again and not any(actor.held for actor in self._actors):
                return
            yield from self._wait(again)

    def close(self) -> None:
        """Give the actors back and leave the cluster; one that was started here ends."""
        for actor in self._actors:
            self._ray.kill(actor.handle)
        self._actors = []
        self._ray.shutdown()

    @property
    def workers(self) -> int:
        """Number of actors."""
        return self._count

    @property
    def peak_rss_mb(self) -> float:
        """Sum over the actors, each at its own peak; without Ray's own processes."""
        return sum(self._peaks_mb.values())

    def _wait(self, again: deque[EpisodeSpec]) -> Iterator[Row]:
        now = time.monotonic()
        deadline = min((actor.deadline for actor in self._actors), default=now)
        timeout_s = min(5.0, max(0.0, deadline - now))
        done, _ = self._ray.wait(list(self._calls), num_returns=1, timeout=timeout_s)
        for call in done:
            actor = self._calls.pop(call)
            try:
                answer = self._ray.get(call)
            except self._ray.exceptions.RayError as error:
                yield from self._lost(actor, again, error)
                continue
            if isinstance(answer, AuvdockError):
                raise answer
            if not actor.is_ready:
                actor.is_ready = True
                continue
            row, peak_mb = answer
            self._peaks_mb[actor.slot] = max(self._peaks_mb.get(actor.slot, 0.0), peak_mb)
            actor.held.popleft()
            actor.deadline = time.monotonic() + self._limit_s if actor.held else float("inf")
            yield row
        for actor in [actor for actor in self._actors if time.monotonic() >= actor.deadline]:
            self._ray.kill(actor.handle)
            yield lost_row(actor.held.popleft(), "hung", f"no end within {self._limit_s:g} s")
            self._replace(actor, again)
        if any(actor.is_ready for actor in self._actors):
            self._usable_since = time.monotonic()
        elif time.monotonic() - self._usable_since > START_LIMIT_S:
            raise CampaignError(f"workers: no Ray actor became ready within {START_LIMIT_S:g} s; add nodes")

    def _lost(self, actor: _Actor, again: deque[EpisodeSpec], error: Exception) -> Iterator[Row]:
        if actor not in self._actors:
            return  # replaced already; this was its second call
        if actor.held and actor.is_ready:
            culprit = actor.held.popleft()
            self._losses[culprit.episode] = self._losses.get(culprit.episode, 0) + 1
            if self._losses[culprit.episode] < TRIES:
                again.append(culprit)
            else:
                yield lost_row(culprit, "crashed", f"its worker ended {TRIES} times ({type(error).__name__})")
        self._replace(actor, again)

    def _replace(self, actor: _Actor, again: deque[EpisodeSpec]) -> None:
        again.extend(actor.held)
        for call in [call for call, owner in self._calls.items() if owner is actor]:
            del self._calls[call]
        self._actors[self._actors.index(actor)] = self._new(actor.slot)

    def _new(self, slot: int) -> _Actor:
        actor = _Actor(slot, self._make())
        self._calls[actor.handle.ready.remote()] = actor
        return actor

    def _give(self, actor: _Actor, spec: EpisodeSpec) -> None:
        if not actor.held:
            actor.deadline = time.monotonic() + self._limit_s
        actor.held.append(spec)
        self._calls[actor.handle.run.remote(spec)] = actor


class _Actor:
    """Our end of an actor: its handle and the specs it holds."""

    def __init__(self, slot: int, handle: Any) -> None:  # noqa: ANN401 - Ray's handles have no type
        self.slot = slot
        self.handle = handle
        self.held: deque[EpisodeSpec] = deque()
        self.is_ready = False
        self.deadline = float("inf")


class _Remote:
    """What Ray runs in the actor's process."""

    def __init__(self, job: Job) -> None:
        import cv2

        cv2.setNumThreads(1)
        self._refusal: AuvdockError | None = None
        try:
            self._run = job.build()
            relax_collector()
        except AuvdockError as error:
            self._refusal = error

    def ready(self) -> AuvdockError | None:
        """None once the job is built, else why it cannot be."""
        return self._refusal

    def run(self, spec: EpisodeSpec) -> tuple[Row, float] | AuvdockError:
        """One episode's row and this process's peak memory."""
        try:
            return attempt(self._run, spec), peak_rss_mb()
        except AuvdockError as error:
            return error
