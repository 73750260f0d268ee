"""`auvdock perceive` on rendered footage: poses against the renderer's, files that it reads and writes, bad input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from footage_scene import ARRAY_M, CAMERA, approach, images, write_images, write_settings
from recording.recording_reader import Recording

from auvdock.cli.main import main
from auvdock.recording import paths

COUNT = 12
POSES = approach(COUNT, roll_deg=4.0)


@pytest.fixture(scope="module")
def taken():
    return images(POSES)


@pytest.fixture
def footage(tmp_path: Path, taken) -> tuple[Path, list[str], list[str]]:
    """Folder of images, their names, flags of station and camera."""
    return tmp_path / "shots", write_images(tmp_path / "shots", taken), write_settings(tmp_path)


def rows_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def run(code: int, capsys, *words: object) -> tuple[str, str]:
    assert main(["perceive", *map(str, words)]) == code, capsys.readouterr().err
    captured = capsys.readouterr()
    return captured.out, captured.err


def bad(capsys, *words: object) -> str:
    """The one line that a command says which cannot be used."""
    out, err = run(2, capsys, *words)
    assert out == ""
    assert err.count("\n") == 1, err
    return err


def check_poses(rows: list[dict[str, Any]], poses) -> int:
    """Measured poses are right within 5 % of the range, names belong to their lights; how many poses there are."""
    found = 0
    for row, T in zip(rows, poses, strict=True):
        assert len(row["lights"]) == len(row["beacon_ids"])
        for place, beacon in zip(row["lights"], row["beacon_ids"], strict=True):
            if beacon is not None:
                (there,) = CAMERA.project((ARRAY_M[[beacon]] - T[:3, 3]) @ T[:3, :3])
                assert np.hypot(*(there - place)) < 4.0
        if row["measured"]:
            found += 1
            pose = np.array(row["pose"])
            assert np.linalg.norm(pose[:3, 3] - T[:3, 3]) < 0.3
            assert row["reprojection_error_px"] < 1.0
    return found


def test_images_give_names_and_poses_as_rendered(footage, tmp_path, capsys):
    folder, names, flags = footage
    out, err = run(0, capsys, folder, *flags, "--out", tmp_path / "rows.jsonl")
    rows = rows_of(tmp_path / "rows.jsonl")
    assert [row["frame"] for row in rows] == names  # shot2 before shot10
    assert check_poses(rows, POSES) >= COUNT - 4
    assert "upright" in err
    assert "12 of 12" in out
    run(0, capsys, folder, *flags, "--out", tmp_path / "rows.parquet")
    assert pq.read_table(tmp_path / "rows.parquet").to_pylist() == rows


def test_damaged_and_odd_frames_are_told_and_passed_over(footage, tmp_path, capsys):
    folder, names, flags = footage
    whole = (folder / names[5]).read_bytes()
    (folder / names[5]).write_bytes(whole[: len(whole) // 2])
    (folder / names[7]).write_bytes(b"")
    cv2.imwrite(str(folder / names[9]), np.zeros((50, 60, 3), dtype=np.uint8))
    _, err = run(0, capsys, folder, *flags, "--out", tmp_path / "rows.jsonl")
    told = [line for line in err.splitlines() if "passed over" in line]
    assert [name for name in names if any(f"{name}:" in line for line in told)] == [names[5], names[7], names[9]]
    left = [k for k in range(COUNT) if k not in (5, 7, 9)]
    rows = rows_of(tmp_path / "rows.jsonl")
    assert [row["frame"] for row in rows] == [names[k] for k in left]
    assert check_poses(rows, [POSES[k] for k in left]) >= 4


def test_half_a_jpeg_is_damaged(footage, capsys):
    folder, names, flags = footage
    _, encoded = cv2.imencode(".jpg", np.asarray(cv2.imread(str(folder / names[0]))))
    data = encoded.tobytes()
    (folder / "half.jpg").write_bytes(data[: len(data) * 2 // 3])
    assert "half.jpg: damaged" in run(0, capsys, folder, *flags)[1]


def test_attitude_file_in_the_words_of_a_log(tmp_path, capsys):
    """Of a vehicle rolled by 55° to starboard and 8° nose up the lights are named right by its log, not without it."""
    poses = approach(6, roll_deg=55.0, pitch_deg=-8.0)
    names = write_images(tmp_path / "rolled", images(poses))
    words = [tmp_path / "rolled", *write_settings(tmp_path), "--out", tmp_path / "rows.jsonl"]
    run(0, capsys, *words)
    upright = [row for row in rows_of(tmp_path / "rows.jsonl") if row["measured"]]
    for row in upright:  # the ring of six repeats every 60°
        assert row["beacon_ids"] != list(range(6))
    log = tmp_path / "log.csv"
    log.write_text(f"frame,roll_deg,pitch_deg,heading_deg,depth_m\n{names[0]},55,8,180,8\n", encoding="utf-8")
    _, err = run(0, capsys, *words, "--attitude", log, "--station-heading-deg", "0")
    assert "upright" not in err
    assert check_poses(rows_of(tmp_path / "rows.jsonl"), poses) >= 3


def test_video_in_annotated_video_and_recording_out_and_in_again(footage, taken, tmp_path, capsys):
    _, _, flags = footage
    film, shown, record = tmp_path / "film.avi", tmp_path / "shown.mp4", tmp_path / "seen.rrd"
    size = (CAMERA.width_px, CAMERA.height_px)
    writer = cv2.VideoWriter(str(film), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, size)
    for image in taken:
        writer.write(cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    writer.release()
    out = tmp_path / "rows.jsonl"
    run(0, capsys, film, *flags, "--out", out, "--video", shown, "--record", record)
    rows = rows_of(out)
    assert [row["frame"] for row in rows] == list(range(COUNT))
    assert check_poses(rows, POSES) >= COUNT - 4
    video = cv2.VideoCapture(str(shown))
    frames = []
    while (read := video.read())[0]:
        frames.append(read[1])
    assert len(frames) == COUNT
    change = np.abs(frames[-1].astype(int) - cv2.cvtColor(taken[-1], cv2.COLOR_RGB2BGR)).max(axis=2)
    for x, y in rows[-1]["lights"]:  # a ring about each light
        assert change[round(y) - 11 : round(y) + 12, round(x) - 11 : round(x) + 12].max() > 60
    recording = Recording(record)
    assert {paths.IMAGE, paths.DETECTIONS, paths.TRACKS, paths.ESTIMATES, paths.VEHICLE} <= recording.temporal_entities
    assert len(recording.column(paths.DETECTIONS, "Boxes2D:centers").values[-1]) == len(rows[-1]["lights"])
    run(0, capsys, record, *flags, "--out", out)
    again = rows_of(out)
    assert [row["frame"] for row in again] == list(range(COUNT))
    assert check_poses(again, POSES) >= COUNT - 4


def test_bad_input_is_one_line(footage, tmp_path, capsys):
    folder, _, flags = footage
    station, camera = flags[:2], flags[2:]
    empty = tmp_path / "empty"
    empty.mkdir()
    (tmp_path / "words.mp4").write_text("no video", encoding="utf-8")
    (tmp_path / "words.rrd").write_text("no recording", encoding="utf-8")
    assert "images" in bad(capsys, empty, *flags)
    assert "exists" in bad(capsys, tmp_path / "nothing", *flags)
    assert "video" in bad(capsys, tmp_path / "words.mp4", *flags)
    assert "recording" in bad(capsys, tmp_path / "words.rrd", *flags)
    assert "no.toml" in bad(capsys, folder, *camera, "--station", tmp_path / "no.toml")
    assert "no.yaml" in bad(capsys, folder, *station, "--camera", tmp_path / "no.yaml")
    assert ".parquet" in bad(capsys, folder, *flags, "--out", tmp_path / "rows.csv")
    assert "cores" in bad(capsys, folder, *flags, "--detector", "eyes")
    text = Path(camera[1]).read_text(encoding="utf-8").replace("height_px = 360", "height_px = 480")
    (tmp_path / "wrong.toml").write_text(text, encoding="utf-8")
    assert "640 x 360" in bad(capsys, folder, *station, "--camera", tmp_path / "wrong.toml")
    for name in folder.iterdir():
        name.write_bytes(b"")
    assert "whole frames" in run(2, capsys, folder, *flags)[1].splitlines()[-1]
