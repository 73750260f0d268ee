"""Footage in recordings: what perception said of it, written as episodes are; frames of a recording read back."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from auvdock.core.arrays import Image
from auvdock.core.camera import Camera
from auvdock.core.errors import AuvdockError, ConfigError
from auvdock.core.stations import StationCfg
from auvdock.core.transforms import invert
from auvdock.core.vehicle import load_vehicle
from auvdock.episode.trace import EpisodeSetup
from auvdock.footage.perceiving import Seen
from auvdock.footage.sources import Shot, decoded
from auvdock.recording import paths
from auvdock.recording.batch import Batch
from auvdock.recording.file import RecordingFile
from auvdock.recording.layout import make_blueprint
from auvdock.recording.lights import write_images, write_lights
from auvdock.recording.parts import part_of
from auvdock.recording.rerun_recorder import check_writable
from auvdock.recording.scene import log_surroundings

__all__ = ["FootageRecorder", "RecordedFootage"]

_BATCH = 64
_QUALITY = (cv2.IMWRITE_JPEG_QUALITY, 80)
_BLOB = "EncodedImage:blob"
_ANY_HULL = "bluerov2_heavy"
"""Footage tells of no hull and none is shown; the parts of recordings want to know of one."""


class FootageRecorder:
    """Records footage with what was made of it, in the views of an episode; there is no truth to compare with."""

    def __init__(self, path: Path, title: str, kind: str, station: StationCfg, camera: Camera, detector: str) -> None:
        """Open the file and write what stays the same.

        Args:
            path: file to write, with the ending .rrd.
            title: of the recording.
            kind: of the station, one of `auvdock.episode.stations.STATIONS`.
            station: the station.
            camera: that took the footage.
            detector: of lights, by name.

        Raises:
            ConfigError: the path cannot be written.
            AuvdockError: the environment switches Rerun off.
        """
        check_writable(path)
        self.failure: str | None = None
        """Why the file is incomplete; None as long as all is well."""
        stream = rr.RecordingStream(paths.APPLICATION_ID)
        if not rr.is_enabled(stream):
            raise AuvdockError("the environment variable RERUN switches recordings off; unset it to record")
        self._stream, self._file = stream, RecordingFile(stream, path)
        self._camera_body = invert(camera.T_body_camera)
        setup = EpisodeSetup(title, kind, station, load_vehicle(_ANY_HULL), camera, np.eye(4), detector, "unknown")
        part = part_of(setup)
        stream.send_recording_name(title)
        stream.send_blueprint(make_blueprint(setup, part))
        log_surroundings(stream, setup, part)
        text = f"# {title}\n\nFootage; detector *{detector}*. The world is the station: there is no other truth.\n"
        document = rr.TextDocument(text.encode("utf-8", "replace").decode(), media_type=rr.MediaType.MARKDOWN)
        stream.log(paths.SUMMARY, document, static=True, strict=True)
        self._waiting: list[tuple[int, Seen, bytes]] = []
        self._count = 0

    def add(self, seen: Seen) -> None:
        """Record a frame."""
        image = seen.shot.image
        if image is None:
            raise ValueError("a frame without an image cannot be recorded")
        self._waiting.append((self._count, seen, _jpeg(image)))
        self._count += 1
        if len(self._waiting) == _BATCH:
            self._write()

    def close(self) -> None:
        """Write what is left and close the file."""
        self._write()
        self._file.close()
        self.failure = self._file.failure

    def _write(self) -> None:
        waiting, self._waiting = self._waiting, []
        if not waiting or self._file.failure is not None:
            return
        numbers, seen, jpegs = zip(*waiting, strict=True)
        batch = Batch(self._stream, np.array(numbers), np.array([each.percept.time_s for each in seen]))
        write_images(batch, jpegs)
        write_lights(batch, [each.percept for each in seen])
        poses = [each.percept.pose for each in seen]
        measured = [pose for pose in poses if pose is not None and pose.measured]
        present = np.array([pose is not None and pose.measured for pose in poses])
        batch.scalars(paths.REPROJECTION, np.array([pose.reprojection_error_px for pose in measured]), present)
        if measured:
            cameras = np.array([pose.T_station_camera for pose in measured])
            places = cameras[:, :3, 3]
            batch.scalars(paths.RANGE, np.linalg.norm(places, axis=1), present)
            bodies = cameras @ self._camera_body
            at = batch.select(np.flatnonzero(present))
            at.send(paths.ESTIMATES, rr.Points3D.columns(positions=places))
            at.send(paths.VEHICLE, rr.Transform3D.columns(translation=bodies[:, :3, 3], mat3x3=bodies[:, :3, :3]))
        self._file.flush()


class RecordedFootage:
    """The bow or belly camera's frames of a recording of this package."""

    def __init__(self, path: Path) -> None:
        """Read the recording's frames.

        Raises:
            ConfigError: no recording, or one without frames.
        """
        if not path.is_file():
            raise ConfigError("source", str(path), "a folder of images or a file that exists")
        rows: list[tuple[int, float, bytes]] = []
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # a killed run has no footer: the reader says so and reads on
                reader = RrdReader(path)
                for entry in reader.recordings():
                    for chunk in reader.stream(store=entry):
                        if chunk.entity_path == paths.IMAGE and not chunk.is_static:
                            rows += _frames(chunk)
        except (OSError, RuntimeError, ValueError) as error:
            why = " ".join(str(error).split())
            raise ConfigError("source", str(path), f"a recording that can be read ({why})") from error
        if not rows:
            raise ConfigError("source", str(path), "a recording with the camera's frames, as `--fidelity pixels` makes")
        self._rows = sorted(rows, key=lambda row: row[0])

    @property
    def rate_hz(self) -> float | None:
        """Frames a second, by the median time between them."""
        times = np.array([time_s for _, time_s, _ in self._rows])
        step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
        return 1.0 / step if step > 0.0 else None

    def __len__(self) -> int:
        """How many frames there are."""
        return len(self._rows)

    def shots(self) -> Iterator[Shot]:
        """The frames, with the numbers and times of their control periods."""
        for number, time_s, jpeg in self._rows:
            yield Shot(number, decoded(jpeg), time_s)


def _frames(chunk: rr.chunk.Chunk) -> list[tuple[int, float, bytes]]:
    """Number, time and JPEG of each frame of a chunk."""
    batch = chunk.to_record_batch()
    if _BLOB not in batch.schema.names:
        return []
    numbers = batch.column(paths.FRAME).to_pylist()
    times_s = [value.value * 1e-9 for value in batch.column(paths.SIM_TIME)]
    blobs = batch.column(_BLOB)
    return [
        (number, time_s, np.asarray(blob.values.values.to_numpy(), dtype=np.uint8).tobytes())
        for number, time_s, blob in zip(numbers, times_s, blobs, strict=True)
    ]


def _jpeg(image: Image) -> bytes:
    _, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), _QUALITY)
    return data.tobytes()
