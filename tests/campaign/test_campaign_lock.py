"""One writer a folder: the lock ends with its process, and each reason why it cannot be had has a line of its own."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import filelock
import pytest

from auvdock.campaign.errors import CampaignError
from auvdock.campaign.lock import FolderLock

HOLDS = """
import sys
from pathlib import Path
from auvdock.campaign.lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


def test_a_killed_process_leaves_the_folder_free(tmp_path):
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(CampaignError, match="another sweep is writing there"):
            FolderLock(tmp_path)
        holder.kill()
        holder.wait(20.0)
        FolderLock(tmp_path).release()
    finally:
        holder.kill()
        holder.communicate()


def test_it_can_be_given_back_and_taken_again(tmp_path):
    for _ in range(2):
        lock = FolderLock(tmp_path)
        lock.release()
        lock.release()


@pytest.mark.parametrize(
    ("number", "remedy"),
    [
        (errno.EACCES, "make it writable"),
        (errno.EROFS, "make it writable or give another --out"),
        (errno.ENOSPC, "make room"),
        (errno.ENOENT, "make it writable"),
        (errno.ENOLCK, "local disk"),
        (errno.ENOSYS, "local disk"),
        (errno.EOPNOTSUPP, "local disk"),
    ],
)
def test_why_there_is_no_lock(number, remedy, tmp_path, monkeypatch):
    def refuse(self):
        raise OSError(number, os.strerror(number), str(tmp_path))

    monkeypatch.setattr(filelock.FileLock, "_acquire", refuse)
    with pytest.raises(CampaignError) as caught:
        FolderLock(tmp_path)
    assert os.strerror(number) in str(caught.value)
    assert remedy in str(caught.value)
    assert "another sweep" not in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_in_the_lock_s_place(tmp_path):
    (tmp_path / ".lock").mkdir()
    with pytest.raises(CampaignError, match="cannot be written"):
        FolderLock(Path(tmp_path))
