"""Where footage comes from: a folder of images or a video, frame by frame."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Protocol

import cv2
import numpy as np

from auvdock.core.arrays import Image
from auvdock.core.errors import ConfigError

__all__ = ["FolderFootage", "Footage", "Shot", "VideoFootage", "decoded", "open_footage"]

IMAGES = frozenset((".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff", ".webp"))
"""Endings of files that are taken for images."""
_ENDS = {b"\xff\xd8": b"\xff\xd9", b"\x89PNG": b"IEND"}
"""How a file begins and must end: OpenCV shows what there is of a JPEG or PNG file that was cut off, and grey below."""
_TAIL = 1024


class Shot(NamedTuple):
    """One frame of footage.

    Attributes:
        frame: the file's name, or the frame's number from 0.
        image: (H, W, 3) uint8 RGB, None where the frame is damaged.
        time_s: of the frame where the source tells it.
    """

    frame: str | int
    image: Image | None
    time_s: float | None = None


class Footage(Protocol):
    """Frames of one camera, in the order of time."""

    @property
    def rate_hz(self) -> float | None:
        """Frames a second where the source tells them."""
        ...

    def __len__(self) -> int:
        """How many frames there are, as far as the source knows."""
        ...

    def shots(self) -> Iterator[Shot]:
        """The frames, one after the other."""
        ...


class FolderFootage:
    """The images of a folder, in the order of their names; numbers in them count as numbers."""

    rate_hz = None

    def __init__(self, folder: Path) -> None:
        """Look for images.

        Raises:
            ConfigError: there are none, or the folder cannot be read.
        """
        try:
            found = [path for path in folder.iterdir() if path.suffix.lower() in IMAGES and path.is_file()]
        except OSError as error:
            raise ConfigError("source", str(folder), f"a folder that can be read ({error.strerror})") from error
        if not found:
            raise ConfigError("source", str(folder), f"a folder with images ({', '.join(sorted(IMAGES))})")
        self._paths = sorted(found, key=_by_number)

    def __len__(self) -> int:
        """How many images there are."""
        return len(self._paths)

    def shots(self) -> Iterator[Shot]:
        """The images."""
        for path in self._paths:
            try:
                data = path.read_bytes()
            except OSError:
                data = b""
            yield Shot(path.name, decoded(data))


class VideoFootage:
    """The frames of a video that OpenCV reads."""

    def __init__(self, path: Path) -> None:
        """Open it.

        Raises:
            ConfigError: OpenCV finds no video in it.
        """
        self._path = path
        video = self._open()
        self._count = max(int(video.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
        rate_hz = float(video.get(cv2.CAP_PROP_FPS))
        self.rate_hz = rate_hz if 0.0 < rate_hz <= 1000.0 else None
        video.release()

    def __len__(self) -> int:
        """How many frames the video says that it has."""
        return self._count

    def shots(self) -> Iterator[Shot]:
        """The frames."""
        video = self._open()
        number = 0
        try:
            while video.grab():
                done, image = video.retrieve()
                yield Shot(number, _rgb(np.asarray(image, dtype=np.uint8)) if done else None)
                number += 1
        finally:
            video.release()

    def _open(self) -> cv2.VideoCapture:
        video = cv2.VideoCapture(str(self._path), cv2.CAP_FFMPEG)
        if not video.isOpened():
            raise ConfigError("source", str(self._path), "a folder of images, a video that OpenCV reads, or a .rrd")
        return video


def open_footage(path: Path) -> Footage:
    """The footage of a folder or a video.

    Raises:
        ConfigError: there is none.
    """
    if path.is_dir():
        return FolderFootage(path)
    if not path.exists():
        raise ConfigError("source", str(path), "a folder of images or a file that exists")
    return VideoFootage(path)


def decoded(data: bytes) -> Image | None:
    """(H, W, 3) uint8 RGB of an image file's bytes, None where they hold no whole image."""
    if not data:
        return None
    for start, end in _ENDS.items():
        if data.startswith(start) and end not in data[-_TAIL:]:
            return None
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        return None
    # OpenCV gives None where it cannot read, which its stubs do not say.
    return None if image is None else _rgb(np.asarray(image, dtype=np.uint8))  # pyright: ignore[reportUnnecessaryComparison]


def _rgb(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _by_number(path: Path) -> tuple[tuple[tuple[int, str], ...], str]:
    """Sort key: stretches of digits by their value."""
    parts = re.findall(r"\d+|\D+", path.name)
    return tuple((int(part), "") if part.isdecimal() else (-1, part) for part in parts), path.name
