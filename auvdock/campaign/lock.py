"""One writer at a time in a campaign's folder, held by the kernel: it ends with its process, however that ends."""

from __future__ import annotations

import errno
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.journal import readable_errors

__all__ = ["FolderLock"]

LOCK = ".lock"
_WITHOUT_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}


class FolderLock:
    """The right to write in a folder."""

    def __init__(self, folder: Path) -> None:
        """Take it.

        Raises:
            CampaignError: another process has it, the folder cannot be written, or its file system has no locks.
        """
        # Never a lock of another kind: one that is a mere file would outlive a process that is killed.
        self._lock = FileLock(folder / LOCK, fallback_to_soft=False, thread_local=False)
        with readable_errors(folder):
            try:
                self._lock.acquire(blocking=False)
            except Timeout as error:
                raise CampaignError(f"{folder}: another sweep is writing there; wait for it") from error
            except OSError as error:
                if error.errno not in _WITHOUT_LOCKS:
                    raise
                why = f"its file system cannot keep two sweeps apart ({error.strerror or error})"
                raise CampaignError(f"{folder}: {why}; give an --out on a local disk") from error

    def release(self) -> None:
        """Give it back."""
        with suppress(OSError):
            self._lock.release()
