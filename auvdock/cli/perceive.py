"""`auvdock perceive SOURCE`: perception by itself on footage of one's own."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import tyro
from rich.table import Table

from auvdock.cli import exit_codes
from auvdock.cli.console import messages, output, tell, track
from auvdock.cli.parsing import parse
from auvdock.cli.saving import Saving
from auvdock.core.camera import Camera
from auvdock.core.errors import ConfigError, located
from auvdock.core.landing_station import LandingStationCfg
from auvdock.core.limits import Positive
from auvdock.core.station import ConicalStationCfg
from auvdock.core.stations import StationCfg
from auvdock.core.strict import load_toml
from auvdock.episode.stations import station_kind
from auvdock.footage.annotate import AnnotatedVideo
from auvdock.footage.attitude import read_attitude
from auvdock.footage.camera_file import read_camera
from auvdock.footage.perceiving import FootageCfg, FootagePerceiver, Seen
from auvdock.footage.rows import FootageRow, check_rows_file, write_rows
from auvdock.footage.scoring import Score, read_labels, score
from auvdock.footage.sources import Footage, open_footage
from auvdock.perception.landing.tag_families import TagFamily

__all__ = ["Perceive", "run"]

_UPRIGHT_SIGMA_DEG = 10.0
"""Of roll and pitch of a vehicle of which nothing is told."""
_LOGGED_SIGMA_DEG = 2.0
"""Of roll and pitch from a log: sensors, the camera's mounting, the survey of the station."""


@dataclass(frozen=True)
class Perceive:
    """Perceive lights, tags and poses in footage of one's own: a folder of images, a video, or a recording (.rrd).

    Exit code: 0 done, 2 input that cannot be used, 74 something could not be written.
    """

    source: Annotated[Path, tyro.conf.Positional]
    """Folder of images (in the order of their names), video, or recording."""
    station: Path
    """TOML file of the station, written as assets/stations are."""
    camera: Path
    """The camera: TOML, or the camera_info YAML that ROS' calibration tools write."""
    detector: str | None = None
    """threshold, blob, cores, halos, or your own as package.module:Name; without it halos for a ring, cores for a
    platform."""
    tag_family: TagFamily = "36h11"
    """Family of the landing station's tag."""
    tag_clahe: bool = False
    """Equalise contrast before the tag is looked for."""
    attitude: Path | None = None
    """CSV with frame (name or number), roll_deg (positive to starboard), pitch_deg (positive nose up), and perhaps
    heading_deg (clockwise from north) and depth_m; without it the vehicle is taken as roughly upright."""
    attitude_sigma_deg: Positive | None = None
    """Standard deviation of roll and pitch; without it 2 with --attitude and 10 without."""
    station_heading_deg: float | None = None
    """Heading that the station faces, from its mouth to the vehicle or to its platform's head; needs heading_deg."""
    rate: Positive | None = None
    """Frames a second, in place of what the video, the recording or the camera's file says."""
    out: Path | None = None
    """Write a row a frame here, .jsonl or .parquet."""
    video: Path | None = None
    """Write an annotated video here, .mp4 or .avi."""
    record: Path | None = None
    """Write a Rerun recording here."""
    labels: Path | None = None
    """JSON of labelled lights to compare with: {"frames": [{"frame", "lights": [{"id", "x", "y", "clipped"}]}]}."""


def run(argv: Sequence[str], prog: str) -> int:
    """Run the command."""
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # what cannot be read is said here, on one line
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    args = parse(Perceive, argv, prog)
    kind, station = _station(args.station)
    footage = _footage(args.source)
    camera = read_camera(args.camera, "down" if kind == "landing" else "forward", args.rate or footage.rate_hz)
    log = None if args.attitude is None else read_attitude(args.attitude)
    sigma_deg = args.attitude_sigma_deg or (_UPRIGHT_SIGMA_DEG if log is None else _LOGGED_SIGMA_DEG)
    cfg = FootageCfg(args.detector, args.tag_family, args.tag_clahe, sigma_deg, args.station_heading_deg)
    perceiver = FootagePerceiver(cfg, station, camera, log)
    if args.out is not None:
        check_rows_file(args.out)
    labels, array_m = None if args.labels is None else read_labels(args.labels), station.layout.array_positions_m
    rows, saving = _perceive(args, footage, perceiver, camera, kind, station)
    _print_summary(rows, len(footage), None if labels is None else score(rows, labels, camera, array_m))
    if log is None:
        tell(f"no --attitude: the vehicle was taken as upright within {sigma_deg:g} degrees (one standard deviation)")
    return saving.finish(exit_codes.DONE)


def _perceive(
    args: Perceive, footage: Footage, perceiver: FootagePerceiver, camera: Camera, kind: str, station: StationCfg
) -> tuple[list[FootageRow], Saving]:
    """Perceive all frames and write what was asked for."""
    saving, rows = Saving(), list[FootageRow]()
    with ExitStack() as opened:
        video = recorder = None
        if args.video is not None:
            video = AnnotatedVideo(args.video, camera, station.layout.array_positions_m)
            opened.callback(saving.attempt, args.video, lambda _: video.close())
        if args.record is not None:
            from auvdock.recording.footage import FootageRecorder  # half a second, for a recording alone

            title = f"{args.source.name} at {args.station.name}"
            recorder = FootageRecorder(args.record, title, kind, station, camera, perceiver.detector)
            opened.callback(recorder.close)
        for seen in _seen(footage, perceiver, camera):
            rows.append(seen.row)
            if video is not None:
                video.add(seen)
            if recorder is not None:
                recorder.add(seen)
    if recorder is not None and args.record is not None:
        failure = recorder.failure
        saving.note(args.record, None if failure is None else f"recording {args.record} is incomplete: {failure}")
    if args.out is not None:
        saving.attempt(args.out, lambda path: write_rows(rows, path))
    return rows, saving


def _seen(footage: Footage, perceiver: FootagePerceiver, camera: Camera) -> Iterator[Seen]:
    """Every whole frame of the camera's size, perceived; of the others it is told.

    Raises:
        ConfigError: the first whole frame is of another size than the calibration, or there is none.
    """
    size = (camera.height_px, camera.width_px)
    any_whole = False
    for shot in track(footage.shots(), "perceiving", len(footage) or None):
        fault = None if shot.image is not None else "damaged"
        if shot.image is not None and shot.image.shape[:2] != size:
            height, width = shot.image.shape[:2]
            if not any_whole:
                remedy = f"a calibration for the footage's {width} x {height} pixels"
                raise ConfigError("camera", f"{camera.width_px} x {camera.height_px} pixels", remedy)
            fault = f"of {width} x {height} pixels, not the camera's"
        if fault is not None:
            tell(f"{shot.frame}: {fault}, passed over")
            perceiver.skip()
            continue
        any_whole = True
        yield perceiver.perceive(shot)
    if not any_whole:
        raise ConfigError("source", "no frame that can be read", "footage with whole frames")


def _add_score(table: Table, compared: Score) -> None:
    found, lights, frames = compared.found, compared.lights, compared.frames
    table.add_section()
    table.add_row("labelled frames", f"{frames}")
    table.add_row("lights found", f"{found} of {lights} ({100.0 * found / max(lights, 1):.1f} %)")
    table.add_row("spurious lights a labelled frame", f"{compared.spurious / max(frames, 1):.3f}")
    table.add_row("median error of a light", "-" if compared.error_px is None else f"{compared.error_px:.2f} px")
    share = 100.0 * compared.right / max(compared.enough, 1)
    table.add_row("right pose, of frames with 4 lights", f"{compared.right} of {compared.enough} ({share:.1f} %)")
    table.add_row("wrong poses", f"{compared.wrong}")
    table.add_row("frames with a wrong name", f"{compared.misnamed}")


def _footage(source: Path) -> Footage:
    if source.suffix != ".rrd":
        return open_footage(source)
    from auvdock.recording.footage import RecordedFootage

    return RecordedFootage(source)


def _station(path: Path) -> tuple[str, StationCfg]:
    """Kind and content of a station's file."""
    with located("station."):
        kind = station_kind(path)
        return kind, load_toml(LandingStationCfg if kind == "landing" else ConicalStationCfg, path)


def _print_summary(rows: Sequence[FootageRow], frames: int, compared: Score | None) -> None:
    measured = [row for row in rows if row.measured]
    errors = [row.reprojection_error_px for row in measured if row.reprojection_error_px is not None]
    table = Table()
    table.add_column("footage")
    table.add_column("value", justify="right")
    table.add_row("frames perceived", f"{len(rows)} of {max(frames, len(rows))}")
    table.add_row("lights a frame", f"{np.mean([len(row.lights) for row in rows]):.2f}")
    table.add_row("frames with a pose", f"{len(measured)} ({100.0 * len(measured) / len(rows):.1f} %)")
    table.add_row("median reprojection error", f"{np.median(errors):.2f} px" if errors else "-")
    if compared is not None:
        _add_score(table, compared)
    output().print(table)
    if not measured:
        messages().print("no pose: are --station and --camera those of the footage?", highlight=False, soft_wrap=True)
