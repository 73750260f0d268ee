"""A file that cannot be written any further ends the recording, not the episode; and nothing hangs."""

from __future__ import annotations

import errno
import os
import resource
import threading
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
import rerun as rr
from recording_reader import Recording
from synthetic_episode import make_result, make_setup, ticks

from auvdock.core.errors import ConfigError
from auvdock.recording import paths
from auvdock.recording.file import RecordingFile
from auvdock.recording.rerun_recorder import RecordingWarning, RerunRecorder

pytestmark = pytest.mark.skipif(not Path("/dev/fd").is_dir(), reason="Rerun writes the file itself here")
LIMIT = 1_000_000  # a batch of 256 periods and its pictures take less
FULL = Path("/dev/full")


@contextmanager
def largest_file(size: int) -> Generator[None]:
    """No file of this process may grow beyond `size`."""
    before, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (before, most))


def record(recorder: RerunRecorder, count: int) -> None:
    setup = make_setup(160, 90)
    recorder.on_start(setup)
    for tick in ticks(setup, count, images=True):
        recorder.on_tick(tick)
    recorder.on_end(make_result())
    with pytest.warns(RecordingWarning, match=os.strerror(errno.EFBIG)):
        recorder.close()


def test_a_limit_reached_in_mid_episode(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    recorder = RerunRecorder(path)
    with largest_file(LIMIT):
        record(recorder, 1500)
    assert recorder.failure == os.strerror(errno.EFBIG)
    assert path.stat().st_size <= LIMIT
    frames = Recording(path).column(paths.VEHICLE, "Transform3D:translation").frames
    assert 256 <= len(frames) < 1500
    assert frames == list(range(len(frames)))


def test_the_next_recording_is_whole_again(tmp_path: Path) -> None:
    recorder = RerunRecorder(tmp_path / "run.rrd")
    with largest_file(100_000):
        record(recorder, 60)
    setup = make_setup(160, 90)
    recorder.on_start(setup)
    assert recorder.failure is None
    for tick in ticks(setup, 10):
        recorder.on_tick(tick)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recorder.close()
    assert recorder.failure is None
    assert len(Recording(recorder.path).column(paths.VEHICLE, "Transform3D:translation").frames) == 10


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
def test_a_disk_that_is_full_from_the_start(tmp_path: Path) -> None:
    path = tmp_path / "full.rrd"
    path.symlink_to(FULL)
    recorder = RerunRecorder(path)
    recorder.on_start(make_setup(160, 90))
    recorder.on_end(make_result())
    with pytest.warns(RecordingWarning):
        recorder.close()
    assert recorder.failure == os.strerror(errno.ENOSPC)


def test_a_folder_that_goes_away_before_the_start_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    recorder = RerunRecorder(folder / "run.rrd")
    folder.rmdir()
    with pytest.raises(ConfigError, match="No such file"):
        recorder.on_start(make_setup(160, 90))
    recorder.close()


def test_nothing_is_left_open_or_running(tmp_path: Path) -> None:
    def open_files() -> int:
        return len(os.listdir("/dev/fd"))

    stream = rr.RecordingStream(paths.APPLICATION_ID)
    before, threads = open_files(), threading.active_count()
    for number in range(3):
        file = RecordingFile(stream, tmp_path / f"{number}.rrd")
        stream.log("a", rr.TextLog("x" * 200_000))
        file.flush()
        file.close()
        assert file.failure is None
        assert (tmp_path / f"{number}.rrd").read_bytes().endswith(b"RRF2FOOT\x01\x00\x00\x00")
    assert open_files() <= before
    assert threading.active_count() == threads
