"""Files: checked up front, whole after an interrupt, readable after a kill, never mixed up."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from recording_reader import Recording, no_global_recording
from synthetic_episode import make_result, make_setup, ticks

from auvdock.core.errors import AuvdockError, ConfigError
from auvdock.recording import paths
from auvdock.recording.rerun_recorder import RerunRecorder

COUNT = 600
CHILD = """
import sys, time
from pathlib import Path
from synthetic_episode import make_setup, ticks
from auvdock.recording import rerun_recorder

# Batches by size alone, so that a slow machine cuts them where a fast one does; the half second has its own test.
rerun_recorder._BATCH_WALL_S = 1e9
setup = make_setup(160, 90)
recorder = rerun_recorder.RerunRecorder(Path(sys.argv[1]))
written = 0
try:
    recorder.on_start(setup)
    for tick in ticks(setup, int(sys.argv[2]), images=True):
        recorder.on_tick(tick)
        written += 1
    print("flown", flush=True)
    time.sleep(60.0)
finally:
    recorder.close()
    print(written, flush=True)
"""


def start_child(path: Path) -> subprocess.Popen[str]:
    """A process that records COUNT periods, says so, and then hangs in the middle of its episode."""
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(path), str(COUNT)],
        cwd=Path(__file__).parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Tests that were started in the background inherit that an interrupt is ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert child.stdout is not None
    assert child.stdout.readline().strip() == "flown", child.communicate()[1]
    return child


def assert_readable(path: Path, at_least: int) -> int:
    recording = Recording(path)
    frames = recording.column(paths.VEHICLE, "Transform3D:translation").frames
    assert frames == list(range(len(frames)))
    assert len(frames) >= at_least
    assert recording.column(paths.IMAGE, "EncodedImage:blob").frames == frames
    assert len(recording.blueprints) == 1
    (text,) = recording.static(paths.SUMMARY, "TextDocument:text")
    assert "No result" in text
    return len(frames)


def test_a_killed_run_leaves_all_whole_batches(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    child = start_child(path)
    time.sleep(0.5)  # the writing thread's own time
    child.send_signal(signal.SIGKILL)
    child.communicate(timeout=30)
    assert child.returncode == -signal.SIGKILL
    assert_readable(path, at_least=512)  # two batches of 256


def test_an_interrupted_run_leaves_everything(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    child = start_child(path)
    child.send_signal(signal.SIGINT)
    output, errors = child.communicate(timeout=30)
    assert "KeyboardInterrupt" in errors
    assert output.split() == [str(COUNT)]
    assert assert_readable(path, at_least=COUNT) == COUNT


def test_a_slow_episode_reaches_the_file_every_half_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr("auvdock.recording.rerun_recorder.time.monotonic", lambda: now_s)
    recorder = RerunRecorder(tmp_path / "run.rrd")
    setup = make_setup(160, 90)
    recorder.on_start(setup)
    for tick in ticks(setup, 8):
        recorder.on_tick(tick)
        now_s += 0.2
    frames: list[int] = []
    for _ in range(100):  # the writing thread takes a moment; until then the file may end within a message
        with contextlib.suppress(RuntimeError):
            frames = Recording(tmp_path / "run.rrd").column(paths.VEHICLE, "Transform3D:translation").frames
        if len(frames) >= 8:
            break
        time.sleep(0.05)
    assert frames == list(range(8))  # two batches of four periods: 0.0, 0.2, 0.4, 0.6 s
    recorder.close()


def test_two_recorders_do_not_mix(tmp_path: Path) -> None:
    first, second = RerunRecorder(tmp_path / "a.rrd"), RerunRecorder(tmp_path / "b.rrd")
    setup, other = make_setup(160, 90), make_setup(320, 180)
    first.on_start(setup)
    second.on_start(other)
    for index, tick in enumerate(ticks(setup, 40)):
        first.on_tick(tick)
        if index % 2:
            second.on_tick(tick)
    first.on_end(make_result())
    second.on_end(make_result(success=False))
    first.close()
    second.close()
    a, b = Recording(tmp_path / "a.rrd"), Recording(tmp_path / "b.rrd")
    assert len(a.recordings) == len(b.recordings) == 1
    assert a.recordings[0].recording_id != b.recordings[0].recording_id
    assert a.column(paths.VEHICLE, "Transform3D:translation").frames == list(range(40))
    assert b.column(paths.VEHICLE, "Transform3D:translation").frames == list(range(20))
    assert a.static(paths.CAMERA, "Pinhole:resolution") == [[160.0, 90.0]]
    assert b.static(paths.CAMERA, "Pinhole:resolution") == [[320.0, 180.0]]
    assert "docked" in a.static(paths.SUMMARY, "TextDocument:text")[0]
    assert "timeout" in b.static(paths.SUMMARY, "TextDocument:text")[0]
    assert no_global_recording()


def test_one_recorder_can_record_again(tmp_path: Path) -> None:
    setup = make_setup(160, 90)
    recorder = RerunRecorder(tmp_path / "run.rrd")
    for count in (30, 10):
        recorder.on_start(setup)
        for tick in ticks(setup, count):
            recorder.on_tick(tick)
        recorder.on_end(make_result())
        recorder.close()
    recording = Recording(tmp_path / "run.rrd")
    assert recording.column(paths.VEHICLE, "Transform3D:translation").frames == list(range(10))
    assert len(recording.recordings) == 1


def test_an_episode_without_a_period(tmp_path: Path) -> None:
    recorder = RerunRecorder(tmp_path / "run.rrd")
    recorder.on_start(make_setup(160, 90))
    recorder.on_end(make_result(success=False))
    recorder.close()
    recorder.close()
    recording = Recording(tmp_path / "run.rrd")
    assert paths.FUNNEL in recording.entities
    assert recording.column(paths.VEHICLE, "Transform3D:translation").frames == []


@pytest.mark.parametrize("name", ["missing/run.rrd", "folder.rrd", "file.txt/run.rrd", "run.mp4", "run"])
def test_a_path_that_cannot_be_written_is_refused_at_once(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.rrd").mkdir()
    (tmp_path / "file.txt").write_text("text")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(ConfigError) as caught:
        RerunRecorder(tmp_path / name)
    assert caught.value.field == "record"
    assert sorted(tmp_path.rglob("*")) == before


def test_the_check_leaves_the_folder_as_it_was(tmp_path: Path) -> None:
    RerunRecorder(tmp_path / "new.rrd")
    assert list(tmp_path.iterdir()) == []
    old = tmp_path / "old.rrd"
    old.write_bytes(b"an older recording")
    RerunRecorder(old)
    assert old.read_bytes() == b"an older recording"


@pytest.mark.parametrize("options", [{"image_every": 0}, {"jpeg_quality": 0}, {"jpeg_quality": 101}])
def test_numbers_out_of_range_are_refused(tmp_path: Path, options: dict[str, int]) -> None:
    with pytest.raises(ConfigError) as caught:
        RerunRecorder(tmp_path / "run.rrd", **options)
    assert caught.value.field in options


def test_rerun_switched_off_is_an_error_not_an_empty_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RERUN", "off")
    recorder = RerunRecorder(tmp_path / "run.rrd")
    with pytest.raises(AuvdockError, match="RERUN"):
        recorder.on_start(make_setup(160, 90))
    recorder.close()
