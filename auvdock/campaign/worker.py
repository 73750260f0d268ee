"""The other end of a worker process's pipe."""

from __future__ import annotations

import os
import signal
import threading
import warnings
from contextlib import suppress
from multiprocessing import current_process, parent_process
from multiprocessing.connection import Connection, wait

import cv2

from auvdock.campaign.executor import peak_rss_mb
from auvdock.campaign.job import Job, attempt
from auvdock.core.errors import AuvdockError, AuvdockWarning
from auvdock.core.memory import relax_collector

__all__ = ["READY", "THREAD_LIMITS", "die_with_parent", "work"]

READY = "ready"
"""First message of a worker that has built its job."""

THREAD_LIMITS = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "LP_NUM_THREADS": "0",  # Mesa's software rasteriser
}
"""Environment of workers: one core each. Read when libraries load, so it must be set before a worker starts."""


def work(connection: Connection, job: Job) -> None:
    """Build the job, then answer each spec by its row and this process's peak memory until told to stop.

    An `AuvdockError` is sent instead of a row and ends the worker; other exceptions become `crashed` rows. The worker
    leaves the interrupt key to its parent, and dies with it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=die_with_parent, daemon=True).start()
    cv2.setNumThreads(1)
    if not current_process().name.endswith("-0"):  # all have the same machine to tell of; one is enough
        warnings.simplefilter("ignore", AuvdockWarning)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):  # the parent has gone
        try:
            run = job.build()
            relax_collector()
            connection.send(READY)
            while (spec := connection.recv()) is not None:
                connection.send((attempt(run, spec), peak_rss_mb()))
        except AuvdockError as error:
            connection.send(error)


def die_with_parent() -> None:
    """Wait for the parent process to end, then end this one; for a thread of its own."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
